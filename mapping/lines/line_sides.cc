#include "mapping/lines/line_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "data/core/parallel.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kPiece_m = 0.2;
constexpr int kPieces = 6;               // of a line, spread over it
constexpr int kReferences = 3;           // of a piece
constexpr int kReach = 12;               // views to either side that a reference is compared with
constexpr int kOthers = 6;               // images that a piece is compared with
constexpr int kAcross = 4, kAlong = 12;  // samples of a band
constexpr int kSamples = kAcross * kAlong;
constexpr double kBandFrom_px = 1.5, kStep_px = 2;  // of the band's columns from the line
constexpr int kTilts = 12;                          // of half-planes through the line
constexpr std::array kBehind_px{1.5, 2.3, 3.4, 5.1, 7.6, 11.4, 17.1, 25.6};  // parallax
constexpr std::array kBehindTilts_rad{-0.7, 0.0, 0.7};
constexpr int kSurfaces = kTilts + static_cast<int>(kBehind_px.size() * kBehindTilts_rad.size());
constexpr double kNarrowest_rad = 0.02, kWidest_rad = 0.55;  // between bearings of a piece
constexpr double kMaxScale = 1.6;                            // between images of a piece
// Variance of grey values that noise and resampling leave, and the share of the patch's own.
constexpr double kNoise = 12, kOwnShare = 0.04;
constexpr double kIndependent = 0.15;  // samples that err alike count as so many
constexpr double kOutlier = 0.1;       // share of the views that something else is seen in

// A side of a piece in its reference view: rays to its samples, and their grey values.
struct Band {
  std::array<Eigen::Vector3f, kSamples> rays;
  std::array<float, kSamples> grey;  // without their mean
  float variance = 0;
};

// An image that the piece is seen in.
struct Other {
  const cv::Mat* image = nullptr;
  RigidTransform T_other_reference;
  double turn_rad = 0;
  double baseline_m = 0;  // across the ray to the piece
};

// Grey value at a place; less than 0 outside.
float SampleAt(const cv::Mat& image, float x, float y) {
  if (!(x >= 0 && y >= 0)) return -1;
  if (static_cast<int>(x) + 1 >= image.cols || static_cast<int>(y) + 1 >= image.rows) return -1;
  return SampleBetween(image, x, y);
}

// The piece in the frame of the reference's left camera.
struct Piece {
  Eigen::Vector3d start, end;
  Eigen::Vector3d Middle() const { return 0.5 * (start + end); }
};

std::optional<Band> MakeBand(const Piece& piece, double side, const cv::Mat& image,
                             const Camera& camera) {
  const LineSegment px =
      PixelFromPlane(camera, LineSegment{piece.start.hnormalized(), piece.end.hnormalized()});
  const Eigen::Vector2d way = px.end - px.start, along = way.normalized();
  const Eigen::Vector2d across = side * Eigen::Vector2d(-along.y(), along.x());
  Band band;
  double sum = 0, squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector2d place = px.start + (i / kAcross + 0.5) / kAlong * way +
                                  (kBandFrom_px + kStep_px * (i % kAcross)) * across;
    const float grey =
        SampleAt(image, static_cast<float>(place.x()), static_cast<float>(place.y()));
    if (grey < 0) return std::nullopt;
    band.grey[i] = grey;
    band.rays[i] = PlaneFromPixel(camera, place).homogeneous().cast<float>();
    sum += grey;
    squares += static_cast<double>(grey) * grey;
  }
  const double mean = sum / kSamples;
  for (float& grey : band.grey) grey -= static_cast<float>(mean);
  band.variance = static_cast<float>(squares / kSamples - mean * mean);
  return band;
}

// n . X = 1 in the frame of the reference.
using PlaneVector = Eigen::Vector3d;

