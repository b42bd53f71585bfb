// slcmap odometry: the motion of a rig from a recorded sequence.
#include "apps/commands/odometry_stage.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/io/trajectory.h"
#include "data/source/recorded_source.h"
#include "data/source/sequence_source.h"
#include "data/version.h"
#include "odometry/odometry.h"
#include "odometry/run/run_folder.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/verdict.h"

namespace slcmap::inline commands {
namespace {

// All that a configuration says of this stage.
struct ConfiguredOptions {
  OdometryOptions odometry;
  VerdictOptions verdict;
};

ConfiguredOptions ReadOptions(const OdometryArguments& arguments) {
  ConfiguredOptions options;
  if (!arguments.config.empty()) {
    options.odometry = OdometryOptions::FromYaml(arguments.config);
    options.verdict = VerdictOptions::FromYaml(arguments.config);
  }
  if (!arguments.method.empty()) options.odometry.method = MethodFromName(arguments.method);
  options.odometry.Check();
  return options;
}

// A TUM file that grows row by row, so that an interrupted run leaves what it has. Throws
// OutputError, as on a full disk.
class TrajectoryStream {
 public:
  explicit TrajectoryStream(const std::string& path)
      : path_(path), file_(std::fopen(path.c_str(), "wb")) {
    if (!file_) throw OutputError(path_ + ": cannot be opened: " + std::strerror(errno));
    Write(kTumHeader);
  }

  // The row is in the file when the call returns.
  void Add(const StampedPose& pose) { Write(TumRow(pose)); }

 private:
  void Write(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() ||
        std::fflush(file_.get()) != 0) {
      throw OutputError(path_ + ": cannot be written: " + std::strerror(errno));
    }
  }

  std::string path_;
  FileHandle file_;
};

// The length of the path along the states, within segments.
class PathLength {
 public:
  void Add(const OnlineState& state) {
    if (last_ && last_->segment == state.segment) {
      length_m_ += (state.T_world_imu.translation - last_->T_world_imu.translation).norm();
    }
    last_ = state;
  }
  double length_m() const { return length_m_; }

 private:
  std::optional<OnlineState> last_;
  double length_m_ = 0;
};

RunSource GetOrigin(const SequenceSource& source, const ConfiguredOptions& options,
                    const StartCheck& check) {
  const SourceInfo& info = source.info();
  RunSource origin;
  origin.version = kVersion;
  origin.sequence = std::filesystem::weakly_canonical(info.name).string();
  origin.calibration = info.calibration;
  origin.options = options.odometry.ToYaml() + options.verdict.ToYaml();
  origin.corrections = check.corrections;
  origin.check_errors = check.errors;
  origin.raw_rig = info.rig;
  origin.opened = info.opened;
  const bool stereo = HasTwoCameras(info.rig);
  for (size_t pair = 0; pair < info.pair_stamps_ns.size(); ++pair) {
    origin.images.push_back({info.pair_stamps_ns[pair],
                             PathWithin(source.ImagePlace(pair, 0), info.name),
                             stereo ? PathWithin(source.ImagePlace(pair, 1), info.name) : ""});
    for (int camera = 2; camera < CameraCount(info.rig); ++camera) {
      origin.images.back().other_paths.push_back(
          PathWithin(source.ImagePlace(pair, camera), info.name));
    }
  }
  return origin;
}

// Feeds a sequence to odometry and keeps account.
class Feeder {
 public:
  // `origin` is where the run comes from.
  Feeder(SequenceSource* source, RunSource origin, const ConfiguredOptions& options,
         const OdometryArguments& arguments)
      : source_(*source),
        origin_(std::move(origin)),
        verdict_options_(options.verdict),
        odometry_(source->info().rig, options.odometry, arguments.threads),
        stream_(arguments.run + "/trajectory.tum"),
        recorder_(arguments.run, Header(), &odometry_, [this] { return source_.warnings(); }),
        start_(CostSoFar()) {
    if (arguments.real_time) pace_.emplace(Stamps(), SteadyClock(Interrupted));
  }

