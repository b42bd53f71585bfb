#include "mapping/building/strip_modes.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace slcmap {
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
  const double variance_m2 = std::max(1 / weight, merge_m * merge_m / (4.0 * count));
  *offset = {{s_sum / weight, n_sum / weight, variance_m2}, static_cast<double>(count)};
  return true;
}

std::vector<Offset> OffsetsOf(const HeadedSample* begin, const HeadedSample* end, double merge_m) {
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
    Extend(OffsetsOf(&samples[first], samples.data() + end, options.merge_m), strip,
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

}  // namespace slcmap
