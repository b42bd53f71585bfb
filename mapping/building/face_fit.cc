#include "mapping/building/face_fit.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace slcmap::inline mapping {
namespace {

constexpr double kAreaCell_m = 0.1;
constexpr double kLeastStripSigma_m = 0.003;  // no wall is flatter
constexpr double kStripBias_m = 0.01;         // of a strip with few samples, whatever they claim
constexpr double kHeadingPrior = 0.1;         // of the slope, where nothing but one strip is known

// Tukey's, which goes to zero: what stands a little before a wall, as skirtings do, has little part
// in it. At least the distance within which faces are one counts as near.
double RobustWeight(const HeadedSample& sample, const FaceFit& fit, double merge_m) {
  const double reach_m = std::max(merge_m, 2.5 * sample.sigma_m);
  const double share = (sample.n - fit.At(sample.s)) / reach_m;
  return share * share < 1 ? (1 - share * share) * (1 - share * share) : 0;
}

// Weighted means by strip; a strip without samples is not among them.
std::vector<StripMean> StripMeans(const std::vector<HeadedSample>& samples,
                                  const std::vector<int>& members, const FaceFit& fit,
                                  double merge_m) {
  struct Sum {
    double weight = 0, s = 0, n = 0;
    int count = 0;
  };
  std::map<int, Sum> sums;
  for (const int i : members) {
    const HeadedSample& sample = samples[i];
    const double robust = RobustWeight(sample, fit, merge_m);
    if (robust <= 0) continue;
    Sum& sum = sums[static_cast<int>(std::floor(sample.s / kStrip_m))];
    const double weight = robust / (sample.sigma_m * sample.sigma_m);
    sum.weight += weight;
    sum.s += weight * sample.s;
    sum.n += weight * sample.n;
    ++sum.count;
  }
  std::vector<StripMean> means;
  for (const auto& [strip, sum] : sums) {
    const double bias2 = kStripBias_m * kStripBias_m / sum.count;
    means.push_back({sum.s / sum.weight, sum.n / sum.weight,
                     std::max(1 / sum.weight, bias2) + kLeastStripSigma_m * kLeastStripSigma_m});
  }
  return means;
}

// Samples within the gate of the line, beside its ends by at most a strip.
std::vector<int> Members(const std::vector<HeadedSample>& samples, const FaceFit& fit,
                         double tolerance_cosine, double gate_m) {
  const double length = std::sqrt(1 + fit.slope * fit.slope);
  std::vector<int> members;
  auto at = std::lower_bound(samples.begin(), samples.end(), fit.from_m - kStrip_m,
                             [](const HeadedSample& sample, double s) { return sample.s < s; });
  for (; at != samples.end() && at->s <= fit.to_m + kStrip_m; ++at) {
    if (std::abs(at->n - fit.At(at->s)) > gate_m) continue;
    // Components of the normal along the heading and along s.
    const double cosine = (at->normal.x() - fit.slope * at->normal.y()) / length;
    if (at->has_normal && cosine < tolerance_cosine) continue;
    members.push_back(static_cast<int>(at - samples.begin()));
  }
  return members;
}

// Ends of what was measured, but for a few stray samples.
void SetEnds(const std::vector<HeadedSample>& samples, const std::vector<int>& members,
             FaceFit* fit) {
  const size_t stray = members.size() / 200;
  fit->from_m = samples[members[stray]].s;
  fit->to_m = samples[members[members.size() - 1 - stray]].s;
}

// What the errors of the samples have in common, which no number of them averages out.
double CommonSigma(const std::vector<HeadedSample>& samples, const std::vector<int>& members) {
  constexpr double kCommonShare = 0.2;  // of one's
  double weight = 0;
  for (const int i : members) weight += 1 / (samples[i].sigma_m * samples[i].sigma_m);
  return kCommonShare * std::sqrt(static_cast<double>(members.size()) / weight);
}

}  // namespace

double FaceFit::SigmaAt(double s) const {
  return std::hypot(offset_sigma_m, (s - middle_m) * slope_sigma);
}

double CellArea(const std::set<std::pair<int, int>>& cells) {
  return static_cast<double>(cells.size()) * kAreaCell_m * kAreaCell_m;
}

std::pair<int, int> FindAreaCell(double s, double z) {
  return {static_cast<int>(std::floor(s / kAreaCell_m)),
          static_cast<int>(std::floor(z / kAreaCell_m))};
}