// Half-planes through the piece by their tilt from towards the camera to away from it, then planes
// behind it; `side` as the band's.
std::array<PlaneVector, kSurfaces> MakePlanes(const Piece& piece, double side, double step_per_m) {
  const Eigen::Vector3d middle = piece.Middle();
  const Eigen::Vector3d along = (piece.end - piece.start).normalized();
  const Eigen::Vector3d off = (middle - middle.dot(along) * along).normalized();  // away
  const Eigen::Vector3d across = side * off.cross(along);
  std::array<PlaneVector, kSurfaces> planes;
  for (int i = 0; i < kTilts; ++i) {
    const double tilt = std::numbers::pi * (i + 1) / (kTilts + 1);
    const Eigen::Vector3d lies = -std::cos(tilt) * off + std::sin(tilt) * across;
    const Eigen::Vector3d normal = along.cross(lies);
    planes[i] = normal / normal.dot(middle);
  }
  int next = kTilts;
  const double inverse = 1 / middle.dot(off);
  for (const double behind_px : kBehind_px) {
    const double distance = 1 / std::max(inverse - behind_px * step_per_m, 0.03);
    for (const double tilt : kBehindTilts_rad) {
      const Eigen::Vector3d normal = std::cos(tilt) * off + std::sin(tilt) * across;
      planes[next++] = normal / normal.dot(distance * off);
    }
  }
  return planes;
}

// Log-likelihood of what another image shows where a plane has the samples of a band, against that
// they have nothing in common.
double CompareBand(const Band& band, const PlaneVector& plane, const Other& other,
                   const Eigen::Matrix3d& K) {
  const Eigen::Matrix3d H = other.T_other_reference.rotation.toRotationMatrix() +
                            other.T_other_reference.translation * plane.transpose();
  const Eigen::Matrix3f KH = (K * H).cast<float>();
  const Eigen::Vector3f normal = plane.cast<float>();
  float sum = 0, squares = 0, common = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3f q = KH * band.rays[i];
    if (q.z() <= 0 || normal.dot(band.rays[i]) <= 0) return 0;
    const float grey = SampleAt(*other.image, q.x() / q.z(), q.y() / q.z());
    if (grey < 0) return 0;
    sum += grey;
    squares += grey * grey;
    common += grey * band.grey[i];
  }
  const double mean = sum / kSamples, variance = squares / kSamples - mean * mean;
  const double covariance = std::max<double>(common / kSamples, 0);
  const double r2 = covariance * covariance / std::max(1e-6, variance * band.variance);
  const double V = band.variance, floor = kNoise + kOwnShare * V;
  const double log_ratio = std::log((floor + V * (1 - std::min(r2, 1.0))) / (floor + V));
  const double likelihood = std::exp(-0.5 * kIndependent * kSamples * log_ratio);
  return std::log((1 - kOutlier) * likelihood + kOutlier);
}

using Likelihoods = std::array<double, kSurfaces>;  // logarithms

Likelihoods CompareSide(const Band& band, const std::array<PlaneVector, kSurfaces>& planes,
                        const std::vector<Other>& others, const Camera& camera) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = camera.fx_px, K(1, 1) = camera.fy_px, K(0, 2) = camera.cx_px, K(1, 2) = camera.cy_px;
  Likelihoods all{};
  for (int i = 0; i < kSurfaces; ++i) {
    for (const Other& other : others) all[i] += CompareBand(band, planes[i], other, K);
  }
  return all;
}

// The logarithm of a mean of exponentials.
class LogMean {
 public:
  void Add(double value) { values_.push_back(value); }
  double Get() const {
    if (values_.empty()) return -1e9;
    const double most = *std::max_element(values_.begin(), values_.end());
    double sum = 0;
    for (const double value : values_) sum += std::exp(value - most);
    return most + std::log(sum / static_cast<double>(values_.size()));
  }

 private:
  std::vector<double> values_;
};

// What both sides say together, of all planes of each kind.
SideVotes Vote(const Likelihoods& left, const Likelihoods& right) {
  LogMean flat;  // half-planes that are one plane
  for (int i = 0; i < kTilts; ++i) flat.Add(left[i] + right[kTilts - 1 - i]);
  LogMean left_on, right_on, left_off, right_off;
  for (int i = 0; i < kSurfaces; ++i) {
    (i < kTilts ? left_on : left_off).Add(left[i]);
    (i < kTilts ? right_on : right_off).Add(right[i]);
  }
  LogMean behind;
  behind.Add(left_on.Get() + right_off.Get());
  behind.Add(left_off.Get() + right_on.Get());
  return {behind.Get() - flat.Get(), 1};
}

