#include "apps/evaluation/wall_survey.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "apps/evaluation/report.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSurveyMinPoints = 5;       // that a place is made of
constexpr double kPointSigma_m = 0.005;   // no point counts as if it were known better
constexpr double kSurveyMinLength_m = 1;  // of a wall
constexpr double kMaxParallel_deg = 3;    // between opposite faces

constexpr int kSurveyIterations = 6;
constexpr double kCauchy_m = 0.02;    // a point so far from its face counts half
constexpr double kKnownPlaces = 0.7;  // of those under a straightedge
constexpr double kLeastSpan = 0.9;    // of a straightedge, between the outer places under it
constexpr double kSurveyLeastBeside_m = 0.5;  // of faces that face each other
constexpr double kSurveyMostApart_m = 30;     // the same; DIN 18202 goes no further

constexpr double kStep_m = 0.25;  // between the places of a wall's profile

// A plane with axes of its own: along (level), upwards on it, and its normal.
struct Face {
  Vector3d middle, normal, along, upwards;

  void SetNormal(const Vector3d& n, const Vector3d& up) {
    normal = n;
    along = up.cross(normal).normalized();
    upwards = normal.cross(along);
  }
  double Off(const Vector3d& p) const { return normal.dot(p - middle); }
};

double NormalVariance(const PlacedInWorld& point, const Vector3d& normal) {
  return normal.dot(point.covariance_m2 * normal) + kPointSigma_m * kPointSigma_m;
}

// Least squares with Cauchy's loss, from the plane of the points' largest extents.
Face FitFace(const SurveyedPoints& wall, const Vector3d& up) {
  std::vector<double> weights(wall.points.size(), 1);
  Face face;
  for (int iteration = 0; iteration < kSurveyIterations; ++iteration) {
    double sum = 0;
    Vector3d middle = Vector3d::Zero();
    for (size_t i = 0; i < weights.size(); ++i) {
      middle += weights[i] * wall.points[i].p_world;
      sum += weights[i];
    }
    middle /= sum;
    Matrix3d spread = Matrix3d::Zero();
    for (size_t i = 0; i < weights.size(); ++i) {
      const Vector3d offset = wall.points[i].p_world - middle;
      spread += weights[i] * offset * offset.transpose();
    }
    Vector3d normal = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(0);
    if (normal.dot(wall.seen_from_world - middle) < 0) normal = -normal;
    face.middle = middle;
    face.SetNormal(normal, up);
    for (size_t i = 0; i < weights.size(); ++i) {
      const double off = face.Off(wall.points[i].p_world) / kCauchy_m;
      weights[i] = 1 / (NormalVariance(wall.points[i], normal) * (1 + off * off));
    }
  }
  return face;
}

struct WeightedValue {
  double value = 0, weight = 0;
};

double WeightedMedian(std::vector<WeightedValue> values) {
  std::sort(values.begin(), values.end(),
            [](const auto& a, const auto& b) { return a.value < b.value; });
  double half = 0;
  for (const WeightedValue& v : values) half += 0.5 * v.weight;
  double sum = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    sum += values[i].weight;
    // Where the halves meet between two values: their mean.
    if (sum == half && i + 1 < values.size()) return 0.5 * (values[i].value + values[i + 1].value);
    if (sum > half) return values[i].value;
  }
  return values.back().value;
}

// Places along the face, step_m apart, of points around each.
class ProfileMaker {
 public:
  explicit ProfileMaker(const Face& face) : face_(face) {}

  std::vector<ProfilePlace> Make(const std::vector<PlacedInWorld>& points) const {
    double first_m = HUGE_VAL;
    for (const PlacedInWorld& p : points) first_m = std::min(first_m, Along(p));
    std::map<int64_t, std::vector<const PlacedInWorld*>> places;
    for (const PlacedInWorld& p : points) {
      places[std::lround((Along(p) - first_m) / kStep_m)].push_back(&p);
    }
    std::vector<ProfilePlace> profile;
    for (const auto& [place, around] : places) {
      if (static_cast<int>(around.size()) >= kSurveyMinPoints) {
        profile.push_back(MakeProfilePlace(around));
      }
    }
    return profile;
  }

 private:
  double Along(const PlacedInWorld& p) const { return face_.along.dot(p.p_world - face_.middle); }

