#include "mapping/building/faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "data/core/math.h"
#include "data/core/parallel.h"
#include "mapping/building/face_fit.h"
#include "mapping/building/face_surface.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

// Faces.
constexpr double kNormalTolerance_deg = 15;  // between a point's normal and that of its face
constexpr double kMinFace_m2 = 0.15;         // of surface measured on it
constexpr double kJoinGap_m = 3;             // pieces of one plane so far apart are one face
constexpr double kJoinTurn = 0.035;          // between them, at most

constexpr int kMaxHeadings = 24;
constexpr int kHeadingBins = 180;         // of half a turn: a degree each
constexpr int kHeadingBlur = 3;           // bins
constexpr double kMostSlope = 0.0875;     // of a face against the heading it is found by, 5 degrees
constexpr double kLeastHeight_m = 0.4;    // of a face
constexpr double kLeastLength_m = 0.25;   // of a face
constexpr double kProbe_m = 0.15;         // before a face, whether it is free there
constexpr double kNearFace_m = 0.03;      // samples so far from a face are on it,
constexpr double kTails = 2.5;            // and those that are off by so many sigma
constexpr double kBehindProud_m = 0.045;  // from where things before a wall put it to itself
constexpr double kLayer_m = 0.05;  // so far before and behind a face, others are what it left

