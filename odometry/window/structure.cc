#include "odometry/window/structure.h"

#include <spdlog/spdlog.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "odometry/geometry/pinhole.h"
#include "odometry/window/landmark_information.h"
#include "odometry/window/line_priors.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Vector3d;

// With structural and slc, lines of no axis are estimated too where lines are further off the
// axes that they follow: in an exact building what follows no axis is clutter, in a crooked one
// most of its edges.
constexpr double kGeneralAbove_rad = 0.0035;
constexpr int kMaxUnseen = 20;  // lines that are kept though the window sees them no longer

LineKinds CollectKinds(const EstimatorOptions& options) {
  return {UsesStructure(options.method), options.method == Method::kPointsLines};
}

// However well: whoever reads the run chooses. A line is estimated from observations that may all
// have been rejected since; then nothing is known of how far it reaches.
bool IsKnown(const LineLandmark& line) {
  return line.estimated && !line.retired && !line.extent.empty();
}

// The standard deviation is that across which the direction is known least: of lines seen from one
// side, that is towards the camera, and the angle alone would hide it.
void DescribeDeviation(const LineLandmark& line, const WindowCovariance& covariance, Line* out) {
  if (!line.MayDeviate()) return;
  const Vector3d axis = line.AxisInWorld();
  out->deviation_rad = std::asin(std::min(1.0, axis.cross(line.InWorld().direction_world).norm()));
  out->deviation_sigma_rad = kUnknownSigma_rad;
  const auto deviation = DeviationFromAxis(line, covariance);
  if (!deviation) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(deviation->covariance_rad2,
                                                              Eigen::EigenvaluesOnly);
  const double variance_rad2 = solver.eigenvalues()[1];
  if (variance_rad2 > 0) out->deviation_sigma_rad = std::sqrt(variance_rad2);
}

// Adds a line of a segment whose headings and slopes the run does not hold yet.
void Report(Line line, int segment, OdometryRun* run) {
  line.segment = segment;
  const size_t before =
      line.axis == LineAxis::kSloped ? run->sloped_directions.size() : run->manhattan_worlds.size();
  if (line.world >= 0) line.world += static_cast<int>(before);
  run->lines.push_back(std::move(line));
}

SlopedDirection DescribeSlope(const SlopeState& slope, int segment,
                              const WindowCovariance& covariance) {
  SlopedDirection out;
  out.segment = segment;
  out.azimuth_rad = slope.angles_rad[0];
  out.elevation_rad = slope.angles_rad[1];
  out.azimuth_sigma_rad = out.elevation_sigma_rad = slope.found_sigma_rad;
  const double* block = slope.angles_rad.data();
  if (covariance.Knows(block)) {
    const Eigen::Vector2d variance_rad2 = covariance.Of({block}).diagonal();
    out.azimuth_sigma_rad = std::sqrt(std::max(0.0, variance_rad2[0]));
    out.elevation_sigma_rad = std::sqrt(std::max(0.0, variance_rad2[1]));
  }
  out.found_at_ns = slope.found_at_ns;
  out.withdrawn = slope.withdrawn;
  return out;
}

// Those of which no other one sees the same.
std::set<int> LoneCameras(const Rig& rig) {
  std::set<int> lone;
  for (const auto& [camera, is_pair] : CameraGroups(rig)) {
    if (!is_pair) lone.insert(camera);
  }
  return lone;
}

}  // namespace

Structure::Structure(const EstimatorOptions& options, const Rig& rectified_rig)
    : options_(options.line_landmarks),
      finds_slopes_(options.slopes.enabled),
      kinds_(CollectKinds(options)),
      points_on_lines_(options.method == Method::kSlc),
      rig_(rectified_rig),
      classifier_(rectified_rig.cameras[0].fx_px),
      detector_(options.manhattan, rectified_rig.cameras[0].fx_px),
      memberships_(LoneCameras(rectified_rig)),
      deviations_(options.building_deviation) {}

void Structure::Update(const CostModel& model, FrameState* newest, WindowState* window) {
  if (newest->lines.empty()) return;
  RejectLineMisfits(options_, model, newest, window);
  for (const auto& [camera, is_pair] : CameraGroups(rig_)) {
    if (kinds_.structural) FindHeadings(camera, *newest, model, window);
  }
  if (points_on_lines_) FindPointsOnLines(*newest);
  EstimateLines(options_, KindsNow(), classifier_, memberships_, deviations_, model, window);
  if (kinds_.structural && finds_slopes_) FindSlopes(*newest, model, window);
  if (points_on_lines_) {
    const auto misplaced = UpdateMembers(options_, model, &memberships_, window);
    misplaced_ = RetireMisplaced(options_, misplaced, model, window);
  }
  AddDirectionPriors(deviations_, window);
}

LineKinds Structure::KindsNow() const {
  LineKinds kinds = kinds_;
  const double deviation_rad = deviations_.Of(LineAxis::kX).sigma_rad();
  if (kinds.structural) kinds.general = deviation_rad > kGeneralAbove_rad;
  return kinds;
}