FaceFit FitStrips(const std::vector<StripMean>& strips) {
  double weight = 0, s_sum = 0, n_sum = 0;
  for (const StripMean& strip : strips) {
    weight += 1 / strip.variance_m2;
    s_sum += strip.s / strip.variance_m2;
    n_sum += strip.n / strip.variance_m2;
  }
  FaceFit fit;
  fit.middle_m = s_sum / weight;
  fit.offset_m = n_sum / weight;
  double ss = 0, sn = 0;
  for (const StripMean& strip : strips) {
    const double s = strip.s - fit.middle_m;
    ss += s * s / strip.variance_m2;
    sn += s * (strip.n - fit.offset_m) / strip.variance_m2;
  }
  const double prior = 1 / (kHeadingPrior * kHeadingPrior);
  fit.slope = sn / (ss + prior);
  double squares = 0;
  for (const StripMean& strip : strips) {
    const double residual = strip.n - fit.At(strip.s);
    squares += residual * residual / strip.variance_m2;
  }
  // Strips within the length along which a wall bends are not independent of each other.
  const double count = static_cast<double>(strips.size());
  const double scatter_m2 = squares / weight;
  const double reach_m = strips.back().s - strips.front().s + kStrip_m;
  const double independent = std::max(1.0, std::min(count, reach_m / kBuildingBendLength_m));
  fit.offset_sigma_m = std::sqrt(1 / weight + scatter_m2 / independent +
                                 kBuildingSharedSigma_m * kBuildingSharedSigma_m);
  fit.slope_sigma =
      std::sqrt(1 / (ss + prior) + 12 * scatter_m2 / (independent * reach_m * reach_m));
  fit.from_m = strips.front().s - 0.5 * kStrip_m;
  fit.to_m = strips.back().s + 0.5 * kStrip_m;
  return fit;
}

bool Refit(const std::vector<HeadedSample>& samples, double tolerance_cosine, double gate_m,
           const BuildingOptions& options, FaceFit* fit, std::vector<int>* used) {
  constexpr int kRounds = 4;
  constexpr size_t kLeastMembers = 4;
  for (int round = 0; round < kRounds; ++round) {
    *used = Members(samples, *fit, tolerance_cosine, gate_m);
    if (used->size() < kLeastMembers) return false;
    const std::vector<StripMean> means = StripMeans(samples, *used, *fit, options.merge_m);
    if (means.empty()) return false;
    *fit = FitStrips(means);
    fit->offset_sigma_m = std::hypot(fit->offset_sigma_m, CommonSigma(samples, *used));
    SetEnds(samples, *used, fit);
  }
  return fit->to_m > fit->from_m;
}

