#include "apps/compare/measure.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/core/error.h"
#include "data/source/sequence.h"
#include "mapping/map/map_folder.h"
#include "odometry/run/run.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline evaluation {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastPoses = 0.9;  // of the observations, of a trajectory that decides
constexpr double kLineTolerance_m = 0.05;
constexpr double kReferenceMade = 0.2;  // share of the time, about

// What is read of one run, or of one given trajectory.
struct Measured {
  size_t method = 0;
  Trajectory online, final_poses;
  std::vector<int64_t> stamps_ns;  // that should have a pose; empty: unknown
  std::vector<MapLine> lines;
  RunTimings timings;
  std::string remark;  // on the run's own verdict
};

std::string FileBeside(const std::string& sequence, const char* name) {
  const fs::path folder = LocateRecording(sequence);
  std::error_code error;
  for (const fs::path& base : {folder, fs::absolute(folder).lexically_normal().parent_path()}) {
    if (fs::is_regular_file(base / "truth" / name, error)) return (base / "truth" / name).string();
  }
  return "";
}

Measured ReadMeasured(const RunFolders& folders, size_t method) {
  const OdometryRun run = ReadRunFolder(folders.run);
  const MapResult map = ReadMapFolder(folders.map);
  Measured measured;
  measured.method = method;
  measured.online = OnlinePoses(run.states);
  measured.final_poses = map.trajectory;
  if (run.source) {
    for (const StereoEntry& images : run.source->images) {
      measured.stamps_ns.push_back(images.stamp_ns);
    }
  }
  measured.lines = map.lines;
  measured.timings = run.timings;
  if (run.states.empty()) {
    measured.remark = "a run has no pose at all";
  } else if (run.verdict && run.verdict->level == VerdictLevel::kFailed) {
    measured.remark = "a run failed by its own verdict: " + InWords(run.verdict->reasons.front());
  }
  return measured;
}

std::vector<Measured> ReadAll(const MeasuredSequence& sequence) {
  std::vector<Measured> all;
  for (size_t i = 0; i < sequence.methods.size(); ++i) {
    const MeasuredMethod& method = sequence.methods[i];
    for (const RunFolders& folders : method.runs) all.push_back(ReadMeasured(folders, i));
    if (method.given.empty()) continue;
    Measured given;
    given.method = i;
    given.final_poses = method.given;
    all.push_back(std::move(given));
  }
  return all;
}

// A figure of nothing is left out.
void Set(const std::string& key, double value, Figures* figures) {
  if (!std::isnan(value)) (*figures)[key] = value;
}

void AddAbsolute(const TrajectoryMetrics& metrics, Figures* figures) {
  for (const AbsoluteError& error : metrics.absolute) {
    if (error.kind == AlignmentKind::kPositionYaw) {
      (*figures)["ape_final_m"] = error.position_m.rmse;
      (*figures)["rotation_final_deg"] = error.rotation_deg.rmse;
    } else if (error.kind == AlignmentKind::kRigid) {
      (*figures)["ape_se3_final_m"] = error.position_m.rmse;
    }
  }
}

// Of the final poses; of the online ones APE alone. Gives the coverage of the final ones.
Coverage AddTrajectoryFigures(const Measured& measured, const Trajectory& truth, Figures* figures,
                              Alignment* alignment) {
  const TrajectoryMetrics metrics =
      EvaluateTrajectory(truth, measured.final_poses, measured.stamps_ns);
  AddAbsolute(metrics, figures);
  *alignment = metrics.absolute.front().alignment;
  for (const RelativeError& error : metrics.relative) {
    if (error.pieces == 0) continue;
    (*figures)[fmt::format("rpe_{:g}m_percent", error.length_m)] = error.translation_rmse_percent;
  }
  if (metrics.loop) (*figures)["loop_percent"] = metrics.loop->percent;
  (*figures)["coverage_percent"] = 100 * metrics.coverage.overall;
  if (measured.online.empty()) return metrics.coverage;
  const TrajectoryMetrics online = EvaluateTrajectory(truth, measured.online, measured.stamps_ns);
  (*figures)["ape_online_m"] = online.absolute.front().position_m.rmse;
  return metrics.coverage;
}

