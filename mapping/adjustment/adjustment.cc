#include "mapping/adjustment/adjustment.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "data/check/report.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "mapping/adjustment/adjustment_problem.h"
#include "mapping/adjustment/closure.h"
#include "mapping/adjustment/closure_terms.h"
#include "odometry/factors/calibration_estimate.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr double kMaxLineChi2 = 16;

constexpr size_t kMinKeyframes = 3;
constexpr char kDiverged[] = "the adjustment diverged";
constexpr double kFirstGraduation = 8;  // of the closures' loss
// Share of the cost that a step lowers it by where a round ends: a drift that is slow to settle
// costs little. Rounds that another follows need less: to find visits, to see which closures pull
// where, and the first, whose cost is that of what does not fit, to tell what that is.
constexpr double kSettled = 1e-5, kNearlySettled = 1e-4, kRoughlySettled = 1e-2;

// Takes out the observations that do not fit. The right camera's go alone where it is they.
void RejectPointOutliers(const AdjustmentModel& model, AdjustmentState* state,
                         AdjustmentFigures* figures) {
  for (AdjustedPoint& point : state->points) {
    std::erase_if(point.observations, [&](AdjustedPointObservation& observation) {
      const AdjustmentTerm term = PointTerm(point, observation, *state, model);
      const double left = Chi2OfLeft(term);
      if (left > kMaxPointChi2) return true;
      if (Chi2(term) - left > kMaxPointChi2) {
        observation.measurement.right.reset();
        ++figures->rejected_point_observations;
      }
      return false;
    });
    if (std::ssize(point.observations) < kAdjustmentMinPointKeyframes) point.observations.clear();
  }
}

void RejectLineOutliers(const AdjustmentModel& model, AdjustmentState* state) {
  for (AdjustedLine& line : state->lines) {
    std::erase_if(line.observations, [&](AdjustedLineObservation& observation) {
      const AdjustmentTerm term = LineTerm(line, observation, 1, *state, model);
      const double left = Chi2OfLeft(term);
      if (left > kMaxLineChi2) return true;
      if (Chi2(term) - left > kMaxLineChi2) observation.measurement.right.reset();
      return false;
    });
  }
}

// The standard deviation of two rows by the median of their squares, whatever is wrong with a third
// of them; 1 as claimed.
double ComputeScatter(std::vector<double> chi2) {
  constexpr double kMedian = 1.386;  // of two rows of variance 1
  std::erase_if(chi2, [](double value) { return !std::isfinite(value); });
  return chi2.empty() ? 1 : std::sqrt(Quantile(std::move(chi2), 0.5) / kMedian);
}

template <typename Landmarks>
std::pair<int64_t, int64_t> CountWithObservations(const Landmarks& landmarks) {
  int64_t with = 0, observations = 0;
  for (const auto& landmark : landmarks) {
    with += !landmark.observations.empty();
    observations += std::ssize(landmark.observations);
  }
  return {with, observations};
}

void Count(const AdjustmentState& state, AdjustmentFigures* figures) {
  figures->keyframes = std::ssize(state.frames);
  std::tie(figures->points, figures->point_observations) = CountWithObservations(state.points);
  std::tie(figures->lines, figures->line_observations) = CountWithObservations(state.lines);
}

// How each keyframe moved: where those landmarks go that the adjustment knows nothing of.
std::vector<RigidTransform> ComputeCorrections(const AdjustmentState& state) {
  std::vector<RigidTransform> corrections;
  for (const AdjustedFrame& frame : state.frames) {
    corrections.push_back(PoseFromBlock(frame.pose) * frame.keyframe->T_world_imu.Inverse());
  }
  return corrections;
}

