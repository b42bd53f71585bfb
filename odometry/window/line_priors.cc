#include "odometry/window/line_priors.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "odometry/window/line_landmarks.h"
#include "odometry/window/line_triangulation.h"

namespace slcmap::inline odometry {

using Eigen::Vector3d;

namespace {

// The one that lines around there share, made where there is none.
SharedDeviation* SharedBy(const LineLandmark& line, double max_distance_m, WindowState* window) {
  const Vector3d p_world = line.InWorld().point_world;
  for (SharedDeviation& shared : window->shared_deviations) {
    if (shared.axis == line.axis && shared.heading == line.heading &&
        (shared.p_world - p_world).norm() < max_distance_m) {
      return &shared;
    }
  }
  return &window->shared_deviations.emplace_back(
      SharedDeviation{line.axis, line.heading, p_world, {}, 0});
}

// Those that no line has but those of `gone`.
std::unordered_set<const SharedDeviation*> SharedByNone(const std::unordered_set<int64_t>& gone,
                                                        const WindowState& window) {
  std::unordered_set<const SharedDeviation*> unused;
  for (const SharedDeviation& shared : window.shared_deviations) unused.insert(&shared);
  for (const auto& [id, line] : window.lines) {
    if (!gone.contains(id)) unused.erase(line.shared);
  }
  return unused;
}

}  // namespace

bool IsOffAxis(const LineLandmark& line, double max_deviation_rad) {
  if (!line.MayDeviate()) return false;
  const Vector3d direction = line.InWorld().direction_world;
  return (line.AcrossAxisInWorld().transpose() * direction).norm() > max_deviation_rad;
}

void AddDirectionPriors(const LineDeviations& deviations, WindowState* window) {
  for (auto& [id, line] : window->lines) {
    if (line.retired || !line.estimated || !line.MayDeviate()) continue;
    const BuildingDeviation& deviation = deviations.Of(line.axis);
    line.deviation_sigma_rad = deviation.OfLine(id);
    if (deviation.IsShared() && !line.shared) {
      line.shared = SharedBy(line, deviation.shared_radius_m(), window);
    }
  }
  for (SharedDeviation& shared : window->shared_deviations) {
    shared.sigma_rad = deviations.Of(shared.axis).shared_sigma_rad();
  }
}

void ReleaseShared(const std::unordered_set<int64_t>& gone, WindowState* window,
                   std::vector<Term>* terms, std::vector<double*>* dropped) {
  const auto unused = SharedByNone(gone, *window);
  for (SharedDeviation& shared : window->shared_deviations) {
    if (!unused.contains(&shared)) continue;
    AddSharedDeviationTerm(&shared, terms);
    dropped->push_back(shared.off_rad.data());
  }
}

void RemoveShared(WindowState* window) {
  const auto unused = SharedByNone({}, *window);
  window->shared_deviations.remove_if(
      [&](const SharedDeviation& shared) { return unused.contains(&shared); });
}

std::unordered_set<int64_t> FinishPieces(const LineDeviations& deviations, const CostModel& model,
                                         WindowState* window) {
  std::unordered_set<int64_t> finished;
  const Vector3d eye_world =
      window->frames.back()->T_world_imu() * model.geometry.T_imu_camera[0].translation;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || line.finished || line.IsExact()) continue;
    if (line.slope) continue;  // rails and rafters do not bend as walls do
    const Vector3d from_first = eye_world - line.anchor_world;
    const double moved_m = std::abs(line.InWorld().direction_world.dot(from_first));
    if (moved_m <= deviations.Of(line.axis).max_piece_m()) continue;
    line.finished = true;
    finished.insert(id);
  }
  return finished;
}

namespace {

// A membership that is given up needlessly costs next to nothing, one that is wrong bends the line.
constexpr double kMaxChi2 = 6.0;  // of two dimensions: 95 %
constexpr size_t kMinViews = 3;   // fewer may agree on a place by chance

}  // namespace

bool IsAtRest(const PointPlace& place) {
  return place.chi2 <= place.freedoms + 3 * std::sqrt(2.0 * place.freedoms);
}