void AddGap(const EdgeStraightness& edges, double from_s, const char* key, Figures* figures) {
  for (const TimeGap& gap : edges.gaps) {
    if (gap.from_s == from_s && gap.pairs > 0) (*figures)[key] = 1e3 * gap.apart_m;
  }
}

void AddStraightness(const Straightness& straightness, const Straightness* truth,
                     Figures* figures) {
  const EdgeStraightness& edges = straightness.edges;
  Set("edge_thickness_mm", 1e3 * edges.thickness_m, figures);
  if (truth) {
    Set("edge_thickness_beyond_mm",
        1e3 * ThicknessBeyond_m(edges.thickness_m, truth->edges.thickness_m), figures);
  }
  AddGap(edges, 0, "edge_apart_under_1s_mm", figures);
  AddGap(edges, 30, "edge_apart_over_30s_mm", figures);
  if (straightness.directions) {
    (*figures)["dispersion_deg"] = straightness.directions->dispersion_deg;
    if (straightness.directions->orthogonality_deg) {
      (*figures)["orthogonality_deg"] = *straightness.directions->orthogonality_deg;
    }
  }
  if (const auto& flatness = straightness.flatness) {
    (*figures)["mpv_mm2"] = 1e6 * flatness->mpv_m2;
    (*figures)["mme_nats"] = flatness->mme;
    if (flatness->mom_m2) (*figures)["mom_mm2"] = 1e6 * *flatness->mom_m2;
  }
}

void AddLineFigures(const Measured& measured, const TrueEdges& edges, const Alignment& alignment,
                    const Progress& progress, Figures* figures) {
  if (measured.lines.empty()) return;
  const LineMetrics metrics =
      EvaluateLines(edges, Aligned(alignment, measured.lines), kMostLineSamples, progress);
  for (const LineScore& score : metrics.scores) {
    if (score.tolerance_m != kLineTolerance_m) continue;
    Set("line_precision_5cm_percent", 100 * score.precision, figures);
    Set("line_recall_5cm_percent", 100 * score.recall, figures);
    Set("line_redundancy", score.redundancy, figures);
  }
}

void AddCost(const RunTimings& timings, Figures* figures) {
  if (timings.stereo_frames == 0 || !(timings.data_s > 0)) return;
  (*figures)["cpu_ms_a_pair"] = 1e3 * timings.cpu_s / static_cast<double>(timings.stereo_frames);
  (*figures)["wall_s_a_second"] = timings.wall_s / timings.data_s;
  (*figures)["peak_memory_mib"] = timings.peak_memory_mib;
}

std::vector<StageCost> CollectStages(const RunTimings& timings) {
  std::vector<StageCost> stages;
  if (timings.stereo_frames == 0) return stages;
  for (const StageTiming& stage : timings.stages) {
    stages.push_back({stage.name, 1e3 * stage.wall_s / static_cast<double>(timings.stereo_frames)});
  }
  return stages;
}

Trajectory Aligned(const Alignment& alignment, Trajectory trajectory) {
  for (StampedPose& pose : trajectory) {
    pose.T_world_imu = {alignment.T_truth_estimate.rotation * pose.T_world_imu.rotation,
                        alignment.Position(pose.T_world_imu.translation)};
  }
  return trajectory;
}

// Measures the runs of one sequence against what they share.
class SequenceMeasurer {
 public:
  SequenceMeasurer(const MeasuredSequence& sequence, const Progress& progress)
      : sequence_(sequence), progress_(progress), all_(ReadAll(sequence)) {
    if (!sequence.true_poses.empty()) truth_.trajectory = ReadTrajectory(sequence.true_poses);
    if (!sequence.true_edges.empty()) truth_.edges = ReadTrueEdges(sequence.true_edges);
    result_.name = sequence.name;
    result_.path = sequence.path;
    result_.true_poses = !truth_.trajectory.empty();
    result_.true_edges = !truth_.edges.whole.empty();
    result_.truth = truth_.trajectory;
    result_.edges = truth_.edges.seen;
    for (const MeasuredMethod& method : sequence.methods) {
      result_.methods.emplace_back();
      result_.methods.back().name = method.name;
      result_.methods.back().remarks = method.remarks;
    }
  }