void MoveLandmarks(const AdjustmentState& state, OdometryRun* run) {
  const std::vector<RigidTransform> corrections = ComputeCorrections(state);
  std::map<int64_t, size_t> last_seen;
  for (size_t k = 0; k < run->keyframes.size(); ++k) {
    for (const auto& seen : run->keyframes[k].observations) last_seen[seen.landmark_id] = k;
  }
  std::map<int64_t, Vector3d> adjusted;
  for (const AdjustedPoint& point : state.points) {
    if (point.observations.empty() || !(point.block[2] > 0)) continue;
    adjusted[point.landmark->id] = PointInWorld(point, state);
  }
  for (Landmark& landmark : run->landmarks) {
    const auto known = adjusted.find(landmark.id);
    const auto seen = last_seen.find(landmark.id);
    if (known != adjusted.end()) {
      landmark.p_world = known->second;
    } else if (seen != last_seen.end()) {
      landmark.p_world = corrections[seen->second] * landmark.p_world;
    }
  }
}

// Ends stay where they were along the line.
void LayOnto(const AdjustedLine& adjusted, Line* line) {
  const PointAndDirection in_world = adjusted.InWorld();
  line->start_world = NearestOn(in_world, line->start_world);
  line->end_world = NearestOn(in_world, line->end_world);
}

void MoveLines(const AdjustmentState& state, OdometryRun* run) {
  const std::vector<RigidTransform> corrections = ComputeCorrections(state);
  std::map<int64_t, size_t> index_of;
  for (size_t k = 0; k < run->keyframes.size(); ++k) index_of[run->keyframes[k].id] = k;
  std::map<int64_t, const AdjustedLine*> adjusted;
  for (const AdjustedLine& line : state.lines) {
    if (!line.observations.empty()) adjusted[line.line->id] = &line;
  }
  for (Line& line : run->lines) {
    const auto seen = index_of.find(line.last_keyframe);
    if (seen != index_of.end()) {
      line.start_world = corrections[seen->second] * line.start_world;
      line.end_world = corrections[seen->second] * line.end_world;
    }
    const auto known = adjusted.find(line.id);
    if (known != adjusted.end()) LayOnto(*known->second, &line);
  }
}

// The right camera's turns are tied from the start, unless the run, or the check before it, has
// found it turned.
CalibrationOptions BeliefsAfter(const OdometryRun& run, CalibrationOptions options) {
  constexpr double kTurned_rad = 4e-4;  // some 0.15 px
  if (run.source && TurnRight(run.source->corrections)) options.rows_fit = false;
  if (!run.calibration.empty() && run.calibration.back().right_rotation_rad.norm() >= kTurned_rad) {
    options.rows_fit = false;
  }
  return options;
}

// One adjustment under way.
class Adjustment {
 public:
  Adjustment(const OdometryRun& run, const AdjustmentOptions& options, const ControlTies& control)
      : run_(run),
        options_(options),
        control_(control),
        model_(run, options),
        state_(StateOfRun(run, options)) {
    for (const DistanceTie& tie : control.distances) {
      for (AdjustedPoint& point : state_.points) {
        point.is_tied |= point.landmark->id == tie.from_id || point.landmark->id == tie.to_id;
      }
    }
    const CalibrationOptions calibration = BeliefsAfter(run, options.calibration);
    ties_.emplace(calibration, run.calibration.empty()
                                   ? CalibrationPrior(calibration).belief()
                                   : MakeBelief(run.calibration.back(), calibration));
    model_.tie_weights = ties_->weights();
  }

  bool Solve(const Progress& progress, double settled) {
    Preintegrate(run_, &state_);
    problem_ = BuildProblem(model_, state_, closures_, control_);
    const RoundSummary round =
        SolveProblem(options_, state_, closures_, settled, problem_.get(), progress);
    if (figures_.iterations == 0) figures_.initial_cost = round.initial_cost;
    figures_.iterations += round.iterations;
    figures_.final_cost = round.final_cost;
    return round.usable;
  }

  // Images are believed as far as they agree with each other.
  void MeasureScatter() {
    std::vector<double> of_points, of_lines;
    for (const AdjustedPoint& point : state_.points) {
      for (const AdjustedPointObservation& observation : point.observations) {
        of_points.push_back(Chi2OfLeft(PointTerm(point, observation, state_, model_)));
      }
    }
    for (const AdjustedLine& line : state_.lines) {
      for (const AdjustedLineObservation& observation : line.observations) {
        of_lines.push_back(Chi2OfLeft(LineTerm(line, observation, 1, state_, model_)));
      }
    }
    const auto apply = [&](double scatter, StereoGeometry* geometry) {
      geometry->weight /= std::clamp(scatter, options_.min_scatter, options_.max_scatter);
    };
    apply(ComputeScatter(std::move(of_points)), &model_.points);
    apply(ComputeScatter(std::move(of_lines)), &model_.lines);
  }