Membership JudgeMembership(const LineLandmarkOptions& options, const PointLandmark& point,
                           const LineLandmark& line, const CostModel& model, const Prior& prior) {
  using Eigen::Matrix2d;
  if (point.frames.size() < kMinViews) return Membership::kOpen;
  const std::optional<PointPlace> place = PlaceByObservations(point, model);
  if (!place) return Membership::kOpen;
  if (!IsAtRest(*place)) return Membership::kRefuted;
  const Matrix32d across = line.AcrossAxisInWorld();
  const Eigen::Vector2d off =
      across.transpose() * (place->p_world - NearestOn(line.InWorld(), place->p_world));
  const Eigen::Matrix3d in_world =
      place->covariance_m2 + ConditionalCovarianceAcross(line, place->p_world, model, prior);
  const Matrix2d known = across.transpose() * in_world * across;
  const Matrix2d scatter = options.point_sigma_m * options.point_sigma_m * Matrix2d::Identity();
  if (!(off.dot((known + scatter).ldlt().solve(off)) <= kMaxChi2)) return Membership::kRefuted;
  const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(known, Eigen::EigenvaluesOnly);
  const double limit_m2 = options.max_member_sigma_m * options.max_member_sigma_m;
  return eigen.eigenvalues()[1] <= limit_m2 ? Membership::kHolds : Membership::kOpen;
}

std::unordered_set<int64_t> UpdateMembers(const LineLandmarkOptions& options,
                                          const CostModel& model, PointsOnLines* memberships,
                                          WindowState* window) {
  std::unordered_set<int64_t> misplaced;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !line.IsStructural()) continue;
    const std::vector<int64_t> before = std::exchange(line.points, {});
    for (const int64_t point_id : memberships->CollectPoints(id)) {
      const auto it = window->landmarks.find(point_id);
      const bool in_window = it != window->landmarks.end() && it->second.triangulated;
      Membership judged = Membership::kOpen;
      if (in_window) {
        judged = JudgeMembership(options, it->second, line, model, window->prior);
      } else if (std::find(before.begin(), before.end(), point_id) != before.end()) {
        judged = Membership::kHolds;
      }
      if (judged == Membership::kHolds) line.points.push_back(point_id);
      if (judged != Membership::kRefuted) continue;
      memberships->Release({point_id, id});
      if (line.placed_by == point_id) misplaced.insert(id);
    }
  }
  return misplaced;
}

void MergeMembers(int64_t line_id, int64_t into_line_id, PointsOnLines* memberships,
                  WindowState* window) {
  memberships->MergeLine(line_id, into_line_id);
  const std::vector<int64_t> verified = memberships->CollectPoints(into_line_id);  // sorted
  std::erase_if(window->lines.at(into_line_id).points, [&](int64_t id) {
    return !std::binary_search(verified.begin(), verified.end(), id);
  });
}

void RemoveMembers(const std::unordered_set<int64_t>& point_ids, PointsOnLines* memberships,
                   WindowState* window) {
  for (const int64_t id : point_ids) memberships->ReleasePoint(id);
  for (auto& [line_id, line] : window->lines) {
    std::erase_if(line.points, [&](int64_t id) { return point_ids.contains(id); });
  }
}