  // Until the end of the sequence, or Ctrl-C.
  void FeedAll() {
    ProgressBar progress("odometry");
    const int64_t first_ns = Stamps().front();
    while (!complete_ && !Interrupted()) {
      const std::optional<ReadPair> image = NextImage();
      complete_ = !image;
      // Ctrl-C ends a wait early: the image is not due.
      if (complete_ || (pace_ && Interrupted())) break;
      FeedImuUntil(image->stamp_ns);
      Take(odometry_.AddStereo(*image, image->decode));
      if (pace_ && !pace_->IsDue()) Take(odometry_.Finish());
      recorder_.Update();
      ++frames_;
      data_s_ = ToSeconds(image->stamp_ns - first_ns);
      while (Stamps()[position_] < image->stamp_ns) ++position_;
      progress.Update(static_cast<int64_t>(position_) + 1, std::ssize(Stamps()), data_s_,
                      path_.length_m());
    }
    Take(odometry_.Finish());
  }

  OdometryRun Run(const std::string& partial_reason) {
    OdometryRun run = odometry_.Run();
    run.source = origin_;
    run.complete = complete_;
    run.partial_reason = complete_ ? "" : partial_reason;
    const Warnings warnings = source_.warnings();
    for (const auto& [kind, entry] : warnings.entries()) run.warnings[kind] += entry.count;
    const ProcessCost now = CostSoFar();
    run.timings.cpu_s = now.cpu_s - start_.cpu_s;
    run.timings.wall_s = now.wall_s - start_.wall_s;
    run.timings.peak_memory_mib = now.peak_memory_mib;
    run.timings.stereo_frames = frames_;
    run.timings.data_s = data_s_;
    if (pace_) run.timings.real_time = pace_->Report();
    run.timings.stages.insert(run.timings.stages.begin(), {"wait for images", wait_s_, frames_});
    run.verdict = JudgeRun(run, verdict_options_);
    return run;
  }

  // The same after an error, whatever else a thread has still to throw.
  OdometryRun RunAfter(const std::exception& error) {
    try {
      odometry_.Finish();
    } catch (const std::exception& later) {
      spdlog::debug("after that: {}", later.what());
    }
    return Run(error.what());
  }

  double path_length_m() const { return path_.length_m(); }

 private:
  const std::vector<int64_t>& Stamps() const { return source_.info().pair_stamps_ns; }

  OdometryRun Header() {
    OdometryRun header = odometry_.Run();  // of the method and the rig
    header.source = origin_;
    return header;
  }

  void Take(const std::vector<OnlineState>& states) {
    for (const OnlineState& state : states) {
      stream_.Add({state.stamp_ns, state.T_world_imu});
      path_.Add(state);
      if (pace_) pace_->Done(state.stamp_ns);
    }
  }

  std::optional<ReadPair> ReadImage() {
    if (!pace_) return source_.NextPair();
    if (pace_->AtEnd()) return std::nullopt;
    std::optional<ReadPair> image = source_.NextPair(pace_->Next());
    if (image) pace_->Take(image->stamp_ns);
    return image;
  }

  std::optional<ReadPair> NextImage() {
    const auto before = std::chrono::steady_clock::now();
    std::optional<ReadPair> image = ReadImage();
    wait_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    return image;
  }

  // Feeds the samples up to the first one that is not before the image, which then need not wait.
  void FeedImuUntil(int64_t image_stamp_ns) {
    const double offset_s = source_.info().rig.camera_time_offset_s;
    const int64_t until_ns = image_stamp_ns + ToNanoseconds(offset_s + odometry_.ImuAhead_s());
    while (!last_imu_ns_ || *last_imu_ns_ < until_ns) {
      const std::optional<ImuSample> sample = source_.NextImu();
      if (!sample) return;
      odometry_.AddImu(*sample);
      last_imu_ns_ = sample->stamp_ns;
    }
  }