Vector2d Direction(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

// The heading that most samples vote for, in half a turn, except where all faces are found.
std::optional<double> StrongestHeading(const std::vector<FaceSample>& samples,
                                       const std::vector<bool>& explained,
                                       const std::vector<bool>& exhausted, double least) {
  std::vector<double> votes(kHeadingBins, 0), blurred(kHeadingBins, 0);
  for (size_t i = 0; i < samples.size(); ++i) {
    const FaceSample& sample = samples[i];
    Vector2d normal = sample.normal;
    if (normal.isZero()) normal = {-sample.direction.y(), sample.direction.x()};
    if (explained[i] || normal.isZero()) continue;
    const double angle = std::atan2(normal.y(), normal.x());
    const int bin = static_cast<int>(std::floor(angle / kDegree + 360)) % kHeadingBins;
    votes[bin] += 1;
  }
  for (int bin = 0; bin < kHeadingBins; ++bin) {
    for (int k = -kHeadingBlur; k <= kHeadingBlur; ++k) {
      blurred[bin] += votes[(bin + k + kHeadingBins) % kHeadingBins];
    }
    if (exhausted[bin]) blurred[bin] = 0;
  }
  const auto best = std::max_element(blurred.begin(), blurred.end());
  if (*best < least) return std::nullopt;
  return (static_cast<double>(best - blurred.begin()) + 0.5) * kDegree;
}

// Of a sample from the face that it is on.
double EvaluateSigma(const FaceSample& sample) {
  constexpr double kProud_m = 0.01;  // frames and skirtings, which have most lines, before a wall
  return sample.normal.isZero() ? std::hypot(sample.sigma_m, kProud_m) : sample.sigma_m;
}

struct FoundFace {
  Face face;
  FaceFit fit;            // along the heading that it was found by
  std::vector<int> used;  // samples
};

// Finds the faces that look along a heading, within the tolerance.
class HeadingSearch {
 public:
  HeadingSearch(const std::vector<FaceSample>& samples, const std::vector<bool>& explained,
                const IsFreeAt& is_free, const BuildingOptions& options, double heading_rad)
      : heading_(Direction(heading_rad)),
        along_(-heading_.y(), heading_.x()),
        tolerance_cosine_(std::cos(kNormalTolerance_deg * kDegree)),
        options_(options) {
    for (size_t i = 0; i < samples.size(); ++i) {
      if (!explained[i]) Add(samples[i], static_cast<int>(i), is_free);
    }
    std::stable_sort(headed_.begin(), headed_.end(),
                     [](const auto& a, const auto& b) { return a.s < b.s; });
  }

  std::vector<FoundFace> Find() {
    std::vector<FoundFace> faces;
    std::vector<HeadedSample> left = headed_;
    // Strong chains take their samples from the weaker ones, which are followed anew.
    for (const std::vector<StripMean>& chain : FollowOffsets(left, options_)) {
      FaceFit fit = FitStrips(chain);
      std::vector<int> members;
      if (!Refit(left, tolerance_cosine_, Gate(), options_, &fit, &members)) continue;
      std::optional<FoundFace> found = MakeFace(left, fit, members);
      if (!found) continue;
      Take(fit, &left);
      faces.push_back(*std::move(found));
    }
    Join(&faces);
    return faces;
  }

 private:
  double Gate() const { return 1.5 * options_.merge_m; }

  void Add(const FaceSample& sample, int index, const IsFreeAt& is_free) {
    const Vector2d p = sample.p_world.head<2>();
    HeadedSample headed{heading_.dot(p),
                        along_.dot(p),
                        sample.p_world.z(),
                        EvaluateSigma(sample),
                        !sample.normal.isZero(),
                        {heading_.dot(sample.normal), along_.dot(sample.normal)},
                        index};
    if (headed.has_normal) {
      if (headed.normal.x() < tolerance_cosine_) return;
    } else {
      // A line lies on faces along it, on the side from which it is seen.
      if (std::abs(heading_.dot(sample.direction)) > kLineTurn_rad) return;
      if (!is_free(p + kProbe_m * heading_) || is_free(p - kProbe_m * heading_)) return;
    }
    headed_.push_back(headed);
  }

  std::optional<FoundFace> MakeFace(const std::vector<HeadedSample>& samples, const FaceFit& fit,
                                    const std::vector<int>& members) const {
    FoundFace found{{}, fit, {}};
    std::set<std::pair<int, int>> cells;
    std::vector<double> heights;
    for (const int member : members) {
      cells.insert(FindAreaCell(samples[member].s, samples[member].z));
      heights.push_back(samples[member].z);
      found.used.push_back(samples[member].index);
    }
    std::sort(heights.begin(), heights.end());
    const size_t stray = heights.size() / 200;
    found.face.low_m = heights[stray];
    found.face.high_m = heights[heights.size() - 1 - stray];
    found.face.mostly_above_m = heights[heights.size() / 10];
    found.face.area_m2 = CellArea(cells);
    SetPlane(&found);
    const bool is_face = std::abs(fit.slope) <= kMostSlope && found.face.area_m2 >= kMinFace_m2 &&
                         found.face.high_m - found.face.low_m >= kLeastHeight_m &&
                         found.face.Length() >= kLeastLength_m;
    return is_face ? std::optional(found) : std::nullopt;
  }

  // The line of the fit as a plane of its own.
  void SetPlane(FoundFace* found) const {
    const FaceFit& fit = found->fit;
    Face& face = found->face;
    face.normal = (heading_ - fit.slope * along_).normalized();
    const Vector2d middle = fit.offset_m * heading_ + fit.middle_m * along_;
    face.offset_m = face.normal.dot(middle);
    face.sigma_m = fit.offset_sigma_m;
    face.heading_sigma_rad = fit.slope_sigma;
    face.from_m = face.MeasureAlong(fit.At(fit.from_m) * heading_ + fit.from_m * along_);
    face.to_m = face.MeasureAlong(fit.At(fit.to_m) * heading_ + fit.to_m * along_);
  }

  // Takes away what lies on a face, and the tails of it.
  void Take(const FaceFit& fit, std::vector<HeadedSample>* left) const {
    std::erase_if(*left, [&](const HeadedSample& sample) {
      return sample.s >= fit.from_m && sample.s <= fit.to_m &&
             std::abs(sample.n - fit.At(sample.s)) <= std::max(Gate(), kTails * sample.sigma_m);
    });
  }

  // Whether two pieces along one line are one face: neither leaves the line of the other by more
  // than it may.
  bool AreOne(const FoundFace& a, const FoundFace& b) const {
    const FaceFit& first = a.fit.from_m < b.fit.from_m ? a.fit : b.fit;
    const FaceFit& second = &first == &a.fit ? b.fit : a.fit;
    const double gap_m = second.from_m - first.to_m;
    if (gap_m > kJoinGap_m) return false;
    const double s = 0.5 * (first.to_m + second.from_m);
    const double sigma_m = std::hypot(first.SigmaAt(s), second.SigmaAt(s));
    const double step_m = std::abs(first.At(s) - second.At(s));
    const double turn = std::abs(first.slope - second.slope);
    const double turn_sigma = std::hypot(first.slope_sigma, second.slope_sigma);
    constexpr double kMostStep_m = 0.04;
    return step_m <= std::min(std::max(2 * sigma_m, options_.merge_m), kMostStep_m) &&
           turn <= std::min(std::max(2 * turn_sigma, 0.005), kJoinTurn);
  }

  void Join(std::vector<FoundFace>* faces) const {
    for (bool changed = true; changed;) {
      changed = false;
      for (size_t i = 0; i < faces->size() && !changed; ++i) {
        for (size_t j = i + 1; j < faces->size() && !changed; ++j) {
          changed = AreOne((*faces)[i], (*faces)[j]) && JoinPair(i, j, faces);
        }
      }
    }
  }

  // Fits one face to the samples of both; not if they do not come to lie on it.
  bool JoinPair(size_t i, size_t j, std::vector<FoundFace>* faces) const {
    FoundFace &a = (*faces)[i], &b = (*faces)[j];
    std::set<int> both(a.used.begin(), a.used.end());
    both.insert(b.used.begin(), b.used.end());
    std::vector<HeadedSample> samples;
    for (const HeadedSample& sample : headed_) {
      if (both.count(sample.index) > 0) samples.push_back(sample);
    }
    FaceFit fit = a.face.Length() >= b.face.Length() ? a.fit : b.fit;
    fit.from_m = std::min(a.fit.from_m, b.fit.from_m);
    fit.to_m = std::max(a.fit.to_m, b.fit.to_m);
    std::vector<int> members;
    constexpr double kWider = 1.5, kLeastKept = 0.85;
    if (!Refit(samples, tolerance_cosine_, kWider * Gate(), options_, &fit, &members)) return false;
    if (static_cast<double>(members.size()) < kLeastKept * static_cast<double>(samples.size())) {
      return false;
    }
    std::optional<FoundFace> joined = MakeFace(samples, fit, members);
    if (!joined) return false;
    a = *std::move(joined);
    faces->erase(faces->begin() + static_cast<int64_t>(j));
    return true;
  }

  const Vector2d heading_, along_;
  const double tolerance_cosine_;
  const BuildingOptions& options_;
  std::vector<HeadedSample> headed_;
};

// Marks the samples on a face, and those just before and behind it: they are no faces.
void Explain(const std::vector<FaceSample>& samples, const Face& face,
             std::vector<bool>* explained) {
  for (size_t i = 0; i < samples.size(); ++i) {
    const FaceSample& sample = samples[i];
    const Vector2d p = sample.p_world.head<2>();
    const double along_m = face.MeasureAlong(p);
    if (along_m < face.from_m || along_m > face.to_m) continue;
    if (std::abs(face.DistanceTo(p)) > std::max(kNearFace_m, kTails * EvaluateSigma(sample)))
      continue;
    const bool is_like = sample.normal.isZero()
                             ? std::abs(sample.direction.dot(face.normal)) < kLineTurn_rad
                             : sample.normal.dot(face.normal) > 0.9;
    if (is_like) (*explained)[i] = true;
  }
}

// A face that stands a little before or behind a stronger one, within its extent, is what it left.
bool IsLayerBefore(const Face& face, const Face& stronger, double merge_m) {
  if (face.normal.dot(stronger.normal) < 0.98) return false;
  const double middle_m = 0.5 * (face.from_m + face.to_m);
  const Vector2d middle = face.PointAt(middle_m);
  const double along_m = stronger.MeasureAlong(middle);
  if (along_m < stronger.from_m || along_m > stronger.to_m) return false;
  return std::abs(stronger.DistanceTo(middle)) <=
         std::clamp(2 * std::hypot(face.sigma_m, stronger.sigma_m), 2 * merge_m, kLayer_m);
}

double SigmaAt(const Face& face, double along_m) {
  return std::hypot(face.sigma_m,
                    face.heading_sigma_rad * (along_m - 0.5 * (face.from_m + face.to_m)));
}

// Whether a face goes on along the line of another, which was found by another heading.
bool GoesOn(const Face& face, const Face& stronger, const BuildingOptions& options) {
  if (stronger.normal.dot(face.normal) < std::cos(kJoinTurn)) return false;
  const double a = stronger.MeasureAlong(face.PointAt(face.from_m));
  const double b = stronger.MeasureAlong(face.PointAt(face.to_m));
  const double gap_m = std::max(a - stronger.to_m, stronger.from_m - b);
  if (gap_m > kJoinGap_m) return false;
  const double middle_m = 0.5 * (face.from_m + face.to_m);
  const double sigma_m =
      std::hypot(face.sigma_m, SigmaAt(stronger, stronger.MeasureAlong(face.PointAt(middle_m))));
  return std::abs(stronger.DistanceTo(face.PointAt(middle_m))) <=
         std::min(std::max(2 * sigma_m, options.merge_m), 2 * options.merge_m);
}

// Where samples of level lines along a face lie within so much of its plane: metres along it.
std::vector<double> FindLinePlaces(const std::vector<FaceSample>& samples, const Face& face,
                                   double within_m) {
  std::vector<double> places_m;
  for (const FaceSample& sample : samples) {
    if (sample.direction.isZero() || std::abs(sample.direction.dot(face.normal)) > kLineTurn_rad) {
      continue;
    }
    const Vector2d p = sample.p_world.head<2>();
    if (std::abs(face.DistanceTo(p)) <= within_m) places_m.push_back(face.MeasureAlong(p));
  }
  return places_m;
}

// A face goes on as far as lines on it do: where a wall is blank, its edges to floor and ceiling
// are all that is seen of it, and lone lines are no faces. Not so far that its heading tells
// nothing of where it would be.
void ExtendAlongLines(const std::vector<FaceSample>& samples, Face* face) {
  constexpr double kOnFace_m = 0.015, kAstray_m = 0.03;
  const double reach_m = kAstray_m / std::max(face->heading_sigma_rad, 1e-4);
  const double middle_m = 0.5 * (face->from_m + face->to_m);
  std::vector<double> places_m = FindLinePlaces(samples, *face, kOnFace_m);
  std::erase_if(places_m, [&](double at_m) { return std::abs(at_m - middle_m) > reach_m; });
  std::sort(places_m.begin(), places_m.end());
  for (const double along_m : places_m) {
    if (along_m > face->to_m && along_m - face->to_m <= kJoinGap_m) face->to_m = along_m;
  }
  for (auto at = places_m.rbegin(); at != places_m.rend(); ++at) {
    if (*at < face->from_m && face->from_m - *at <= kJoinGap_m) face->from_m = *at;
  }
}

// A turn in -pi/4 .. pi/4 that two headings of square worlds differ by.
double SquareTurn(double angle_rad) {
  return angle_rad - 0.5 * M_PI * std::round(angle_rad / (0.5 * M_PI));
}

double ComputeAngle(const Face& face) { return std::atan2(face.normal.y(), face.normal.x()); }

// Metres of a face along which level lines lie on it.
double MeasureLines(const std::vector<FaceSample>& samples, const Face& face) {
  std::set<int> steps;
  for (const double at_m : FindLinePlaces(samples, face, kNearFace_m)) {
    if (at_m < face.from_m || at_m > face.to_m) continue;
    steps.insert(static_cast<int>((at_m - face.from_m) / kBuildingLineSample_m));
  }
  return static_cast<double>(steps.size()) * kBuildingLineSample_m;
}

// Smooth depth rounds off what is blank, at any heading. A straight surface is large, or as large
// ones are headed, or has edges along it. Sorted by area; the first is kept in any case.
std::vector<Face> SelectStraight(const std::vector<FaceSample>& samples,
                                 const std::vector<Face>& faces) {
  constexpr double kLarge_m2 = 2, kSquare_rad = 3 * kDegree, kLeastLines = 0.1;  // of its length
  std::vector<double> headings_rad;                                              // of large ones
  std::vector<Face> straight;
  for (const Face& face : faces) {
    const double heading_rad = ComputeAngle(face);
    if (straight.empty() || face.area_m2 >= kLarge_m2) headings_rad.push_back(heading_rad);
    const bool is_headed = std::ranges::any_of(headings_rad, [&](double large_rad) {
      return std::abs(SquareTurn(large_rad - heading_rad)) <= kSquare_rad;
    });
    if (is_headed || MeasureLines(samples, face) >= kLeastLines * face.Length()) {
      straight.push_back(face);
    }
  }
  return straight;
}

// Strong faces take in the weaker ones that go on along them. Sorted by area.
std::vector<Face> Continued(const std::vector<Face>& faces, const BuildingOptions& options) {
  std::vector<Face> kept;
  for (const Face& face : faces) {
    const auto stronger = std::find_if(
        kept.begin(), kept.end(), [&](const Face& other) { return GoesOn(face, other, options); });
    if (stronger == kept.end()) {
      kept.push_back(face);
      continue;
    }
    const double a = stronger->MeasureAlong(face.PointAt(face.from_m));
    const double b = stronger->MeasureAlong(face.PointAt(face.to_m));
    stronger->from_m = std::min(stronger->from_m, a);
    stronger->to_m = std::max(stronger->to_m, b);
    stronger->low_m = std::min(stronger->low_m, face.low_m);
    stronger->mostly_above_m = std::min(stronger->mostly_above_m, face.mostly_above_m);
    stronger->high_m = std::max(stronger->high_m, face.high_m);
    stronger->area_m2 += face.area_m2;
  }
  return kept;
}

}  // namespace

