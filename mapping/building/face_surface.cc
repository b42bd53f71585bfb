#include "mapping/building/face_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

constexpr double kMaxProud_m = 0.04;  // how far what is fixed to a wall stands before it

constexpr double kBin_m = 0.001;            // of distances from the face
constexpr double kSamplesWithin_m = 0.06;   // samples so far from the face are looked at
constexpr int kOffsetBins = 120;            // up to there on both sides
constexpr double kBackward_m = 0.046;       // the first offset that is tried is so far behind,
constexpr int kOffsets = 39;                // the last of these 3 cm before the face,
constexpr int kBinsAnOffset = 2;            // in steps of so many bins
constexpr double kPointCosine = 0.7;        // of a point's normal to that of the face
constexpr double kCell_m = 0.3;             // points within it err alike
constexpr double kCellPoints = 0.5;         // and count as so many together
constexpr double kBesideLine_m = 0.15;      // points so near to a line may have been seen by it
constexpr double kLinesWeightEach_m = 2.5;  // lines count as so many samples each metre
constexpr double kLeastSigma_m = 0.004;
constexpr double kAlone_m = 0.015;   // how far a small face may be off whatever its samples say,
constexpr double kAloneArea_m2 = 2;  // by half in variance where so much of it was measured
constexpr double kBent_m = 0.008;    // by which what was measured of a face may be bent
constexpr double kFirstTrim_m = 0.012, kTrimStep_m = 0.002;  // how far trims stand out
constexpr double kTrimSigmas = 3;    // nearer to the surface they look as it does
constexpr double kTrimPrior = 0.1;   // that any stand before the wall
constexpr double kTrimEvidence = 1;  // of points, as the logarithm of a likelihood ratio

using Offsets = std::array<double, kOffsets>;

double OffsetAt(int i) { return i * kBinsAnOffset * kBin_m - kBackward_m; }

// How samples are shared out between the surface, what stands before it, and stray ones. Where a
// wall has trims, as frames and skirtings of one thickness, they are a share of what stands before
// it: lines that are all in one plane are as likely trims as the wall.
struct Shares {
  double on = 0, before = 0, trims_of_before = 0;
};
constexpr Shares kPointShares{0.65, 0.25, 0.6}, kLineShares{0.3, 0.6, 0.4};

double NormalCdf(double x) { return 0.5 * std::erfc(-M_SQRT1_2 * x); }

// Densities of a sample at a distance from the surface.
struct Densities {
  double on = 0, all = 0;
};

double NormalDensity(double x, double sigma_m) {
  const double z = x / sigma_m;
  return std::exp(-0.5 * z * z) / (sigma_m * std::sqrt(2 * M_PI));
}

// Of trims, where a wall has any, how far all of them stand before it.
using TrimDepth = std::optional<double>;

Densities DensitiesAt(double distance_m, double sigma_m, const Shares& shares, TrimDepth trim_m) {
  const double on = shares.on * NormalDensity(distance_m, sigma_m);
  double before =
      (NormalCdf(distance_m / sigma_m) - NormalCdf((distance_m - kMaxProud_m) / sigma_m)) /
      kMaxProud_m;
  if (trim_m && *trim_m >= kTrimSigmas * sigma_m) {
    const double trims = NormalDensity(distance_m - *trim_m, sigma_m);
    before += shares.trims_of_before * (trims - before);
  }
  const double stray = (1 - shares.on - shares.before) / (2 * kSamplesWithin_m);
  return {on, on + shares.before * before + stray};
}

struct Place {
  double along_m = 0, distance_m = 0, sigma_m = 0;
  double weight = 1;
};

// What is known of the surface of a face, from points or from lines.
struct Evidence {
  Shares shares;
  std::vector<Place> places;
};

using FaceCell = std::pair<int, int>;  // of a face, along it and up

// How many places are at which distance from a face, in bins, by how uncertain they are, in steps
// of sqrt(2): each density is evaluated once.
class Histogram {
 public:
  explicit Histogram(const Evidence& evidence) : shares_(evidence.shares) {
    for (const Place& place : evidence.places) {
      const double level = std::round(2 * std::log2(place.sigma_m / kLeastSigma_m));
      const double bin = std::floor((place.distance_m + kSamplesWithin_m) / kBin_m);
      weights_[std::clamp(static_cast<int>(level), 0, kLevels - 1)]
              [std::clamp(static_cast<int>(bin), 0, kOffsetBins - 1)] += place.weight;
    }
  }

  // The logarithm of the likelihood of each offset that is tried.
  Offsets LogLikelihoods(TrimDepth trim_m) const {
    Offsets logs{};
    for (int level = 0; level < kLevels; ++level) {
      if (weights_[level] == Weights{}) continue;
      const std::array<double, kShifts> densities = LogDensities(level, trim_m);
      for (int bin = 0; bin < kOffsetBins; ++bin) {
        const double weight = weights_[level][bin];
        if (weight == 0) continue;
        for (int i = 0; i < kOffsets; ++i) {
          logs[i] += weight * densities[bin + (kOffsets - 1 - i) * kBinsAnOffset];
        }
      }
    }
    return logs;
  }