  SequenceSource& source_;
  const RunSource origin_;
  const VerdictOptions verdict_options_;
  Odometry odometry_;
  std::optional<RealTimePace> pace_;  // none: as fast as can be
  TrajectoryStream stream_;
  RunRecorder recorder_;
  const ProcessCost start_;
  PathLength path_;
  std::optional<int64_t> last_imu_ns_;
  size_t position_ = 0;
  int64_t frames_ = 0;
  double data_s_ = 0, wait_s_ = 0;
  bool complete_ = false;
};

// The run so far, if there is room for it.
void WriteAfter(const std::exception& error, Feeder* feeder, OutputFolder* output) {
  try {
    WriteRunFolder(output, feeder->RunAfter(error));
  } catch (const OutputError& later) {
    spdlog::debug("after that: {}", later.what());
  }
}

void LogSlopes(const OdometryRun& run) {
  for (std::size_t i = 0; i < run.sloped_directions.size(); ++i) {
    const SlopedDirection& slope = run.sloped_directions[i];
    const auto follows = [&](const Line& line) {
      return line.axis == LineAxis::kSloped && line.world == static_cast<int>(i);
    };
    spdlog::info("slope of {:.2f} degrees towards {:.1f} degrees: {} lines{}",
                 slope.elevation_rad * kDegreesPerRadian, slope.azimuth_rad * kDegreesPerRadian,
                 std::ranges::count_if(run.lines, follows), slope.withdrawn ? " (withdrawn)" : "");
  }
}

void LogLines(const OdometryRun& run) {
  if (run.line_deviation_rad > 0 && !run.manhattan_worlds.empty()) {
    spdlog::info("lines are off the axes of the building by {:.2f} degrees",
                 run.line_deviation_rad * 180 / std::numbers::pi);
  }
  if (!run.manhattan_worlds.empty()) {
    std::string headings;
    for (const ManhattanWorld& world : run.manhattan_worlds) {
      headings += fmt::format("{}{:.1f}{}", headings.empty() ? "" : ", ",
                              world.heading_rad * 180 / std::numbers::pi,
                              world.withdrawn ? " (withdrawn)" : "");
    }
    spdlog::info("Manhattan worlds: {}, headings {} degrees", run.manhattan_worlds.size(),
                 headings);
  } else if (UsesStructure(MethodFromName(run.method))) {
    spdlog::info("no Manhattan world found: the building's directions were not used");
  }
  LogSlopes(run);
  if (run.lines.empty()) return;
  const LineTrackLengths lives = MeasureLineTracks(run.lines);
  spdlog::info(
      "{} lines, seen in {:.0f} keyframes (median; mean {:.1f}), {:.0f} % in more than ten",
      lives.lines, lives.median_keyframes, lives.mean_keyframes, 100 * lives.share_over_10);
}

void LogCalibration(const OdometryRun& run) {
  if (run.calibration.empty()) return;
  const CalibrationEstimate& e = run.calibration.back();
  const auto number = [](double value, double sigma, const char* unit) {
    if (sigma == 0) return std::string("held");
    return fmt::format("{:.2f} {} (sigma {:.2f})", value, unit, sigma);
  };
  const auto degrees = [](const Eigen::Vector3d& v) {
    return fmt::format("{:.3f} {:.3f} {:.3f}", kDegreesPerRadian * v.x(), kDegreesPerRadian * v.y(),
                       kDegreesPerRadian * v.z());
  };
  const auto turn = [&](const Eigen::Vector3d& value, const Eigen::Vector3d& sigma) {
    if (sigma.isZero(0)) return std::string("held");
    return fmt::format("{} degrees (sigma {})", degrees(value), degrees(sigma));
  };
  const auto pixels = [](const Eigen::Vector2d& value, const Eigen::Vector2d& sigma) {
    if (sigma.isZero(0)) return std::string("held");
    return fmt::format("{:.2f} {:.2f} px (sigma {:.2f} {:.2f})", value.x(), value.y(), sigma.x(),
                       sigma.y());
  };
  spdlog::info(
      "calibration found, less what was given: time offset {}, turn of the IMU {}, of the right "
      "camera {}, focal length {}, principal point of the right camera {}",
      number(1e3 * e.time_offset_s, 1e3 * e.time_offset_sigma_s, "ms"),
      turn(e.imu_rotation_rad, e.imu_rotation_sigma_rad),
      turn(e.right_rotation_rad, e.right_rotation_sigma_rad),
      number(100 * e.focal_length, 100 * e.focal_length_sigma, "%"),
      pixels(e.right_centre_px, e.right_centre_sigma_px));
  if (run.rectified_rig.readout_s[0] != 0) {
    spdlog::info("rows of the first camera are exposed within {:.2f} ms",
                 1e3 * run.rectified_rig.readout_s[0]);
  }
  const auto imu = [&e](int first, int count, double scale, const char* unit) {
    const Eigen::VectorXd sigmas = scale * e.imu_errors_sigma.segment(first, count);
    if (sigmas.isZero(0)) return std::string("held");
    const Eigen::VectorXd values = scale * e.imu_errors.segment(first, count);
    return fmt::format("{:.2f} {} (sigma {:.2f})", fmt::join(values.begin(), values.end(), " "),
                       unit, sigmas.maxCoeff());
  };
  spdlog::info(
      "readings of the IMU times one and, less what was given: accelerometer's scale {}, axes {}, "
      "gyroscope's scale {}, axes {}",
      imu(kErrorAccelScale, 3, 100, "%"), imu(kErrorAccelAxes, 3, kDegreesPerRadian, "degrees"),
      imu(kErrorGyroScale, 3, 100, "%"), imu(kErrorGyroAxes, 6, kDegreesPerRadian, "degrees"));
}

// Before anything is computed. The file may replace an older one, but none that is read, nor one of
// the run's.
void CheckCalibrationTarget(const OdometryArguments& arguments) {
  namespace fs = std::filesystem;
  const std::string& path = arguments.write_calibration;
  if (path.empty()) return;
  const auto whole = [](const std::string& p) { return fs::weakly_canonical(fs::absolute(p)); };
  const fs::path target = whole(path);
  const auto refuse = [&](const std::string& expected) {
    throw ConfigError(fmt::format("--write-calibration: found {}, expected {}", path, expected));
  };
  if (fs::is_directory(target) || !fs::is_directory(target.parent_path())) {
    refuse("a file in a folder that exists");
  }
  std::vector<std::string> files = CollectFiles(arguments.opened);
  if (!arguments.config.empty()) files.push_back(arguments.config);
  for (const std::string& read : files) {
    if (target == whole(read)) refuse("no file that is read");
  }
  for (const std::string& folder : {arguments.run, arguments.sequence}) {
    const fs::path inside = target.lexically_relative(whole(folder));
    if (!inside.empty() && *inside.begin() != "..") refuse("a file out of " + folder);
  }
}

void WriteCalibration(const std::string& path, const OdometryRun& run) {
  if (path.empty()) return;
  if (run.verdict && run.verdict->level == VerdictLevel::kFailed) {
    spdlog::warn("{} was not written: the run has failed", path);
    return;
  }
  if (run.calibration.empty()) {
    spdlog::warn("{} was not written: the calibration could not be estimated", path);
    return;
  }
  const Rig rig = CalibratedRig(run.source->raw_rig, run.rectified_rig, run.calibration.back());
  WriteKalibrCalibration(path, WithoutStamps(rig, run.source->opened));
  spdlog::info("wrote {}", path);
}

void LogRealTime(const RunTimings& timings) {
  if (!timings.real_time) return;
  const RealTimeReport& play = *timings.real_time;
  const int64_t images = timings.stereo_frames + play.skipped_images;
  spdlog::info(
      "real time: skipped {} of {} images ({:.1f} %), latency median {:.1f} ms, 95 % {:.1f} ms",
      play.skipped_images, images,
      100.0 * static_cast<double>(play.skipped_images) /
          static_cast<double>(std::max<int64_t>(images, 1)),
      1e3 * play.latency_median_s, 1e3 * play.latency_95_s);
}

const char* DescribeImages(const Rig& rig) {
  if (CameraCount(rig) > 2) return "groups of images";
  return HasTwoCameras(rig) ? "pairs of images" : "images";
}

void LogResult(const OdometryRun& run, const SourceInfo& info, double path_length_m,
               const std::string& folder) {
  const RunTimings& t = run.timings;
  const double frames = static_cast<double>(std::max<int64_t>(t.stereo_frames, 1));
  spdlog::info("{} of {} {} have a pose, path {:.2f} m, {} keyframes, {} landmarks",
               run.states.size(), info.pair_stamps_ns.size(), DescribeImages(info.rig),
               path_length_m, run.keyframes.size(), run.landmarks.size());
  const PointTrackLengths lives = MeasurePointTracks(run.keyframes);
  spdlog::info("{} points, {} of them seen in a single keyframe", lives.points, lives.seen_once);
  LogLines(run);
  LogCalibration(run);
  spdlog::info("CPU {:.2f} ms an image, {:.1f} x real time, peak memory {:.0f} MiB",
               1e3 * t.cpu_s / frames, t.data_s / std::max(t.wall_s, 1e-9), t.peak_memory_mib);
  LogRealTime(t);
  for (const auto& [kind, count] : run.warnings) {
    // A few lines of which too little was seen are left out of any run.
    const bool usual =
        kind == "lines_not_finite" && 10 * count <= static_cast<int64_t>(run.lines.size());
    spdlog::log(usual ? spdlog::level::info : spdlog::level::warn, "{}: {}",
                Warnings::InWords(kind), count);
  }
  spdlog::info("wrote {}{}", folder, run.complete ? "" : " (partial: " + run.partial_reason + ")");
}

Sequence OpenPart(const OdometryArguments& arguments) {
  const EndsAtOnce nothing_is_written;
  ExpectFolder(arguments.sequence, FolderKind::kSequence);
  Sequence sequence = OpenSequence(arguments.sequence, arguments.opened);
  KeepPart(arguments.part, &sequence);
  return sequence;
}

}  // namespace