  ProfilePlace MakeProfilePlace(const std::vector<const PlacedInWorld*>& around) const {
    std::vector<WeightedValue> off;
    double along_m = 0, weights = 0;
    for (const PlacedInWorld* p : around) {
      const double weight = 1 / NormalVariance(*p, face_.normal);
      off.push_back({face_.Off(p->p_world), weight});
      along_m += weight * Along(*p);
      weights += weight;
    }
    return {along_m / weights, WeightedMedian(off)};
  }

  const Face& face_;
};

// The corners of the upper side (sign 1) or lower side (-1) of the hull of places in their order.
std::vector<Vector2d> HullSide(const std::vector<Vector2d>& places, double sign) {
  std::vector<Vector2d> hull;
  for (const Vector2d& p : places) {
    while (hull.size() >= 2) {
      const Vector2d a = hull[hull.size() - 1] - hull[hull.size() - 2], b = p - hull.back();
      if (sign * (a.x() * b.y() - a.y() * b.x()) < 0) break;
      hull.pop_back();
    }
    hull.push_back(p);
  }
  return hull;
}

// The least distance, along y, of two parallels that hold the places: one lies on an edge of the
// hull.
double LeastZone(const std::vector<Vector2d>& places) {
  double least = HUGE_VAL;
  for (const double sign : {1.0, -1.0}) {
    const std::vector<Vector2d> hull = HullSide(places, sign);
    for (size_t i = 0; i + 1 < hull.size(); ++i) {
      const double slope = (hull[i + 1].y() - hull[i].y()) / (hull[i + 1].x() - hull[i].x());
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (const Vector2d& p : places) {
        low = std::min(low, p.y() - slope * p.x());
        high = std::max(high, p.y() - slope * p.x());
      }
      least = std::min(least, high - low);
    }
  }
  return least;
}

// What lies alone at the ends of a face does not make it longer: from the 1st to the 99th of a
// hundred points.
Interval Inner(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t cut = values.size() / 100;
  return {values[cut], values[values.size() - 1 - cut]};
}

std::optional<SurveyedFace> MeasureWall(const SurveyedPoints& wall, const Vector3d& up) {
  if (wall.points.size() < 3) return std::nullopt;
  const Face face = FitFace(wall, up);
  std::vector<double> along_m, up_m;
  SurveyedFace result;
  result.wall = wall.wall;
  result.middle_world = face.middle;
  result.normal_world = face.normal;
  for (const PlacedInWorld& p : wall.points) {
    along_m.push_back(face.along.dot(p.p_world - face.middle));
    up_m.push_back(face.upwards.dot(p.p_world - face.middle));
  }
  const Interval along = Inner(along_m), upwards = Inner(up_m);
  result.length_m = along.length_m();
  if (!(result.length_m >= kSurveyMinLength_m)) return std::nullopt;
  result.middle_world += 0.5 * (along.from_m + along.to_m) * face.along +
                         0.5 * (upwards.from_m + upwards.to_m) * face.upwards;
  const std::vector<ProfilePlace> profile = ProfileMaker(face).Make(wall.points);
  for (const double length_m : kSurveyStraightedges_m) {
    const auto gap_m = GapUnder_m(profile, length_m, kStep_m);
    if (gap_m) result.gaps.push_back({length_m, *gap_m});
  }
  return result;
}

// The stretch of a face along a direction, from a place.
Interval FindExtent(const SurveyedFace& wall, const Vector3d& direction, const Vector3d& from,
                    const Vector3d& up) {
  const Vector3d half = 0.5 * wall.length_m * up.cross(wall.normal_world).normalized();
  const auto [from_m, to_m] = std::minmax({direction.dot(wall.middle_world - half - from),
                                           direction.dot(wall.middle_world + half - from)});
  return {from_m, to_m};
}

std::optional<FaceDistance> DistanceBetween(const SurveyedFace& a, const SurveyedFace& b,
                                            const Vector3d& up) {
  if (a.normal_world.dot(b.normal_world) > -std::cos(kMaxParallel_deg / kDegreesPerRadian)) {
    return std::nullopt;
  }
  const Vector3d along = up.cross(a.normal_world).normalized();
  const Interval beside =
      Common(FindExtent(a, along, a.middle_world, up), FindExtent(b, along, a.middle_world, up));
  if (beside.length_m() < kSurveyLeastBeside_m) return std::nullopt;
  const Vector3d place = a.middle_world + 0.5 * (beside.from_m + beside.to_m) * along;
  // Along the mean of both normals, so that it does not matter which face comes first.
  const Vector3d across = (a.normal_world - b.normal_world).normalized();
  const double distance_m =
      (b.middle_world - place).dot(b.normal_world) / across.dot(b.normal_world);
  if (!(distance_m > 0.3 && distance_m < kSurveyMostApart_m)) return std::nullopt;
  return FaceDistance{a.wall, b.wall, distance_m};
}

}  // namespace