 private:
  static constexpr int kLevels = 10, kShifts = kOffsetBins + (kOffsets - 1) * kBinsAnOffset;
  using Weights = std::array<double, kOffsetBins>;

  // Of bins, from the surface that is farthest in front.
  std::array<double, kShifts> LogDensities(int level, TrimDepth trim_m) const {
    const double sigma_m = kLeastSigma_m * std::exp2(0.5 * level);
    std::array<double, kShifts> densities;
    for (int i = 0; i < kShifts; ++i) {
      const double distance_m = (i + 0.5) * kBin_m - kSamplesWithin_m - OffsetAt(kOffsets - 1);
      densities[i] = std::log(DensitiesAt(distance_m, sigma_m, shares_, trim_m).all);
    }
    return densities;
  }

  const Shares shares_;
  std::array<Weights, kLevels> weights_{};
};

// What stands before a wall, and how likely each offset then is: all in all, and by its points.
struct Hypothesis {
  TrimDepth trim_m;
  Offsets logs, of_points;

  size_t Best() const { return std::max_element(logs.begin(), logs.end()) - logs.begin(); }
};

bool LiesAlong(const FaceSample& sample, const Face& face) {
  return sample.normal.isZero() ? std::abs(sample.direction.dot(face.normal)) <= kLineTurn_rad
                                : sample.normal.dot(face.normal) >= kPointCosine;
}

class Surface {
 public:
  Surface(const std::vector<FaceSample>& samples, double most_m, const Face& face)
      : most_m_(most_m),
        middle_m_(0.5 * (face.from_m + face.to_m)),
        length_m_(face.Length()),
        heading_sigma_rad_(face.heading_sigma_rad) {
    std::vector<const FaceSample*> points;
    PointIndex line_places(kBesideLine_m);  // on the face
    for (const FaceSample& sample : samples) {
      const Place place = FindPlace(sample, face);
      if (std::abs(place.distance_m) >= kSamplesWithin_m || place.along_m < face.from_m ||
          place.along_m > face.to_m || !LiesAlong(sample, face)) {
        continue;
      }
      if (!sample.normal.isZero()) {
        points.push_back(&sample);
        continue;
      }
      lines_.places.push_back(place);
      lines_.places.back().weight = kLinesWeightEach_m * kBuildingLineSample_m;
      line_places.Add(OnFace(sample, face), 0);
    }
    AddPoints(points, line_places, face);
  }

  bool is_known() const {
    return !points_.places.empty() || !beside_.places.empty() || !lines_.places.empty();
  }
  double offset_m() const { return offset_m_; }
  double slope() const { return slope_; }

  double SigmaAdded() const {
    return std::sqrt(variance_m2_ + kAlone_m * kAlone_m / (1 + area_m2_ / kAloneArea_m2));
  }
  double HeadingSigma() const { return std::sqrt(slope_variance_); }

  // The posterior of the offset. Lines in one plane before others are trims or a wall before
  // something else: trims are believed in where points show the wall behind them, too.
  void FindOffset() {
    const Histogram points(points_), beside(beside_), lines(lines_);
    const auto assume = [&](TrimDepth trim_m) { return Assume(trim_m, points, beside, lines); };
    std::vector<Hypothesis> hypotheses = {assume(std::nullopt)};
    const double points_without = hypotheses[0].of_points[hypotheses[0].Best()];
    const int trims =
        1 + static_cast<int>(std::floor((kMaxProud_m - kFirstTrim_m) / kTrimStep_m + 1e-6));
    for (int i = 0; i < trims; ++i) {
      Hypothesis with = assume(kFirstTrim_m + i * kTrimStep_m);
      if (with.of_points[with.Best()] < points_without + kTrimEvidence) continue;
      for (double& log : with.logs) log += std::log(kTrimPrior / ((1 - kTrimPrior) * trims));
      hypotheses.push_back(with);
    }
    TakeLikeliest(hypotheses);
  }

  // Turns towards what is on the surface, as far as the heading is uncertain.
  void FindSlope() {
    double weight = 0, s_sum = 0, n_sum = 0, ss = 0, sn = 0;
    for (const Evidence* evidence : {&points_, &beside_, &lines_}) {
      for (const Place& place : evidence->places) {
        const Densities densities =
            DensitiesAt(place.distance_m, place.sigma_m, evidence->shares, trim_m_);
        const double w =
            place.weight * densities.on / densities.all / (place.sigma_m * place.sigma_m);
        const double s = place.along_m - middle_m_;
        weight += w;
        s_sum += w * s;
        n_sum += w * place.distance_m;
        ss += w * s * s;
        sn += w * s * place.distance_m;
      }
    }
    const double prior = 1 / (heading_sigma_rad_ * heading_sigma_rad_ + 1e-12);
    const double information = std::max(0.0, ss - s_sum * s_sum / weight) + prior;
    const double turned = (sn - s_sum * n_sum / weight) / information;
    const double bent = std::sqrt(12.0) * kBent_m / std::max(length_m_, kBent_m);
    slope_variance_ = 1 / information + bent * bent;
    if (std::isfinite(turned)) Shift(0, turned);
  }