namespace {

constexpr double kOffsetBin_m = 0.005;
constexpr int kGapStrips = 4;        // over which a chain is followed
constexpr double kTurn = 0.05;       // of a wall against its heading, 3 degrees
constexpr size_t kLeastSamples = 2;  // of an offset
constexpr size_t kLeastStrips = 2;   // of a chain

struct Offset {
  StripMean mean;
  double weight = 0;
};

// The density of offsets in a strip, each blurred by its own uncertainty and by the distance within
// which faces are one: two layers of one wall become one mode up to twice that apart.
std::map<int, double> Density(const HeadedSample* begin, const HeadedSample* end, double merge_m) {
  std::map<int, double> density;
  for (const HeadedSample* sample = begin; sample != end; ++sample) {
    const double sigma_m = std::hypot(merge_m, std::min(sample->sigma_m, merge_m));
    const int reach = static_cast<int>(std::ceil(3 * sigma_m / kOffsetBin_m));
    const int middle = static_cast<int>(std::floor(sample->n / kOffsetBin_m));
    for (int bin = middle - reach; bin <= middle + reach; ++bin) {
      const double d = ((bin + 0.5) * kOffsetBin_m - sample->n) / sigma_m;
      density[bin] += std::exp(-0.5 * d * d) / sigma_m;
    }
  }
  return density;
}

double DensityAt(const std::map<int, double>& density, int bin) {
  const auto found = density.find(bin);
  return found == density.end() ? 0 : found->second;
}

// The samples around a mode of the density as one offset.
bool MeanAround(const HeadedSample* begin, const HeadedSample* end, double n, double merge_m,
                Offset* offset) {
  double weight = 0, n_sum = 0, s_sum = 0;
  size_t count = 0;
  for (const HeadedSample* sample = begin; sample != end; ++sample) {
    if (std::abs(sample->n - n) > std::max(1.5 * merge_m, sample->sigma_m)) continue;
    const double w = 1 / (sample->sigma_m * sample->sigma_m);
    weight += w;
    n_sum += w * sample->n;
    s_sum += w * sample->s;
    ++count;
  }
  if (count < kLeastSamples) return false;
  const double variance_m2 =
      std::max(1 / weight, merge_m * merge_m / (4.0 * static_cast<double>(count)));
  *offset = {{s_sum / weight, n_sum / weight, variance_m2}, static_cast<double>(count)};
  return true;
}

std::vector<Offset> FindOffsets(const HeadedSample* begin, const HeadedSample* end,
                                double merge_m) {
  const std::map<int, double> density = Density(begin, end, merge_m);
  std::vector<Offset> offsets;
  for (const auto& [bin, here] : density) {
    if (here < DensityAt(density, bin - 1) || here <= DensityAt(density, bin + 1)) continue;
    Offset offset;
    if (!MeanAround(begin, end, (bin + 0.5) * kOffsetBin_m, merge_m, &offset)) continue;
    offsets.push_back(offset);
  }
  return offsets;
}

struct Chain {
  std::vector<StripMean> strips;
  int last = 0;  // strip
  double weight = 0;
};

// The chain that an offset goes on, of those that none of its strip went on yet.
Chain* NearestChain(std::vector<Chain>* chains, const Offset& offset, int strip, double merge_m) {
  Chain* nearest = nullptr;
  double least = 0;
  for (Chain& chain : *chains) {
    const int steps = strip - chain.last;
    if (steps < 1 || steps > kGapStrips) continue;
    const StripMean& end = chain.strips.back();
    const double sigma_m = std::sqrt(end.variance_m2 + offset.mean.variance_m2);
    const double gate_m = std::max(2 * sigma_m, merge_m) + kTurn * (offset.mean.s - end.s);
    const double distance = std::abs(offset.mean.n - end.n) / gate_m;
    if (distance > 1 || (nearest != nullptr && distance >= least)) continue;
    nearest = &chain;
    least = distance;
  }
  return nearest;
}

// Strong offsets choose first.
void Extend(std::vector<Offset> offsets, int strip, double merge_m, std::vector<Chain>* open) {
  std::stable_sort(offsets.begin(), offsets.end(),
                   [](const Offset& a, const Offset& b) { return a.weight > b.weight; });
  std::vector<Chain> begun;
  for (const Offset& offset : offsets) {
    Chain* chain = NearestChain(open, offset, strip, merge_m);
    if (chain == nullptr) {
      begun.push_back({{offset.mean}, strip, offset.weight});
      continue;
    }
    chain->strips.push_back(offset.mean);
    chain->last = strip;
    chain->weight += offset.weight;
  }
  open->insert(open->end(), begun.begin(), begun.end());
}

}  // namespace

std::vector<std::vector<StripMean>> FollowOffsets(const std::vector<HeadedSample>& samples,
                                                  const BuildingOptions& options) {
  std::vector<Chain> open, done;
  for (size_t first = 0; first < samples.size();) {
    const int strip = static_cast<int>(std::floor(samples[first].s / kStrip_m));
    size_t end = first;
    while (end < samples.size() && samples[end].s < (strip + 1) * kStrip_m) ++end;
    end = std::max(end, first + 1);
    Extend(FindOffsets(&samples[first], samples.data() + end, options.merge_m), strip,
           options.merge_m, &open);
    for (const Chain& chain : open) {
      if (strip - chain.last >= kGapStrips) done.push_back(chain);
    }
    std::erase_if(open, [&](const Chain& chain) { return strip - chain.last >= kGapStrips; });
    first = end;
  }
  done.insert(done.end(), open.begin(), open.end());
  std::stable_sort(done.begin(), done.end(),
                   [](const Chain& a, const Chain& b) { return a.weight > b.weight; });
  std::vector<std::vector<StripMean>> chains;
  for (Chain& chain : done) {
    if (chain.strips.size() >= kLeastStrips) chains.push_back(std::move(chain.strips));
  }
  return chains;
}

}  // namespace slcmap::mapping