// Those that were given up because they are off their axis count too: it may be the building that
// is.
void Structure::LearnDeviation(const WindowState& window, const WindowCovariance& covariance,
                               const std::unordered_set<int64_t>& gone) {
  for (const auto& [id, line] : window.lines) {
    if (!line.estimated || !line.MayDeviate()) continue;
    BuildingDeviation& building = deviations_.Of(line.axis);
    if (!IsKnown(line) && !IsOffAxis(line, building.max_deviation_rad())) continue;
    const auto deviation = DeviationFromAxis(line, covariance);
    if (deviation) building.Add(id, *deviation, line.deviation_sigma_rad);
  }
  deviations_.Close(gone);
  deviations_.Solve();
}

void Structure::FindHeadings(int camera, const FrameState& newest, const CostModel& model,
                             WindowState* window) {
  std::vector<LineSegment> segments;
  for (const auto& [id, measurement] : newest.lines) {
    if (measurement.camera == camera) segments.push_back(measurement.left);
  }
  std::vector<double> known_rad;  // withdrawn ones too, or they would be found again at once
  for (const HeadingState& heading : window->headings) {
    known_rad.push_back(heading.heading_rad[0]);
  }
  detector_.SetKnownHeadings(known_rad);
  std::vector<Vector3d> slopes_world;
  for (const SlopeState& slope : window->slopes) {
    if (!slope.withdrawn) slopes_world.push_back(SlopeDirection(slope.angles_rad.data()));
  }
  detector_.SetKnownSlopes(slopes_world);
  const Eigen::Quaterniond R_world_camera =
      newest.T_world_imu().rotation * model.geometry.T_imu_camera[camera].rotation;
  for (const HeadingEvidence& found :
       detector_.AddImage(segments, R_world_camera.toRotationMatrix())) {
    HeadingState& heading = window->headings.emplace_back();
    heading.world = static_cast<int>(window->headings.size()) - 1;
    heading.heading_rad[0] = found.heading_rad;
    heading.found_sigma_rad = found.sigma_rad;
    heading.found_at_ns = newest.stamp_ns;
    spdlog::info("found Manhattan world {}, heading {:.2f} degrees", heading.world,
                 found.heading_rad * 180 / M_PI);
  }
}

void Structure::FindSlopes(const FrameState& newest, const CostModel& model, WindowState* window) {
  std::vector<Vector3d> axes_world;
  for (const StructuralDirection& axis : StructuralDirections(CollectHeadings(*window))) {
    axes_world.push_back(axis.d_world);
  }
  const std::vector<FittedLine> fits = FitFreeLines(options_, newest, model, *window);
  const std::vector<FreeLine> others = FollowSlopes(axes_world, fits, deviations_, window);
  const auto found = slope_detector_.AddKeyframe(others, axes_world, CollectSlopes(*window));
  if (!found) return;
  SlopeState& slope = window->slopes.emplace_back();
  slope.index = static_cast<int>(window->slopes.size()) - 1;
  slope.angles_rad = found->angles_rad;
  slope.found_sigma_rad = found->sigma_rad;
  slope.found_at_ns = newest.stamp_ns;
  spdlog::info("found slope {}, {:.2f} degrees towards {:.2f} degrees: {} lines of {} objects",
               slope.index, slope.angles_rad[1] * 180 / M_PI, slope.angles_rad[0] * 180 / M_PI,
               found->lines, found->objects);
  FollowSlopes(axes_world, fits, deviations_, window);
}

void Structure::FindPointsOnLines(const FrameState& newest) {
  const Camera& camera = rig_.cameras[0];
  std::vector<PointObservation> points;
  for (const auto& [id, m] : newest.measurements) {
    points.push_back({id, PixelFromPlane(camera, m.left), std::nullopt, m.camera});
    if (m.right) points.back().right_px = PixelFromPlane(camera, *m.right);
  }
  memberships_.AddKeyframe(points, LinesInPixels(newest, camera));
}

std::unordered_set<int64_t> Structure::Judge(const CostModel& model, const FrameState& newest,
                                             WindowState* window) {
  std::unordered_set<int64_t> gone = RejectLineOutliers(options_, deviations_, model, window);
  gone.merge(RejectLinesOffSlope(deviations_, window));
  for (const int64_t id : gone) {
    if (HeadingState* heading = window->lines.at(id).heading) ++heading->lines_given_up;
  }
  gone.merge(RejectHeadings(window));
  gone.merge(RejectSlopes(window));
  gone.merge(std::exchange(misplaced_, {}));
  ExtendLines(newest, model, window);
  for (const int64_t id : gone) memberships_.ReleaseLine(id);
  // These keep their points until the window has forgotten them.
  if (!options_.anchor_at_origin) {
    gone.merge(FinishPieces(deviations_, model, window));
  }
  for (const auto& [id, older_id] : MergeLines(model, window)) {
    MergeMembers(id, older_id, &memberships_, window);
    merges_.emplace(id, older_id);
    covariance_as_left_m2_.erase(older_id);  // was counted from another keyframe
    gone.insert(id);
  }
  return gone;
}