std::vector<Face> FindFaces(const std::vector<FaceSample>& samples, const IsFreeAt& is_free,
                            const BuildingOptions& options) {
  constexpr double kLeastVotes = 20;
  std::vector<Face> faces;
  std::vector<bool> explained(samples.size(), false), exhausted(kHeadingBins, false);
  for (int round = 0; round < kMaxHeadings; ++round) {
    const auto heading = StrongestHeading(samples, explained, exhausted, kLeastVotes);
    if (!heading) break;
    for (const double turn : {0.0, M_PI, 0.5 * M_PI, 1.5 * M_PI}) {
      HeadingSearch search(samples, explained, is_free, options, *heading + turn);
      for (const FoundFace& found : search.Find()) {
        const bool is_layer = std::any_of(faces.begin(), faces.end(), [&](const Face& face) {
          return IsLayerBefore(found.face, face, options.merge_m);
        });
        if (!is_layer) faces.push_back(found.face);
        Explain(samples, found.face, &explained);
      }
    }
    const int bin = static_cast<int>(*heading / kDegree);
    for (const int turn : {0, kHeadingBins / 2}) {
      for (int k = -1; k <= 1; ++k)
        exhausted[(bin + turn + k + kHeadingBins) % kHeadingBins] = true;
    }
  }
  std::stable_sort(faces.begin(), faces.end(),
                   [](const Face& a, const Face& b) { return a.area_m2 > b.area_m2; });
  ForEachWatched(faces.size(), {}, [&](size_t i) {
    Face& face = faces[i];
    face.sigma_m = std::hypot(face.sigma_m, MoveOntoSurface(samples, kBehindProud_m, &face));
    ExtendAlongLines(samples, &face);
  });
  return Continued(SelectStraight(samples, faces), options);
}

