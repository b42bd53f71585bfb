#include "mapping/pipes/pipe_finder.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "data/core/parallel.h"
#include "mapping/map/map.h"
#include "mapping/pipes/outline_pairs.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

// From its pieces, which are on one straight line.
Outline MakeOutline(const std::vector<const MapLine*>& pieces) {
  const MapLine& first = *pieces.front();
  Outline outline;
  outline.line_id = first.id;
  outline.segment = first.segment;
  outline.axis = first.axis;
  outline.world = first.world;
  outline.sigma_m = first.sigma_m;
  const Vector3d direction = (first.end_world - first.start_world).normalized();
  double from_m = 0, to_m = 0;
  for (const MapLine* piece : pieces) {
    for (const Vector3d& end : {piece->start_world, piece->end_world}) {
      const double along_m = direction.dot(end - first.start_world);
      from_m = std::min(from_m, along_m);
      to_m = std::max(to_m, along_m);
    }
  }
  outline.line = {first.start_world + 0.5 * (from_m + to_m) * direction, direction};
  outline.half_m = 0.5 * (to_m - from_m);
  for (const MapLine* piece : pieces) {
    const double start_m = direction.dot(piece->start_world - outline.line.point_world);
    const double end_m = direction.dot(piece->end_world - outline.line.point_world);
    outline.pieces.push_back({std::min(start_m, end_m), std::max(start_m, end_m)});
  }
  return outline;
}

TangentRay RayThrough(const Eigen::Vector2d& px, const Camera& camera,
                      const RigidTransform& T_world_camera, const Outline& outline,
                      const PipeOptions& options) {
  const Eigen::Vector2d on_plane = PlaneFromPixel(camera, px);
  TangentRay ray;
  ray.centre_world = T_world_camera.translation;
  ray.ray_world = T_world_camera.rotation * Vector3d(on_plane.x(), on_plane.y(), 1).normalized();
  // Where it is nearest to the line.
  const Vector3d across = ray.ray_world.cross(outline.line.direction_world);
  const Vector3d way = outline.line.point_world - ray.centre_world;
  const double sine2 = std::max(across.squaredNorm(), 1e-6);
  const double depth_m = way.cross(outline.line.direction_world).dot(across) / sine2;
  ray.sigma_m =
      std::hypot(options.sigma_px * std::abs(depth_m) / camera.fx_px, options.pose_sigma_m);
  return ray;
}

}  // namespace

std::vector<Outline> CollectOutlines(const MapResult& map, const PipeOptions& options) {
  std::map<int64_t, std::vector<const MapLine*>> pieces;
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) {
      if ((line.end_world - line.start_world).norm() > 0) pieces[line.id].push_back(&line);
    }
  }
  std::map<int64_t, Outline> outlines;
  for (const auto& [id, of_line] : pieces) outlines.emplace(id, MakeOutline(of_line));
  const auto poses = PosesByStamp(map);
  std::map<std::pair<int64_t, int>, int> images;
  for (const LineSupport& support : map.line_evidence.supports) {
    const auto outline = outlines.find(support.line_id);
    const auto pose = poses.find(support.stamp_ns);
    if (outline == outlines.end() || pose == poses.end()) continue;
    const int next = static_cast<int>(images.size());
    const int image =
        images.emplace(std::pair(support.stamp_ns, support.camera), next).first->second;
    const RigidTransform T_world_camera =
        pose->second * map.rectified_rig.T_imu_camera[support.camera];
    for (const Eigen::Vector2d& px : {support.px.start, support.px.end}) {
      TangentRay ray = RayThrough(px, map.rectified_rig.cameras[support.camera], T_world_camera,
                                  outline->second, options);
      ray.image = image;
      outline->second.rays.push_back(ray);
    }
  }
  std::vector<Outline> seen;
  for (auto& [id, outline] : outlines) {
    if (!outline.rays.empty()) seen.push_back(std::move(outline));
  }
  return seen;
}