// Lines that are retired, that no frame of the window sees and that were never estimated, and of
// the other unseen ones those that were seen longest ago.
std::unordered_set<int64_t> Structure::LinesToRemove(const WindowState& window) const {
  std::unordered_set<int64_t> forgotten;
  std::vector<std::pair<int64_t, int64_t>> unseen;  // last frame that saw it, id
  for (const auto& [id, line] : window.lines) {
    if (line.retired || (line.frames.empty() && (!line.estimated || line.finished))) {
      forgotten.insert(id);
    } else if (line.frames.empty()) {
      unseen.emplace_back(line.last_seen_frame(), id);
    }
  }
  std::sort(unseen.rbegin(), unseen.rend());
  for (size_t i = kMaxUnseen; i < unseen.size(); ++i) forgotten.insert(unseen[i].second);
  return forgotten;
}

std::unordered_set<int64_t> Structure::ReleaseOldest(const CostModel& model,
                                                     const WindowCovariance& covariance,
                                                     WindowState* window, std::vector<Term>* terms,
                                                     std::vector<double*>* dropped) {
  FrameState* oldest = window->frames.front().get();
  for (auto& [id, line] : window->lines) {
    if (line.frames.empty() || line.frames.front() != oldest) continue;
    if (line.estimated) AddLineTerm(&line, oldest, model, terms);
    if (line.estimated && line.frames.size() == 1) {
      const auto covariance_m2 = CovarianceAcross(line, ComputeMiddle(line), *oldest, covariance);
      covariance_as_left_m2_.erase(id);
      if (covariance_m2) covariance_as_left_m2_[id] = *covariance_m2;
    }
    line.frames.erase(line.frames.begin());
    line.released_frames.push_back(oldest->id);
  }
  const std::unordered_set<int64_t> gone = LinesToRemove(*window);
  for (auto& [id, line] : window->lines) {
    if (!gone.contains(id)) continue;
    if (line.estimated) {
      dropped->push_back(line.block.data());
      if (!line.retired && line.MayDeviate()) AddAlongAxisTerm(&line, model, terms);
    }
    if (IsKnown(line)) {
      left_lines_.push_back(DescribeLine(line, *window, covariance));
      if (line.heading) ++line.heading->lines_kept;
      if (line.slope) ++line.slope->lines_kept;
    }
    memberships_.ReleaseLine(id);
    covariance_as_left_m2_.erase(id);
  }
  ReleaseShared(gone, window, terms, dropped);
  LearnDeviation(*window, covariance, gone);
  return gone;
}

// The covariance is counted from the last keyframe that saw the line. Where that left the window
// before it was known to be the last one, it is counted from the oldest of the window.
Line Structure::DescribeLine(const LineLandmark& line, const WindowState& window,
                             const WindowCovariance& covariance) const {
  constexpr double kUnknown_m2 = kUnknownSigma_m * kUnknownSigma_m;
  Line out = Describe(line);
  DescribeDeviation(line, covariance, &out);
  const auto left = covariance_as_left_m2_.find(line.id);
  if (line.frames.empty() && left != covariance_as_left_m2_.end()) {
    out.covariance_m2 = left->second;
    return out;
  }
  const FrameState& from = line.frames.empty() ? *window.frames.front() : *line.frames.back();
  const auto covariance_m2 = CovarianceAcross(line, ComputeMiddle(line), from, covariance);
  const bool known = covariance_m2 && covariance_m2->allFinite();
  out.covariance_m2 =
      known ? *covariance_m2 : Eigen::Matrix3d(kUnknown_m2 * Eigen::Matrix3d::Identity());
  return out;
}

void Structure::Collect(int segment, OdometryRun* run) {
  for (Line& line : left_lines_) Report(std::move(line), segment, run);
  left_lines_.clear();
  run->line_merges.merge(merges_);
  merges_.clear();
}

void Structure::AddContents(int segment, const WindowState& window,
                            const WindowCovariance& covariance, OdometryRun* run) const {
  for (const auto& [id, line] : window.lines) {
    if (IsKnown(line)) Report(DescribeLine(line, window, covariance), segment, run);
  }
  run->line_merges.insert(merges_.begin(), merges_.end());
  if (kinds_.structural) run->line_deviation_rad = deviations_.Of(LineAxis::kX).sigma_rad();
  for (const HeadingState& heading : window.headings) {
    ManhattanWorld world;
    world.segment = segment;
    world.heading_rad = heading.heading_rad[0];
    world.sigma_rad = heading.found_sigma_rad;
    world.found_at_ns = heading.found_at_ns;
    world.withdrawn = heading.withdrawn;
    run->manhattan_worlds.push_back(world);
  }
  for (const SlopeState& slope : window.slopes) {
    run->sloped_directions.push_back(DescribeSlope(slope, segment, covariance));
  }
}

void Structure::Reset() {
  detector_.Reset();
  slope_detector_.Reset();
  misplaced_.clear();
  memberships_ = PointsOnLines(LoneCameras(rig_));
  covariance_as_left_m2_.clear();
  merges_.clear();  // Restart() has collected those of a window that was not thrown away
}

}  // namespace slcmap::odometry
