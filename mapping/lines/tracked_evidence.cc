#include "mapping/lines/tracked_evidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

constexpr double kLeastLength_px = 3;  // of a support
constexpr int kLeastSamples = 2;       // of its places: one tells no direction
constexpr double kMaxOff_px = 2;       // of its places in the mean: farther off is another edge
// Of places that tell which way a segment runs: of its length, as standard deviation.
constexpr double kLeastSpread = 0.2;
constexpr double kLeastDepth_m = 0.05;

// What a place across the line moves by, from the four numbers that FitLine finds.
Eigen::Matrix<double, 3, 4> ShiftAt(const LineFit& fit, double along_m) {
  Eigen::Matrix<double, 3, 4> shift;
  shift << fit.across, along_m * fit.across;
  return shift;
}

LineCovariance CovarianceOf(const LineFit& fit, const Stretch& piece) {
  const auto start = ShiftAt(fit, piece.from_m), end = ShiftAt(fit, piece.to_m);
  const Eigen::Matrix4d& covariance = fit.world_covariance;
  return {0, 0, start * covariance * start.transpose(), end * covariance * end.transpose(),
          start * covariance * end.transpose()};
}

// A place, and the piece that it is on.
struct PlaceOfPiece {
  int piece = 0;
  const EdgePlace* place = nullptr;
};

auto ImageOf(const PlaceOfPiece& p) { return std::tuple(p.piece, p.place->view, p.place->camera); }

// By piece, view and camera; views are in the order of their stamps.
std::vector<PlaceOfPiece> PlacesByImage(const TrackedLine& line) {
  std::vector<PlaceOfPiece> places;
  for (const EdgePlace& place : line.places) {
    for (size_t i = 0; i < line.intervals.size(); ++i) {
      const Stretch& piece = line.intervals[i];
      if (place.along_m < piece.from_m || place.along_m > piece.to_m) continue;
      places.push_back({static_cast<int>(i), &place});
      break;
    }
  }
  std::ranges::stable_sort(places, {}, ImageOf);
  return places;
}

// How far places are from a segment, to the left of it as y points down, as a linear function of
// the way along it: by least squares.
class Deviation {
 public:
  Deviation(const LineSegment& px, std::span<const PlaceOfPiece> places) {
    const Eigen::Vector2d along = (px.end - px.start).normalized(), across{-along.y(), along.x()};
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    for (const PlaceOfPiece& p : places) {
      const Eigen::Vector2d off = p.place->px.cast<double>() - px.start;
      const Eigen::Vector2d uv(along.dot(off), across.dot(off));
      count_ += p.place->samples;
      mean_ += p.place->samples * uv;
      squares += p.place->samples * uv * uv.transpose();
    }
    mean_ /= count_;
    const Eigen::Matrix2d spread = squares / count_ - mean_ * mean_.transpose();
    const double least_px = kLeastSpread * px.Length();
    if (spread(0, 0) > least_px * least_px) slope_ = spread(0, 1) / spread(0, 0);
  }

  double mean_px() const { return mean_.y(); }

  double At(double along_px) const { return mean_.y() + slope_ * (along_px - mean_.x()); }

 private:
  double count_ = 0, slope_ = 0;
  Eigen::Vector2d mean_ = Eigen::Vector2d::Zero();
};

Stretch ExtentOf(std::span<const PlaceOfPiece> places, const Stretch& piece) {
  Stretch extent{piece.to_m, piece.from_m};
  for (const PlaceOfPiece& p : places) {
    extent.from_m = std::min(extent.from_m, std::max<double>(p.place->from_m, piece.from_m));
    extent.to_m = std::max(extent.to_m, std::min<double>(p.place->to_m, piece.to_m));
  }
  return extent;
}