namespace {

constexpr int kRounds = 3;              // of looking for further outlines
constexpr double kBeyond_m = 1;         // past the ends of the outlines that are known
constexpr double kMinOverlap_m = 0.25;  // of two lines
constexpr double kApart = 2.2;          // radii: two lines at most
constexpr double kMaxShift = 1.5;       // of the axis from the middle between two lines, in radii

// The middle between two lines where they are side by side, with their direction; nothing where
// they are not parallel, or nowhere side by side.
std::optional<PointAndDirection> Between(const Outline& a, const Outline& b,
                                         const PipeOptions& options) {
  const double cosine = a.line.direction_world.dot(b.line.direction_world);
  if (std::abs(cosine) < std::cos(options.max_turn_rad) || a.segment != b.segment) {
    return std::nullopt;
  }
  const double sense = cosine < 0 ? -1 : 1;
  const Vector3d direction =
      (a.half_m * a.line.direction_world + sense * b.half_m * b.line.direction_world).normalized();
  const double along_m = direction.dot(b.line.point_world - a.line.point_world);
  const double from_m = std::max(-a.half_m, along_m - b.half_m);
  const double to_m = std::min(a.half_m, along_m + b.half_m);
  if (to_m - from_m < kMinOverlap_m) return std::nullopt;
  const double middle_m = 0.5 * (from_m + to_m);
  const Vector3d on_a = a.line.point_world + middle_m * a.line.direction_world;
  const Vector3d on_b = b.line.point_world + (middle_m - along_m) * sense * b.line.direction_world;
  const double apart_m = (on_b - on_a).norm();
  if (apart_m < options.min_radius_m || apart_m > kApart * options.max_radius_m) {
    return std::nullopt;
  }
  return PointAndDirection{0.5 * (on_a + on_b), direction};
}

// What two lines may be the outlines of, by least squares: each ray passes the axis at the radius,
// on the side on which it passes the middle between them. The axis runs as `middle` does.
std::optional<Cylinder> FitCylinder(const PointAndDirection& middle, const Outline& a,
                                    const Outline& b) {
  const Vector3d first = middle.direction_world.unitOrthogonal();
  const Vector3d second = middle.direction_world.cross(first);
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  for (const Outline* outline : {&a, &b}) {
    for (const TangentRay& ray : outline->rays) {
      const Vector3d normal = ray.ray_world.cross(middle.direction_world).normalized();
      const double distance_m = SignedDistance(middle, ray);
      const Vector3d J(normal.dot(first), normal.dot(second), distance_m < 0 ? -1 : 1);
      const double weight = 1 / (ray.sigma_m * ray.sigma_m);
      H += weight * J * J.transpose();
      g += weight * distance_m * J;
    }
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(H);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
  const Vector3d x = solver.solve(g);
  if (!x.allFinite()) return std::nullopt;
  return Cylinder{{middle.point_world + x[0] * first + x[1] * second, middle.direction_world},
                  x[2]};
}

// Along the axis, from its point.
std::pair<double, double> FindInterval(const PointAndDirection& axis, const Outline& outline) {
  const double middle_m = axis.direction_world.dot(outline.line.point_world - axis.point_world);
  return {middle_m - outline.half_m, middle_m + outline.half_m};
}

double DistanceAcross(const PointAndDirection& axis, const Vector3d& p) {
  return (p - axis.point_world).cross(axis.direction_world).norm();
}

class Finder {
 public:
  Finder(const std::vector<Outline>& outlines, const PipeOptions& options)
      : outlines_(outlines), options_(options) {}

  std::optional<PipeCandidate> Try(size_t a, size_t b) const {
    const auto middle = Between(outlines_[a], outlines_[b], options_);
    if (!middle) return std::nullopt;
    const auto start = FitCylinder(*middle, outlines_[a], outlines_[b]);
    if (!start || !HasSize(*start) || !PassOutside(*start, a) || !PassOutside(*start, b) ||
        !IsSeenWide(*start, a) || !IsSeenWide(*start, b) ||
        DistanceAcross(start->axis, middle->point_world) > kMaxShift * start->radius_m) {
      return std::nullopt;
    }
    PipeCandidate candidate;
    candidate.outlines = {a, b};
    if (!Fit(*start, &candidate)) return std::nullopt;
    for (int round = 0; round < kRounds; ++round) {
      if (!Grow(&candidate)) break;
    }
    return candidate;
  }

 private:
  bool HasSize(const Cylinder& cylinder) const {
    return cylinder.radius_m >= options_.min_radius_m && cylinder.radius_m <= options_.max_radius_m;
  }

  // Thin ones are told by their widths alone: some image has to show one.
  bool IsSeenWide(const Cylinder& cylinder, size_t outline) const {
    const auto shows_width = [&](const TangentRay& ray) {
      const double pixel_m = std::sqrt(
          std::max(0.0, ray.sigma_m * ray.sigma_m - options_.pose_sigma_m * options_.pose_sigma_m));
      return 2 * cylinder.radius_m * options_.sigma_px >= kLeastPipeWidth_px * pixel_m;
    };
    return cylinder.radius_m >= options_.min_outlined_radius_m ||
           std::ranges::any_of(outlines_[outline].rays, shows_width);
  }

  std::vector<TangentRay> CollectRays(const std::vector<size_t>& some) const {
    std::vector<TangentRay> rays;
    for (const size_t i : some) {
      rays.insert(rays.end(), outlines_[i].rays.begin(), outlines_[i].rays.end());
    }
    return rays;
  }

  // The rays of an outline pass the axis at about the radius: two lines that most views see one
  // behind the other are none of one pipe.
  bool PassOutside(const Cylinder& start, size_t outline) const {
    const std::vector<TangentRay>& rays = outlines_[outline].rays;
    const auto passes = [&](const TangentRay& ray) {
      return std::abs(SignedDistance(start.axis, ray)) > 0.5 * start.radius_m;
    };
    return static_cast<double>(std::count_if(rays.begin(), rays.end(), passes)) >=
           options_.min_touching * static_cast<double>(rays.size());
  }

  bool Fit(const Cylinder& start, PipeCandidate* candidate) const {
    const auto fit = FitPipe(start, CollectRays(candidate->outlines), options_.fit);
    if (!fit || !HasSize(fit->cylinder)) return false;
    for (const size_t i : candidate->outlines) {
      if (TouchingShare(fit->cylinder, outlines_[i], options_) < options_.min_touching)
        return false;
    }
    candidate->fit = *fit;
    candidate->from_m = 1e9, candidate->to_m = -1e9;
    for (const size_t i : candidate->outlines) {
      const auto [from_m, to_m] = FindInterval(fit->cylinder.axis, outlines_[i]);
      candidate->from_m = std::min(candidate->from_m, from_m);
      candidate->to_m = std::max(candidate->to_m, to_m);
    }
    return true;
  }

  bool BoundsPipe(const PipeCandidate& candidate, const Outline& outline) const {
    const Cylinder& cylinder = candidate.fit.cylinder;
    const double cosine = outline.line.direction_world.dot(cylinder.axis.direction_world);
    if (std::abs(cosine) < std::cos(options_.max_turn_rad)) return false;
    // A line that views on both sides of it have for one is somewhat outside.
    const double across_m = DistanceAcross(cylinder.axis, outline.line.point_world);
    const double most_m = 0.5 * cylinder.radius_m + 0.01 + 2 * outline.sigma_m;
    if (std::abs(across_m - cylinder.radius_m) > most_m) return false;
    const auto [from_m, to_m] = FindInterval(cylinder.axis, outline);
    if (from_m > candidate.to_m + kBeyond_m || to_m < candidate.from_m - kBeyond_m) return false;
    return TouchingShare(cylinder, outline, options_) >= options_.min_touching;
  }

  // Whether others were found.
  bool Grow(PipeCandidate* candidate) const {
    PipeCandidate grown = *candidate;
    for (size_t i = 0; i < outlines_.size(); ++i) {
      const bool has = std::find(candidate->outlines.begin(), candidate->outlines.end(), i) !=
                       candidate->outlines.end();
      if (!has && BoundsPipe(*candidate, outlines_[i])) grown.outlines.push_back(i);
    }
    if (grown.outlines.size() == candidate->outlines.size() ||
        !Fit(candidate->fit.cylinder, &grown)) {
      return false;
    }
    *candidate = grown;
    return true;
  }

  const std::vector<Outline>& outlines_;
  const PipeOptions& options_;
};

}  // namespace

std::vector<PipeCandidate> PipeCandidates(const std::vector<Outline>& outlines,
                                          const PipeOptions& options, const Progress& progress) {
  const Finder finder(outlines, options);
  std::vector<std::vector<PipeCandidate>> found(outlines.size());
  ForEachWatched(outlines.size(), progress, [&](size_t a) {
    for (size_t b = a + 1; b < outlines.size(); ++b) {
      if (auto candidate = finder.Try(a, b)) found[a].push_back(std::move(*candidate));
    }
  });
  // Two of the lines of one pipe, and others of them, may grow to the same; its radius tells, in
  // millimetres, where they do not.
  std::vector<PipeCandidate> candidates;
  std::set<std::pair<std::vector<size_t>, long>> known;
  for (auto& of_first : found) {
    for (PipeCandidate& candidate : of_first) {
      std::vector<size_t> lines = candidate.outlines;
      std::ranges::sort(lines);
      const long radius_mm = std::lround(1000 * candidate.fit.cylinder.radius_m);
      if (known.emplace(std::move(lines), radius_mm).second) {
        candidates.push_back(std::move(candidate));
      }
    }
  }
  return candidates;
}

double TouchingShare(const Cylinder& cylinder, const Outline& outline, const PipeOptions& options) {
  const auto touches = [&](const TangentRay& ray) {
    return std::abs(OffTangent(cylinder, ray)) <= options.max_off_sigmas * ray.sigma_m;
  };
  return static_cast<double>(std::ranges::count_if(outline.rays, touches)) /
         static_cast<double>(outline.rays.size());
}

}  // namespace slcmap::mapping