namespace {

using Eigen::Vector3d;

std::optional<FittedLine> FitFreeLine(const LineLandmarkOptions& options, const CostModel& model,
                                      LineLandmark line) {
  if (!line.estimated && !options.anchor_at_origin) {
    line.anchor_world =
        WorldFromCamera(*line.frames.front(), model.geometry, line.camera).translation;
  }
  const auto fit = TriangulateGeneralLine(CollectObservations(line), line.anchor_world,
                                          model.Corrected(model.lines), options.triangulation);
  if (!fit) return std::nullopt;
  line.block = fit->block;
  if (!FitsItsObservations(line, options.max_new_chi2, model)) return std::nullopt;
  const PointAndDirection in_world = line.InWorld();
  LineExtent extent;
  for (const FrameState* frame : line.frames) {
    const StereoLineMeasurement& seen = frame->lines.at(line.id);
    const auto along =
        ExtentAlong(in_world, seen.left, WorldFromCamera(*frame, model.geometry, seen.camera));
    if (along) extent.Add(along->first, along->second);
  }
  if (extent.empty()) return std::nullopt;
  FittedLine out;
  out.anchor_world = line.anchor_world;
  out.block = fit->block;
  out.line.id = line.id;
  out.line.direction_world = in_world.direction_world;
  out.line.direction_covariance_rad2 = fit->direction_covariance;
  out.line.middle_world =
      in_world.point_world + 0.5 * (extent.from_m() + extent.to_m()) * in_world.direction_world;
  out.line.length_m = extent.to_m() - extent.from_m();
  return out;
}

// The slope that a line follows; nothing where it follows none.
SlopeState* SlopeOfLine(const FreeLine& line, double deviation_rad, WindowState* window) {
  SlopeState* best = nullptr;
  double least = kMaxSigmasToDirection * kMaxSigmasToDirection;
  for (SlopeState& slope : window->slopes) {
    if (slope.withdrawn) continue;
    const auto off = SquaredSigmasOff(line, slope.angles_rad, deviation_rad);
    if (!off || *off > least) continue;
    best = &slope;
    least = *off;
  }
  return best;
}

// Lines of a slope all run up it: lines that are the same edge have to point the same way.
GeneralLineBlock UpwardBlock(const FittedLine& fit) {
  const PointAndDirection in_world = GeneralLineFromBlock(fit.anchor_world, fit.block.data());
  const double sign = in_world.direction_world.z() < 0 ? -1 : 1;
  return GeneralLineThrough(fit.anchor_world, in_world.point_world,
                            sign * in_world.direction_world);
}

}  // namespace

std::vector<FittedLine> FitFreeLines(const LineLandmarkOptions& options, const FrameState& frame,
                                     const CostModel& model, const WindowState& window) {
  std::vector<FittedLine> fits;
  for (const auto& [id, line] : window.lines) {
    if (line.retired || line.IsStructural() || !frame.lines.contains(id)) continue;
    if (static_cast<int>(line.frames.size()) < kLandmarkMinGeneralKeyframes) continue;
    if (auto fit = FitFreeLine(options, model, line)) fits.push_back(std::move(*fit));
  }
  return fits;
}

std::vector<FreeLine> FollowSlopes(const std::vector<Vector3d>& axes_world,
                                   const std::vector<FittedLine>& fits,
                                   const LineDeviations& deviations, WindowState* window) {
  std::vector<FreeLine> others;
  for (const FittedLine& fit : fits) {
    SlopeState* slope = nullptr;
    if (MaySlope(fit.line, axes_world, {})) {
      slope = SlopeOfLine(fit.line, kSlopeSearchSigma_rad, window);
    }
    if (!slope) {
      others.push_back(fit.line);
      continue;
    }
    LineLandmark& line = window->lines.at(fit.line.id);
    line.axis = LineAxis::kSloped;
    line.slope = slope;
    line.placed_by.reset();
    line.deviation_sigma_rad = deviations.Of(line.axis).OfLine(line.id);
    if (line.estimated) continue;
    line.anchor_world = fit.anchor_world;
    line.block = UpwardBlock(fit);
    line.estimated = true;
  }
  return others;
}

std::unordered_set<int64_t> RejectLinesOffSlope(const LineDeviations& deviations,
                                                WindowState* window) {
  const double max_deviation_rad = deviations.Of(LineAxis::kSloped).max_deviation_rad();
  std::unordered_set<int64_t> outliers;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !line.slope) continue;
    if (!IsOffAxis(line, max_deviation_rad)) continue;
    ++line.slope->lines_given_up;
    outliers.insert(id);
    Retire(&line);
  }
  return outliers;
}

std::unordered_set<int64_t> RejectSlopes(WindowState* window) {
  const auto name = [](const SlopeState& slope) {
    return fmt::format("slope {}, {:.2f} degrees", slope.index, slope.angles_rad[1] * 180 / M_PI);
  };
  return RejectFollowed(kMinGivenUpOfSlope, &LineLandmark::slope, &window->slopes, name, window);
}

std::vector<SlopeBlock> CollectSlopes(const WindowState& window) {
  std::vector<SlopeBlock> slopes;
  for (const SlopeState& slope : window.slopes) slopes.push_back(slope.angles_rad);
  return slopes;
}

}  // namespace slcmap::odometry