// The part of a segment that is in an image; nothing where none is.
std::optional<LineSegment> InImage(const LineSegment& px, const Camera& camera) {
  const Eigen::Vector2d along = px.end - px.start, least(-0.5, -0.5);
  const Eigen::Vector2d most(camera.width_px - 0.5, camera.height_px - 0.5);
  double from = 0, to = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double to_least = least[axis] - px.start[axis], to_most = most[axis] - px.start[axis];
    if (along[axis] == 0) {
      if (to_least > 0 || to_most < 0) return std::nullopt;
      continue;
    }
    const double a = to_least / along[axis], b = to_most / along[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  if (from > to) return std::nullopt;
  return LineSegment{px.start + from * along, px.start + to * along};
}

// The edge of a piece in the image that the places are of; nothing where that is too short, or not
// where the line is.
std::optional<LineSegment> SegmentOf(const TrackedLine& line, const Stretch& extent,
                                     std::span<const PlaceOfPiece> places,
                                     const ViewCameras& cameras) {
  const int samples =
      std::accumulate(places.begin(), places.end(), 0,
                      [](int sum, const PlaceOfPiece& p) { return sum + p.place->samples; });
  if (samples < kLeastSamples) return std::nullopt;
  const EdgePlace& first = *places.front().place;
  const RigidTransform& T_camera_world = cameras.T_camera_world[first.view][first.camera];
  const auto at = [&](double along_m) -> Eigen::Vector3d {
    return T_camera_world * (line.line.point_world + along_m * line.line.direction_world);
  };
  const Eigen::Vector3d start = at(extent.from_m), end = at(extent.to_m);
  if (start.z() < kLeastDepth_m || end.z() < kLeastDepth_m) return std::nullopt;
  const Camera& camera = cameras.cameras[first.camera];
  const LineSegment expected =
      PixelFromPlane(camera, LineSegment{start.hnormalized(), end.hnormalized()});
  const double length_px = expected.Length();
  if (length_px < kLeastLength_px) return std::nullopt;
  const Deviation deviation(expected, places);
  if (std::abs(deviation.mean_px()) > kMaxOff_px) return std::nullopt;
  const Eigen::Vector2d along = (expected.end - expected.start) / length_px;
  const Eigen::Vector2d across(-along.y(), along.x());
  const auto seen = InImage(
      {expected.start + deviation.At(0) * across, expected.end + deviation.At(length_px) * across},
      camera);
  return seen && seen->Length() >= kLeastLength_px ? seen : std::nullopt;
}

void AddSupports(const TrackedLine& line, int64_t id, const Views& views,
                 const ViewCameras& cameras, std::vector<LineSupport>* supports) {
  const std::vector<PlaceOfPiece> places = PlacesByImage(line);
  for (auto from = places.begin(); from != places.end();) {
    const auto to = std::find_if(
        from, places.end(), [&](const PlaceOfPiece& p) { return ImageOf(p) != ImageOf(*from); });
    const std::span<const PlaceOfPiece> of_image(from, to);
    const Stretch extent = ExtentOf(of_image, line.intervals[from->piece]);
    if (const auto px = SegmentOf(line, extent, of_image, cameras)) {
      const EdgePlace& place = *from->place;
      supports->push_back({id, from->piece, views[place.view].stamp_ns, place.camera, *px});
    }
    from = to;
  }
}

}  // namespace

LineEvidence EvidenceOf(const std::vector<TrackedLine>& lines, const Views& views,
                        const ViewCameras& cameras) {
  LineEvidence evidence;
  for (size_t i = 0; i < lines.size(); ++i) {
    const auto id = static_cast<int64_t>(i);
    for (size_t k = 0; k < lines[i].intervals.size(); ++k) {
      LineCovariance covariance = CovarianceOf(lines[i].fit, lines[i].intervals[k]);
      covariance.line_id = id;
      covariance.piece = static_cast<int>(k);
      evidence.covariances.push_back(covariance);
    }
    AddSupports(lines[i], id, views, cameras, &evidence.supports);
  }
  return evidence;
}

}  // namespace slcmap
