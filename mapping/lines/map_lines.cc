#include "mapping/lines/map_lines.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>

#include "data/core/parallel.h"
#include "mapping/lines/line_finder.h"
#include "mapping/lines/line_kinds.h"
#include "mapping/lines/line_merging.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kTextureReach_m = 0.4;

int FindAxis(const Line& line, const std::vector<BuildingAxis>& axes) {
  for (size_t i = 0; i < axes.size(); ++i) {
    if (axes[i].axis != line.axis) continue;
    if (line.axis == LineAxis::kVertical || axes[i].world == line.world) return static_cast<int>(i);
  }
  return -1;
}

// Segments run with the bright side on their left: the keyframe's tells which way the line does.
bool RunsAlong(const Line& line, const Keyframe& keyframe, const LineObservation& observation,
               const Rig& rig) {
  const RigidTransform T_camera_world =
      (keyframe.T_world_imu * rig.T_imu_camera[observation.camera]).Inverse();
  const Eigen::Vector3d start = T_camera_world * line.start_world;
  const Eigen::Vector3d end = T_camera_world * line.end_world;
  if (start.z() < 0.05 || end.z() < 0.05) return true;
  const Eigen::Vector2d along = end.hnormalized() - start.hnormalized();
  return along.dot(observation.left_px.end - observation.left_px.start) >= 0;
}

// How many keyframes see each line the way that it runs, less those that see it the other way.
std::map<int64_t, int> Senses(const OdometryRun& run) {
  std::map<int64_t, const Line*> lines;
  for (const Line& line : run.lines) lines[line.id] = &line;
  std::map<int64_t, int> senses;
  for (const Keyframe& keyframe : run.keyframes) {
    for (const LineObservation& observation : keyframe.lines) {
      const auto found = lines.find(observation.id);
      if (found == lines.end()) continue;
      senses[observation.id] +=
          RunsAlong(*found->second, keyframe, observation, run.rectified_rig) ? 1 : -1;
    }
  }
  return senses;
}

}  // namespace

std::vector<TrackedLine> KnownLines(const OdometryRun& run, const std::vector<BuildingAxis>& axes,
                                    double max_sigma_m, int min_views) {
  std::map<int64_t, int> senses = Senses(run);
  std::vector<TrackedLine> known;
  for (const Line& line : run.lines) {
    const Eigen::Vector3d along = line.end_world - line.start_world;
    const double sigma_m = std::sqrt(line.covariance_m2.trace());
    if (along.norm() < 0.05 || sigma_m > max_sigma_m || line.observations < min_views) continue;
    TrackedLine tracked;
    tracked.axis = FindAxis(line, axes);
    tracked.segment = line.segment;
    const double sense = senses[line.id] < 0 ? -1 : 1;
    tracked.line = {0.5 * (line.start_world + line.end_world), sense * along.normalized()};
    tracked.seen = {-0.5 * along.norm(), 0.5 * along.norm()};
    known.push_back(tracked);
  }
  return known;
}

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

LineCovariance ComputeCovariance(const LineFit& fit, const Interval& piece) {
  const auto start = ShiftAt(fit, piece.from_m), end = ShiftAt(fit, piece.to_m);
  const Eigen::Matrix4d& covariance = fit.world_covariance;
  return {0, 0, start * covariance * start.transpose(), end * covariance * end.transpose(),
          start * covariance * end.transpose()};
}

// A place, and the piece that it is on.
struct PlaceOfPiece {
  int piece = 0;
  const EdgePoint* place = nullptr;
};

auto GetImage(const PlaceOfPiece& p) { return std::tuple(p.piece, p.place->view, p.place->camera); }

// By piece, view and camera.
std::vector<PlaceOfPiece> PlacesByImage(const TrackedLine& line) {
  std::vector<PlaceOfPiece> places;
  for (const EdgePoint& place : line.places) {
    for (size_t i = 0; i < line.intervals.size(); ++i) {
      const Interval& piece = line.intervals[i];
      if (place.along_m < piece.from_m || place.along_m > piece.to_m) continue;
      places.push_back({static_cast<int>(i), &place});
      break;
    }
  }
  std::ranges::stable_sort(places, {}, GetImage);
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

Interval MeasureExtent(std::span<const PlaceOfPiece> places, const Interval& piece) {
  Interval extent{piece.to_m, piece.from_m};
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
std::optional<LineSegment> GetSegment(const TrackedLine& line, const Interval& extent,
                                      std::span<const PlaceOfPiece> places,
                                      const ViewCameras& cameras) {
  const int samples =
      std::accumulate(places.begin(), places.end(), 0,
                      [](int sum, const PlaceOfPiece& p) { return sum + p.place->samples; });
  if (samples < kLeastSamples) return std::nullopt;
  const EdgePoint& first = *places.front().place;
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
        from, places.end(), [&](const PlaceOfPiece& p) { return GetImage(p) != GetImage(*from); });
    const std::span<const PlaceOfPiece> of_image(from, to);
    const Interval extent = MeasureExtent(of_image, line.intervals[from->piece]);
    if (const auto px = GetSegment(line, extent, of_image, cameras)) {
      const EdgePoint& place = *from->place;
      const View& view = views[place.view];
      supports->push_back({id, from->piece, view.stamp_ns, view.left_camera + place.camera, *px});
    }
    from = to;
  }
}

}  // namespace