  void Reject() {
    const int64_t points = CountWithObservations(state_.points).second;
    const int64_t lines = CountWithObservations(state_.lines).second;
    RejectPointOutliers(model_, &state_, &figures_);
    RejectLineOutliers(model_, &state_);
    figures_.rejected_point_observations += points - CountWithObservations(state_.points).second;
    figures_.rejected_line_observations += lines - CountWithObservations(state_.lines).second;
  }

  // What is known of the calibration, and which of its numbers are taken to be as given.
  void UpdateCalibrationPrior() {
    problem_ = BuildProblem(model_, state_, closures_, control_);  // of what is left and believed
    const Eigen::MatrixXd covariance =
        BlockCovariance(problem_.get(), {state_.imu_calibration, state_.camera_calibration});
    if (covariance.size() == 0) return;
    const CalibrationBelief with{AsVector(state_.calibration()), covariance};
    known_ = ties_->Without(with);
    ties_->Update(with);
    model_.tie_weights = ties_->weights();
  }

  // Recognises places that were visited twice. False where there are none.
  bool FindClosures(const ClosureSource& find, const Progress& progress) {
    links_ = LinkChi2(state_);
    closures_ = find(state_, progress);
    figures_.closures = std::ssize(closures_);
    figures_.closures_rejected = RefuseBeyondGate(options_.closures, state_, model_, &closures_);
    return figures_.closures_rejected < figures_.closures;
  }

  // Wrong ones do not decide where right ones are, and none may speak against odometry. Where they
  // go on being taken back none of them is to be believed: points first, of which a wrong place may
  // have many, then edges.
  bool SolveWithClosures(const Progress& progress) {
    model_.GraduateClosures(kFirstGraduation);
    const bool usable = Solve(progress.Part(0, 0.4), kNearlySettled);
    model_.GraduateClosures(1);
    if (!usable) return false;
    Closing closing = SolveTakingBack(progress.Part(0.4, 0.7));
    if (closing == Closing::kUnsettled) {
      TakeBack([](const Closure& closure) { return !closure.points.empty(); });
      closing = SolveTakingBack(progress.Part(0.7, 0.9));
    }
    if (closing == Closing::kUnsettled) {
      TakeBack([](const Closure&) { return true; });
      return Solve(progress.Part(0.9, 1), kSettled);
    }
    return closing == Closing::kDone;
  }

  AdjustedRun Result() {
    OdometryRun run = run_;
    MoveLandmarks(state_, &run);
    MoveLines(state_, &run);
    for (size_t k = 0; k < run.keyframes.size(); ++k) {
      run.keyframes[k].T_world_imu = PoseFromBlock(state_.frames[k].pose);
    }
    for (size_t i = 0; i < state_.headings.size(); ++i) {
      if (state_.headings[i]) run.manhattan_worlds[i].heading_rad = *state_.headings[i];
    }
    if (known_) {
      run.calibration.push_back(
          Describe(state_.calibration(), known_->covariance, options_.calibration.sigma_scale));
      run.calibration.back().stamp_ns = run.keyframes.back().stamp_ns;
      run.calibration.back().segment = run.keyframes.back().segment;
    }
    Count(state_, &figures_);
    for (const Closure& closure : closures_) {
      if (closure.taken_back) continue;
      figures_.matched_points += std::ssize(closure.points);
      figures_.matched_edges += std::ssize(closure.edges);
    }
    return {std::move(run), figures_};
  }

 private:
  enum class Closing { kUnusable, kDone, kUnsettled };