struct Task {
  size_t line = 0;
  double from_m = 0, to_m = 0;
};

// Where pieces of a line are, spread over its intervals.
std::vector<Interval> SpreadPieces(const TrackedLine& line) {
  const double length_m = TotalLength_m(line.intervals);
  const int count = std::clamp(static_cast<int>(length_m / kPiece_m), 1, kPieces);
  std::vector<Interval> pieces;
  for (int i = 0; i < count; ++i) {
    double at_m = (i + 0.5) * length_m / count;
    for (const Interval& interval : line.intervals) {
      if (at_m > interval.length_m()) {
        at_m -= interval.length_m();
        continue;
      }
      const double half_m = 0.5 * std::min(kPiece_m, interval.length_m());
      const double middle_m =
          std::clamp(interval.from_m + at_m, interval.from_m + half_m, interval.to_m - half_m);
      pieces.push_back({middle_m - half_m, middle_m + half_m});
      break;
    }
  }
  return pieces;
}

// The left images that show the edge at a piece from near, one of a place each.
std::vector<int> ChooseReferences(const TrackedLine& line, const Interval& piece,
                                  const ViewCameras& cameras) {
  const Eigen::Vector3d middle =
      line.line.point_world + 0.5 * (piece.from_m + piece.to_m) * line.line.direction_world;
  std::vector<std::pair<double, int>> by_distance;
  for (const EdgePoint& place : line.places) {
    if (place.camera != 0 || place.to_m < piece.from_m || place.from_m > piece.to_m) continue;
    const double distance_m = (cameras.Centre(place.view) - middle).norm();
    const std::pair<double, int> entry(distance_m, place.view);
    if (std::find(by_distance.begin(), by_distance.end(), entry) == by_distance.end()) {
      by_distance.push_back(entry);
    }
  }
  std::sort(by_distance.begin(), by_distance.end());
  std::vector<int> chosen;
  const size_t most = by_distance.size();
  for (int i = 0; i < kReferences && i < static_cast<int>(most); ++i) {
    // The nearest, and some from farther away.
    const size_t at = i * std::max<size_t>(1, most / 2) / kReferences;
    const int view = by_distance[std::min(at + (most < 6 ? i : 0), most - 1)].second;
    if (std::find(chosen.begin(), chosen.end(), view) == chosen.end()) chosen.push_back(view);
  }
  return chosen;
}

class SideComparer {
 public:
  SideComparer(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
               const ViewCameras& cameras)
      : views_(views),
        depths_(depths),
        cameras_(cameras),
        images_(
            views.size(), [&images](size_t view) { return images.Read(static_cast<int>(view)); },
            kReach) {}

  void MoveTo(int view) { images_.MoveTo(view); }

  SideVotes Compare(const TrackedLine& line, const Task& task, int view) const {
    const RigidTransform& T_camera_world = cameras_.T_camera_world[view][0];
    const auto at = [&](double along_m) -> Eigen::Vector3d {
      return T_camera_world * (line.line.point_world + along_m * line.line.direction_world);
    };
    const Piece piece{at(task.from_m), at(task.to_m)};
    const cv::Mat& image = images_.at(view).left;
    if (image.empty() || piece.start.z() < 0.2 || piece.end.z() < 0.2) return {};
    const auto left = MakeBand(piece, -1, image, cameras_.cameras[0]);
    const auto right = MakeBand(piece, 1, image, cameras_.cameras[0]);
    const std::vector<Other> others = ChooseOthers(piece, view);
    if (!left || !right || others.size() < 2) return {};
    double widest_m = 0;
    for (const Other& other : others) widest_m = std::max(widest_m, other.baseline_m);
    const double step = 1 / (cameras_.cameras[0].fx_px * widest_m);
    const Camera& camera = cameras_.cameras[0];
    return Vote(CompareSide(*left, MakePlanes(piece, -1, step), others, camera),
                CompareSide(*right, MakePlanes(piece, 1, step), others, camera));
  }