std::optional<double> GapUnder_m(const std::vector<ProfilePlace>& profile, double length_m,
                                 double step_m) {
  std::optional<double> largest;
  for (size_t first = 0; first < profile.size(); ++first) {
    std::vector<Vector2d> places;
    for (size_t i = first; i < profile.size(); ++i) {
      if (profile[i].along_m > profile[first].along_m + length_m + 0.5 * step_m) break;
      places.emplace_back(profile[i].along_m, profile[i].off_m);
    }
    if (places.size() < 3) continue;
    const double span_m = places.back().x() - places.front().x();
    const double known = static_cast<double>(places.size()) / (length_m / step_m);
    if (span_m < kLeastSpan * length_m || known < kKnownPlaces) continue;
    largest = std::max(largest.value_or(0), LeastZone(places));
  }
  return largest;
}

std::vector<SurveyedPoints> BendsAdded(const std::vector<SurveyedPoints>& walls,
                                       const std::vector<SurveyedPoints>& true_walls,
                                       const Vector3d& up_world) {
  std::vector<SurveyedPoints> added;
  for (const SurveyedPoints& truth : true_walls) {
    const auto wall = std::find_if(walls.begin(), walls.end(),
                                   [&](const auto& w) { return w.wall == truth.wall; });
    if (wall == walls.end() || wall->points.size() != truth.points.size()) continue;
    if (truth.points.size() < 3) continue;
    const Face face = FitFace(*wall, up_world);
    const Face true_face = FitFace(truth, up_world);
    SurveyedPoints bent = truth;
    for (size_t i = 0; i < bent.points.size(); ++i) {
      const double off_m = face.Off(wall->points[i].p_world);
      const double true_off_m = true_face.Off(truth.points[i].p_world);
      bent.points[i].p_world += (off_m - 2 * true_off_m) * true_face.normal;
    }
    added.push_back(std::move(bent));
  }
  return added;
}

Survey SurveyWalls(const std::vector<SurveyedPoints>& walls, const Vector3d& up_world) {
  Survey survey;
  for (const SurveyedPoints& wall : walls) {
    if (auto face = MeasureWall(wall, up_world)) survey.walls.push_back(std::move(*face));
  }
  for (size_t i = 0; i < survey.walls.size(); ++i) {
    for (size_t j = i + 1; j < survey.walls.size(); ++j) {
      const SurveyedFace &a = survey.walls[i], &b = survey.walls[j];
      if (const auto d = DistanceBetween(a, b, up_world)) survey.distances.push_back(*d);
    }
  }
  return survey;
}

std::optional<double> WorstGap_m(const Survey& survey, double length_m) {
  std::optional<double> worst_m;
  for (const SurveyedFace& wall : survey.walls) {
    for (const StraightedgeGap& gap : wall.gaps) {
      if (gap.length_m == length_m) worst_m = std::max(worst_m.value_or(0), gap.gap_m);
    }
  }
  return worst_m;
}

std::optional<double> DistanceError95_m(const Survey& survey, const Survey& truth) {
  std::vector<double> errors_m;
  for (const FaceDistance& d : survey.distances) {
    for (const FaceDistance& t : truth.distances) {
      if (d.first == t.first && d.second == t.second) {
        errors_m.push_back(std::abs(d.distance_m - t.distance_m));
      }
    }
  }
  if (errors_m.empty()) return std::nullopt;
  return QuantileFigure(errors_m, 0.95);
}

double AllowedGap_m(double length_m) {
  // Lengths [m], and what is allowed there [mm].
  constexpr std::array<std::pair<double, double>, 5> kAllowed = {
      {{0.1, 3}, {1, 5}, {4, 10}, {10, 20}, {15, 25}}};
  if (length_m <= kAllowed.front().first) return 1e-3 * kAllowed.front().second;
  for (size_t i = 1; i < kAllowed.size(); ++i) {
    const auto& [from_m, from_mm] = kAllowed[i - 1];
    const auto& [to_m, to_mm] = kAllowed[i];
    if (length_m > to_m) continue;
    return 1e-3 * (from_mm + (to_mm - from_mm) * (length_m - from_m) / (to_m - from_m));
  }
  return 1e-3 * kAllowed.back().second;
}

}  // namespace slcmap::evaluation