  SequenceResult Measure() {
    if (sequence_.reference) MakeReferenceOfAll(progress_.Part(0, kReferenceMade));
    const double each = (1 - kReferenceMade) / static_cast<double>(all_.size());
    for (size_t i = 0; i < all_.size(); ++i) {
      const double from = kReferenceMade + each * static_cast<double>(i);
      progress_.ReportOrStop(from);
      MeasureOne(all_[i], progress_.Part(from, from + each));
    }
    return result_;
  }

 private:
  // Trajectories that lack many poses do not decide what the others are measured with.
  void MakeReferenceOfAll(const Progress& progress) {
    const std::string& folder = sequence_.methods[*sequence_.reference].runs.front().run;
    const OdometryRun run = ReadRunFolder(folder);
    const auto own = std::find_if(all_.begin(), all_.end(), [&](const Measured& m) {
      return m.method == *sequence_.reference;
    });
    std::vector<const Trajectory*> deciding;
    for (const Measured& measured : all_) {
      if (measured.final_poses.empty()) continue;
      if (ComputeShare(run, own->final_poses, measured.final_poses) >= kLeastPoses) {
        deciding.push_back(&measured.final_poses);
      } else {
        Remark(measured, "has no pose for many of the observations: measured with the others");
      }
    }
    reference_ = MakeReference(run, own->final_poses, deciding, truth_, progress.Part(0, 0.6));
    result_.reference = fmt::format(
        "{} observations of edges and {} of points by {}, each placed alone with each method's own "
        "poses; told apart by {}",
        reference_->observations.edges.size(), reference_->observations.points.size(),
        sequence_.methods[*sequence_.reference].name,
        reference_->true_edges ? "the true edges that they lie on" : "the lines of that run");
    if (truth_.trajectory.empty()) return;
    with_truth_ = MeasureStraightness(*reference_, truth_.trajectory, progress.Part(0.6, 0.9));
    AddStraightness(*with_truth_, nullptr, &result_.with_true_poses);
    // Thickness beyond true poses means nothing where these are not better than the methods'.
    result_.truth_is_floor =
        std::all_of(deciding.begin(), deciding.end(), [&](const Trajectory* trajectory) {
          progress.ReportOrStop(0.9);
          const double thickness_m =
              RetriangulateEdges(reference_->observations.edges, *trajectory).thickness_m;
          return !(thickness_m < with_truth_->edges.thickness_m);  // none where nothing was placed
        });
  }

  // The share of the keyframes that the run itself has poses for, and the trajectory too.
  static double ComputeShare(const OdometryRun& run, const Trajectory& own,
                             const Trajectory& trajectory) {
    int64_t keyframes = 0, shared = 0;
    for (const Keyframe& keyframe : run.keyframes) {
      if (!PoseAt(own, keyframe.stamp_ns)) continue;
      ++keyframes;
      shared += PoseAt(trajectory, keyframe.stamp_ns).has_value();
    }
    return keyframes > 0 ? static_cast<double>(shared) / static_cast<double>(keyframes) : 1;
  }

  void Remark(const Measured& measured, const std::string& remark) {
    std::vector<std::string>& remarks = result_.methods[measured.method].remarks;
    if (std::find(remarks.begin(), remarks.end(), remark) == remarks.end()) {
      remarks.push_back(remark);
    }
  }

  void MeasureOne(const Measured& measured, const Progress& progress) {
    if (!measured.remark.empty()) Remark(measured, measured.remark);
    if (measured.final_poses.empty()) return;
    Figures figures;
    Alignment alignment;
    if (result_.true_poses) {
      MeasureAgainstTruth(measured, progress.Part(0, 0.3), &figures, &alignment);
    }
    if (reference_) {
      AddStraightness(
          MeasureStraightness(*reference_, measured.final_poses, progress.Part(0.3, 0.6)),
          with_truth_ ? &*with_truth_ : nullptr, &figures);
      if (!result_.truth_is_floor) figures.erase("edge_thickness_beyond_mm");
    }
    AddCost(measured.timings, &figures);
    MethodResult& method = result_.methods[measured.method];
    if (method.repeats.empty()) KeepForPictures(measured, alignment, &method);
    method.repeats.push_back(std::move(figures));
  }