 private:
  static Place FindPlace(const FaceSample& sample, const Face& face) {
    const Vector2d p = sample.p_world.head<2>();
    return {face.MeasureAlong(p), face.DistanceTo(p), std::max(sample.sigma_m, kLeastSigma_m)};
  }

  // Along it and up.
  static Eigen::Vector3d OnFace(const FaceSample& sample, const Face& face) {
    return {face.MeasureAlong(sample.p_world.head<2>()), sample.p_world.z(), 0};
  }

  static FaceCell FindCell(const FaceSample& sample, const Face& face) {
    const Eigen::Vector3i cube = FindCube(OnFace(sample, face), kCell_m);
    return {cube.x(), cube.y()};
  }

  // Beside a line stereo has the depth of that, where the surface has less texture.
  void AddPoints(const std::vector<const FaceSample*>& points, const PointIndex& line_places,
                 const Face& face) {
    std::vector<const FaceSample*> clear, beside;
    for (const FaceSample* point : points) {
      const bool is_beside = line_places.HasNear(OnFace(*point, face), kBesideLine_m);
      (is_beside ? beside : clear).push_back(point);
    }
    AddByArea(beside, face, &beside_);
    area_m2_ = AddByArea(clear, face, &points_);
  }

  // Returns the area that the points are on.
  static double AddByArea(const std::vector<const FaceSample*>& points, const Face& face,
                          Evidence* evidence) {
    std::map<FaceCell, int> counts;
    for (const FaceSample* point : points) ++counts[FindCell(*point, face)];
    for (const FaceSample* point : points) {
      Place& place = evidence->places.emplace_back(FindPlace(*point, face));
      place.weight = kCellPoints / counts.at(FindCell(*point, face));
    }
    return static_cast<double>(counts.size()) * kCell_m * kCell_m;
  }

  Hypothesis Assume(TrimDepth trim_m, const Histogram& points, const Histogram& beside,
                    const Histogram& lines) const {
    Hypothesis made{trim_m, lines.LogLikelihoods(trim_m), points.LogLikelihoods(trim_m)};
    const Offsets of_beside = beside.LogLikelihoods(trim_m);
    for (int i = 0; i < kOffsets; ++i) {
      const bool is_far = std::abs(offset_m_ + OffsetAt(i)) > most_m_ + kBin_m;
      made.logs[i] = is_far ? -std::numeric_limits<double>::infinity()
                            : made.logs[i] + of_beside[i] + made.of_points[i];
    }
    return made;
  }

  // The mean offset by the likeliest hypothesis, with what the others are off it.
  void TakeLikeliest(const std::vector<Hypothesis>& hypotheses) {
    double most = -std::numeric_limits<double>::infinity();
    for (const Hypothesis& one : hypotheses) most = std::max(most, one.logs[one.Best()]);
    double likeliest = 0, moved_m = 0, all = 0, sum = 0, squares = 0;
    for (const Hypothesis& one : hypotheses) {
      double weight = 0, of_one = 0;
      for (int i = 0; i < kOffsets; ++i) {
        const double w = std::exp(one.logs[i] - most);
        weight += w;
        of_one += w * OffsetAt(i);
        squares += w * OffsetAt(i) * OffsetAt(i);
      }
      all += weight;
      sum += of_one;
      if (weight <= likeliest) continue;
      likeliest = weight;
      moved_m = of_one / weight;
      trim_m_ = one.trim_m;
    }
    variance_m2_ = std::max(0.0, squares / all - 2 * moved_m * sum / all + moved_m * moved_m);
    Shift(moved_m, 0);
  }

  void Shift(double moved_m, double turned) {
    offset_m_ += moved_m;
    slope_ += turned;
    for (Evidence* evidence : {&points_, &beside_, &lines_}) {
      for (Place& place : evidence->places) {
        place.distance_m -= moved_m + turned * (place.along_m - middle_m_);
      }
    }
  }

  const double most_m_, middle_m_, length_m_, heading_sigma_rad_;
  Evidence points_{kPointShares, {}}, beside_{kLineShares, {}}, lines_{kLineShares, {}};
  TrimDepth trim_m_;    // as it is likeliest
  double area_m2_ = 0;  // with points that are beside no line
  double offset_m_ = 0, slope_ = 0, variance_m2_ = 0, slope_variance_ = 0;
};

}  // namespace

double MoveOntoSurface(const std::vector<FaceSample>& samples, double most_m, Face* face) {
  constexpr int kTurns = 2;
  Surface surface(samples, most_m, *face);
  if (!surface.is_known()) return 0;
  surface.FindOffset();
  for (int round = 0; round < kTurns; ++round) {
    surface.FindSlope();
    surface.FindOffset();
  }
  // n = offset + slope s in the face's own frame.
  const Vector2d middle = face->Middle() + surface.offset_m() * face->normal;
  face->MoveTo(middle, (face->normal - surface.slope() * face->Along()).normalized());
  face->heading_sigma_rad = surface.HeadingSigma();
  return surface.SigmaAdded();
}

}  // namespace slcmap::mapping