void AgreeHeadings(std::vector<Face>* faces) {
  constexpr double kParallel_rad = 0.2 * kDegree;  // as far as builders keep walls parallel
  std::vector<double> turns_rad;
  for (const Face& face : *faces) {
    double weight = 0, sum = 0;
    for (const Face& other : *faces) {
      if (&other == &face) continue;
      const double turn = SquareTurn(ComputeAngle(other) - ComputeAngle(face));
      const double sigma = std::hypot(kParallel_rad, other.heading_sigma_rad);
      if (std::abs(turn) > 3 * std::hypot(sigma, face.heading_sigma_rad)) continue;
      weight += 1 / (sigma * sigma);
      sum += turn / (sigma * sigma);
    }
    // The others together are no better than walls are parallel.
    const double others = std::min(weight, 1 / (kParallel_rad * kParallel_rad));
    const double own = 1 / std::max(face.heading_sigma_rad * face.heading_sigma_rad, 1e-10);
    turns_rad.push_back(weight > 0 ? others * (sum / weight) / (others + own) : 0);
  }
  for (size_t i = 0; i < faces->size(); ++i) {
    Face& face = (*faces)[i];
    face.MoveTo(face.Middle(), Direction(ComputeAngle(face) + turns_rad[i]));
  }
}

double MainHeading(const std::vector<Face>& faces) {
  // Four times an angle goes on smoothly where square worlds look alike.
  constexpr int kBins = 90;
  std::array<double, kBins> lengths{};
  std::array<Vector2d, kBins> sums;
  sums.fill(Vector2d::Zero());
  for (const Face& face : faces) {
    const double angle = ComputeAngle(face);
    const int bin = static_cast<int>(std::floor(angle / kDegree + 360)) % kBins;
    for (int k = -2; k <= 2; ++k) {
      lengths[(bin + k + kBins) % kBins] += face.Length();
      sums[(bin + k + kBins) % kBins] += face.Length() * Direction(4 * angle);
    }
  }
  const auto best = std::max_element(lengths.begin(), lengths.end());
  const Vector2d& sum = sums[best - lengths.begin()];
  if (sum.isZero()) return 0;
  const double angle = std::atan2(sum.y(), sum.x()) / 4;
  return angle < 0 ? angle + 0.5 * M_PI : angle;
}

}  // namespace slcmap::mapping