  // Solves until no closure is taken back, or too often.
  Closing SolveTakingBack(const Progress& progress) {
    constexpr int kMostTimes = 5;
    for (int i = 0; i < kMostTimes; ++i) {
      const double from = static_cast<double>(i) / kMostTimes;
      const Progress part = progress.Part(from, from + 1.0 / kMostTimes);
      if (!Solve(part, kSettled)) return Closing::kUnusable;
      const int count = TakeBackClosures(links_, state_, model_, &closures_);
      figures_.closures_rejected += count;
      if (count == 0) return Closing::kDone;
    }
    return Closing::kUnsettled;
  }

  template <typename Predicate>
  void TakeBack(Predicate is_meant) {
    for (Closure& closure : closures_) {
      if (closure.taken_back || !is_meant(closure)) continue;
      closure.taken_back = true;
      ++figures_.closures_rejected;
    }
  }

  const OdometryRun& run_;
  const AdjustmentOptions& options_;
  const ControlTies& control_;
  AdjustmentModel model_;
  AdjustmentState state_;
  std::unique_ptr<ceres::Problem> problem_;
  std::vector<Closure> closures_;
  std::vector<double> links_;  // before there were closures
  std::optional<NominalPrior> ties_;
  std::optional<CalibrationBelief> known_;
  AdjustmentFigures figures_;
};

}  // namespace

AdjustedRun AdjustWithClosures(const OdometryRun& run, const AdjustmentOptions& options,
                               const ClosureSource& find, const Progress& progress,
                               const ControlTies& control) {
  options.Check();
  if (run.keyframes.size() < kMinKeyframes || run.imu.empty()) {
    return {run, {}, "too few keyframes, or no IMU samples"};
  }
  Adjustment adjustment(run, options, control);
  if (!adjustment.Solve(progress.Part(0, 0.2), kRoughlySettled)) {
    return {run, {}, kDiverged};
  }
  adjustment.MeasureScatter();
  adjustment.Reject();
  adjustment.UpdateCalibrationPrior();
  bool usable = adjustment.Solve(progress.Part(0.2, 0.4), find ? kNearlySettled : kSettled);
  if (usable && find) {
    usable = adjustment.FindClosures(find, progress.Part(0.4, 0.6))
                 ? adjustment.SolveWithClosures(progress.Part(0.6, 1))
                 : adjustment.Solve(progress.Part(0.6, 1), kSettled);
  }
  return usable ? adjustment.Result() : AdjustedRun{run, {}, kDiverged};
}

AdjustedRun Adjust(const OdometryRun& run, const AdjustmentOptions& options,
                   const ViewImages* images, const Progress& progress, const ControlTies& control) {
  if (!options.closures.enabled) {
    return AdjustWithClosures(run, options, nullptr, progress, control);
  }
  const AdjustmentModel model(run, options);
  const auto find = [&](const AdjustmentState& state, const Progress& part) {
    std::vector<Closure> closures = FindEdgeClosures(state, options.closures);
    if (!images || !options.closures.points) return closures;
    std::ranges::move(FindPointClosures(state, *images, model.points, options.closures, part),
                      std::back_inserter(closures));
    return closures;
  };
  return AdjustWithClosures(run, options, find, progress, control);
}

namespace {

bool HasRevisit(const AdjustmentFigures& figures) {
  return figures.closures > figures.closures_rejected;
}

}  // namespace

AdjustedRun AdjustRun(OdometryRun run, const AdjustmentOptions& options, const ViewImages* images,
                      const Progress& progress, const ControlTies& control) {
  // Without closures no place is known to be seen again; control points say as much.
  const bool needs_revisit = options.needs_revisit && control.points.empty();
  const bool is_wanted = options.enabled && (options.closures.enabled || !needs_revisit);
  if (!is_wanted || run.method == kExternalPoses || run.keyframes.empty()) return {std::move(run)};
  try {
    AdjustedRun adjusted = Adjust(run, options, images, progress, control);
    if (!adjusted.figures) {
      ++adjusted.run.warnings[kNotAdjusted];
      spdlog::debug("keyframes are not adjusted: {}", adjusted.reason);
    }
    if (!needs_revisit || !adjusted.figures || HasRevisit(*adjusted.figures)) return adjusted;
  } catch (const StoppedError&) {
    spdlog::debug("the adjustment was interrupted");
  }
  return {std::move(run)};
}

}  // namespace slcmap::mapping