LineEvidence CollectEvidence(const std::vector<TrackedLine>& lines, const Views& views,
                             const ViewCameras& cameras) {
  LineEvidence evidence;
  for (size_t i = 0; i < lines.size(); ++i) {
    const auto id = static_cast<int64_t>(i);
    for (size_t k = 0; k < lines[i].intervals.size(); ++k) {
      LineCovariance covariance = ComputeCovariance(lines[i].fit, lines[i].intervals[k]);
      covariance.line_id = id;
      covariance.piece = static_cast<int>(k);
      evidence.covariances.push_back(covariance);
    }
    AddSupports(lines[i], id, views, cameras, &evidence.supports);
  }
  // Views of a further pair stand behind those of the one before.
  std::ranges::sort(evidence.supports, {}, [](const LineSupport& s) { return MakeKey(s); });
  return evidence;
}

namespace {

// Shares of the time, about, up to the end of a step.
constexpr double kFound = 0.6;

void AddMapLines(const TrackedLine& line, int64_t id, const std::vector<BuildingAxis>& axes,
                 std::vector<MapLine>* map_lines) {
  MapLine piece;
  piece.id = id;
  piece.segment = line.segment;
  if (line.axis >= 0) {
    const BuildingAxis& axis = axes[line.axis];
    piece.axis = axis.axis;
    piece.world = axis.world;
    piece.deviation_rad =
        std::acos(std::min(1.0, std::abs(axis.direction_world.dot(line.line.direction_world))));
  }
  piece.sigma_m = line.fit.sigma_m();
  piece.deviation_sigma_rad =
      std::sqrt(line.fit.world_covariance.bottomRightCorner<2, 2>().trace() / 2);
  piece.observations = line.fit.views;
  piece.SetProbability(ComputeEdgeProbability(line));
  for (const Interval& interval : line.intervals) {
    piece.start_world = line.line.point_world + interval.from_m * line.line.direction_world;
    piece.end_world = line.line.point_world + interval.to_m * line.line.direction_world;
    map_lines->push_back(piece);
  }
}

}  // namespace

std::vector<BuildingAxis> AxesOfViews(const Views& views, const ViewImages& images,
                                      const MapLineOptions& options, const Progress& progress) {
  const std::vector<BuildingAxis> none;
  LineFinder finder(views, images, none, options);
  std::vector<DirectedLine> directed;
  for (const TrackedLine& line : finder.Find({}, progress)) {
    directed.push_back({line.line.direction_world, line.seen.length_m(),
                        std::sqrt(line.fit.covariance.bottomRightCorner<2, 2>().trace() / 2)});
  }
  return FindAxes(directed);
}

std::vector<TrackedLine> TrackLines(const Views& views, const ViewImages& images,
                                    const std::vector<BuildingAxis>& axes,
                                    std::vector<TrackedLine> known, const VisibilityDepths& depths,
                                    const LineSurfaces& surfaces, const MapLineOptions& options,
                                    const Progress& progress) {
  std::vector<TrackedLine> lines =
      LineFinder(views, images, axes, options).Find(std::move(known), progress.Part(0, kFound));
  LookForLines(views, images, depths, options, &lines, progress.Part(kFound, 1));
  FitLines(views, images.rig(), axes, options, &lines);
  lines = MergeLines(std::move(lines));
  ParallelFor(lines.size(), [&](size_t i) {
    lines[i].surfaces = surfaces.Beside(lines[i].line, lines[i].intervals);
  });
  CountParallels(kTextureReach_m, &lines);
  return lines;
}

LinesOfMap BuildLines(const Views& views, const ViewImages& images,
                      const std::vector<BuildingAxis>& axes, std::vector<TrackedLine> known,
                      const VisibilityDepths& depths, const LineSurfaces& surfaces,
                      const MapLineOptions& options, const Progress& progress) {
  const std::vector<TrackedLine> lines =
      TrackLines(views, images, axes, std::move(known), depths, surfaces, options, progress);
  return {AsMapLines(lines, axes), CollectEvidence(lines, views, ViewCameras(views, images.rig()))};
}

std::vector<MapLine> AsMapLines(const std::vector<TrackedLine>& lines,
                                const std::vector<BuildingAxis>& axes) {
  std::vector<MapLine> map_lines;
  for (size_t i = 0; i < lines.size(); ++i) {
    AddMapLines(lines[i], static_cast<int64_t>(i), axes, &map_lines);
  }
  return map_lines;
}

std::vector<MapLine> TakeMarks(std::vector<MapLine>* lines) {
  const auto is_mark = [](const MapLine& line) { return line.kind == LineKind::kMark; };
  std::vector<MapLine> marks;
  std::copy_if(lines->begin(), lines->end(), std::back_inserter(marks), is_mark);
  std::erase_if(*lines, is_mark);
  return marks;
}

}  // namespace slcmap::mapping