  // A trajectory that has nothing in common with the truth is the method's failure, not the
  // comparison's.
  void MeasureAgainstTruth(const Measured& measured, const Progress& progress, Figures* figures,
                           Alignment* alignment) {
    Coverage coverage;
    try {
      coverage = AddTrajectoryFigures(measured, truth_.trajectory, figures, alignment);
    } catch (const DataError& error) {
      Remark(measured, error.what());
      return;
    }
    if (coverage.flagged) {
      Remark(measured, fmt::format("covers {:.1f} % only of what follows initialisation: its "
                                   "errors are not to be compared",
                                   100 * coverage.after_initialisation));
    }
    if (result_.true_edges) AddLineFigures(measured, truth_.edges, *alignment, progress, figures);
  }

  void KeepForPictures(const Measured& measured, Alignment alignment, MethodResult* method) {
    if (!result_.true_poses && base_) {
      alignment = OnBase(measured.final_poses);
    } else if (!base_) {
      base_ = measured.final_poses;
    }
    method->trajectory = Aligned(alignment, measured.final_poses);
    method->lines = slcmap::Aligned(alignment, measured.lines);
    method->stages = CollectStages(measured.timings);
    if (result_.length_m > 0) return;
    if (measured.final_poses.empty()) return;
    const int64_t from_ns = measured.final_poses.front().stamp_ns;
    const int64_t to_ns = measured.final_poses.back().stamp_ns;
    Trajectory path = result_.true_poses ? truth_.trajectory : measured.final_poses;
    std::erase_if(path, [&](const StampedPose& pose) {
      return pose.stamp_ns < from_ns || pose.stamp_ns > to_ns;
    });
    result_.length_m = MeasurePathLength_m(path);
    result_.duration_s = ToSeconds(to_ns - from_ns);
  }

  // Without truth all are laid over the first.
  Alignment OnBase(const Trajectory& trajectory) const {
    std::vector<Eigen::Vector3d> own, base;
    for (const StampedPose& pose : trajectory) {
      const auto other = PoseAt(*base_, pose.stamp_ns);
      if (!other) continue;
      own.push_back(pose.T_world_imu.translation);
      base.push_back(other->translation);
    }
    if (own.empty()) return {};
    const auto columns = [](const std::vector<Eigen::Vector3d>& points) {
      return Eigen::Matrix3Xd(Eigen::Map<const Eigen::Matrix3Xd>(
          points.front().data(), 3, static_cast<Eigen::Index>(points.size())));
    };
    return Align(AlignmentKind::kPositionYaw, columns(own), columns(base));
  }

  const MeasuredSequence& sequence_;
  const Progress& progress_;
  const std::vector<Measured> all_;
  KnownTruth truth_;
  std::optional<StraightnessReference> reference_;
  std::optional<Straightness> with_truth_;
  std::optional<Trajectory> base_;
  SequenceResult result_;
};

}  // namespace

std::string FindTruePoses(const std::string& sequence) {
  const std::string simulated = FileBeside(sequence, "trajectory.tum");
  return simulated.empty() ? FindTruth(LocateRecording(sequence)) : simulated;
}

std::string FindTrueEdges(const std::string& sequence) { return FileBeside(sequence, "edges.csv"); }

std::optional<size_t> ReferenceAmong(const std::vector<MeasuredMethod>& methods) {
  std::optional<size_t> found;
  for (size_t i = 0; i < methods.size(); ++i) {
    if (methods[i].runs.empty()) continue;
    const OdometryRun run = ReadRunFolder(methods[i].runs.front().run);
    const bool has_lines =
        std::any_of(run.keyframes.begin(), run.keyframes.end(),
                    [](const Keyframe& keyframe) { return !keyframe.lines.empty(); });
    if (!has_lines) continue;
    if (methods[i].name == MethodName(Method::kSlc)) return i;
    if (!found) found = i;
  }
  return found;
}

SequenceResult MeasureSequence(const MeasuredSequence& sequence, const Progress& progress) {
  return SequenceMeasurer(sequence, progress).Measure();
}

}  // namespace slcmap::evaluation