 private:
  std::vector<Other> ChooseOthers(const Piece& piece, int view) const {
    const Eigen::Vector3d middle = piece.Middle();
    const RigidTransform T_world_reference = cameras_.T_camera_world[view][0].Inverse();
    std::vector<Other> all;
    for (const auto& [other_view, pair] : images_.kept()) {
      if (views_[other_view].segment != views_[view].segment) continue;
      for (int camera = 0; camera < 2; ++camera) {
        if (other_view == view && camera == 0) continue;
        const cv::Mat& image = camera == 0 ? pair.left : pair.right;
        if (image.empty()) continue;
        Other other{&image, cameras_.T_camera_world[other_view][camera] * T_world_reference};
        if (!IsUseful(piece, middle, other_view, camera, &other)) continue;
        all.push_back(other);
      }
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Other& a, const Other& b) { return a.turn_rad < b.turn_rad; });
    std::vector<Other> chosen;
    const size_t count = std::min<size_t>(kOthers, all.size());
    for (size_t i = 0; i < count; ++i) chosen.push_back(all[(i + 1) * all.size() / count - 1]);
    return chosen;
  }

  bool IsUseful(const Piece& piece, const Eigen::Vector3d& middle, int view, int camera,
                Other* other) const {
    const Eigen::Vector3d q = other->T_other_reference * middle;
    if (q.z() < 0.2) return false;
    const double scale = q.norm() / middle.norm();
    if (scale > kMaxScale || scale < 1 / kMaxScale) return false;
    for (const Eigen::Vector3d& end : {piece.start, piece.end}) {
      const Eigen::Vector3d p = other->T_other_reference * end;
      if (p.z() < 0.2) return false;
      const Eigen::Vector2d px =
          PixelFromPlane(cameras_.cameras[camera], Eigen::Vector2d(p.hnormalized()));
      const Camera& model = cameras_.cameras[camera];
      if (px.x() < 12 || px.y() < 12 || px.x() > model.width_px - 13 ||
          px.y() > model.height_px - 13) {
        return false;
      }
      if (depths_.Hides(view, camera, px, p.z())) return false;
    }
    const Eigen::Vector3d centre = other->T_other_reference.Inverse().translation;
    const Eigen::Vector3d along = (piece.end - piece.start).normalized();
    // Only what is moved across the line tells of depth.
    const Eigen::Vector3d ray = middle.normalized();
    const Eigen::Vector3d side = along.cross(ray).normalized();
    const double across_m = std::abs(centre.dot(side));
    other->turn_rad = std::atan2(across_m, middle.norm());
    other->baseline_m = across_m;
    return other->turn_rad > kNarrowest_rad && other->turn_rad < kWidest_rad;
  }

  const Views& views_;
  const VisibilityDepths& depths_;
  const ViewCameras& cameras_;
  ItemsAround<StereoImage> images_;
};

void Add(const SideVotes& votes, SideVotes* sum) {
  constexpr double kMost = 8;
  sum->behind += std::clamp(votes.behind, -kMost, kMost);
  sum->pieces += votes.pieces;
}

}  // namespace

void CompareSides(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
                  std::vector<TrackedLine>* lines, const Progress& progress) {
  const ViewCameras cameras(views, images.rig());
  std::vector<std::vector<Task>> tasks(views.size());  // by reference
  for (size_t i = 0; i < lines->size(); ++i) {
    for (const Interval& piece : SpreadPieces((*lines)[i])) {
      for (const int view : ChooseReferences((*lines)[i], piece, cameras)) {
        tasks[view].push_back({i, piece.from_m, piece.to_m});
      }
    }
  }
  SideComparer comparer(views, images, depths, cameras);
  for (size_t view = 0; view < views.size(); ++view) {
    if (!progress.Report(static_cast<double>(view) / static_cast<double>(views.size()))) return;
    if (tasks[view].empty()) continue;
    comparer.MoveTo(static_cast<int>(view));
    std::vector<SideVotes> votes(tasks[view].size());
    ParallelFor(votes.size(), [&](size_t k) {
      const Task& task = tasks[view][k];
      votes[k] = comparer.Compare((*lines)[task.line], task, static_cast<int>(view));
    });
    for (size_t k = 0; k < votes.size(); ++k) {
      if (votes[k].pieces > 0) Add(votes[k], &(*lines)[tasks[view][k].line].sides);
    }
  }
}

}  // namespace slcmap::mapping