std::vector<std::string> ListFolders(const std::string& sequence) {
  std::vector<std::string> folders = {sequence};
  for (const char* name : {"mav0", "cam0", "cam1", "imu0", "cam0/data", "cam1/data",
                           "state_groundtruth_estimate0", "mocap0", "truth"}) {
    folders.push_back(sequence + "/" + name);
    folders.push_back(sequence + "/mav0/" + name);
  }
  return folders;
}

std::vector<std::string> ListInputs(const OdometryArguments& arguments) {
  std::vector<std::string> inputs = ListFolders(arguments.sequence);
  for (const std::string& file : CollectFiles(arguments.opened)) inputs.push_back(file);
  if (!arguments.config.empty()) inputs.push_back(arguments.config);
  return inputs;
}

OdometryRun RunOdometryStage(const OdometryArguments& arguments,
                             const std::function<void()>& begin) {
  CheckThreads(arguments.threads);
  arguments.part.Check();
  CheckCalibrationTarget(arguments);
  ConfiguredOptions options = ReadOptions(arguments);
  OutputFolder output(arguments.run, RunFiles(), ListInputs(arguments));
  Sequence sequence = OpenPart(arguments);
  output.Open();
  if (!IsStereo(sequence.rig) && options.odometry.method != Method::kPointsMono &&
      arguments.opened.cameras.size() != 1) {
    spdlog::warn("{}: found {}: its map has no dense cloud", sequence.folder,
                 HasTwoCameras(sequence.rig) ? "cameras that look apart, which are all used"
                                             : "one camera, which is used alone");
  }
  const StartCheck check = CheckBeforeStart(arguments.start, options.odometry, &sequence);
  if (TurnRight(check.corrections)) options.odometry.calibration.rows_fit = false;
  const bool uses_two = UsesTwoCameras(options.odometry.method, sequence.rig);
  RecordedSource source(std::move(sequence), {.read_right = uses_two});
  const SourceInfo& info = source.info();
  spdlog::info("{} {}; calibration: {}", info.pair_stamps_ns.size(), DescribeImages(info.rig),
               info.calibration);
  // Odometry has its own threads; to share loops as short as OpenCV's costs more than it saves.
  cv::setNumThreads(1);

  if (begin) begin();
  output.MoveAside();  // would be taken for the new run's
  Feeder feeder(&source, GetOrigin(source, options, check), options, arguments);
  try {
    feeder.FeedAll();
  } catch (const std::exception& error) {
    WriteAfter(error, &feeder, &output);
    throw;
  }
  const OdometryRun run = feeder.Run("interrupted");
  WriteRunFolder(&output, run);
  LogResult(run, info, feeder.path_length_m(), arguments.run);
  LogVerdict(arguments.run, *run.verdict);
  WriteCalibration(arguments.write_calibration, run);
  if (run.states.empty()) RefuseFailed(arguments.run, run);
  return run;
}

void AddOdometryCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("odometry", "Estimate the motion of a recorded rig");
  const auto arguments = std::make_shared<OdometryArguments>();
  AddOdometryOptions(*command, arguments.get());
  command->add_option("-o,--output", arguments->run, "Run folder to write")->required();
  command->footer(
      "Examples:\n  slcmap odometry MH_01_easy -o run\n"
      "  slcmap odometry dataset-room1_512_16 -o run --method points --config tuning.yaml\n\n"
      "Writes trajectory.tum (pose of the IMU body, a row an image), points.ply, lines.ply,\n"
      "timings.json and what map reads. Ctrl-C ends with the results so far.\n\n" +
      std::string(kVerdictHelp));
  command->callback([arguments] { RefuseFailed(arguments->run, RunOdometryStage(*arguments)); });
}

}  // namespace slcmap::commands
