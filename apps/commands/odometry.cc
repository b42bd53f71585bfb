// slcmap odometry: the motion of a rig from a recorded sequence.
#include "apps/commands/odometry.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "apps/commands/check.h"
#include "apps/commands/commands.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"
#include "data/core/error.h"

namespace slcmap::inline commands {

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

namespace {

constexpr std::chrono::milliseconds kWindowEvery(500);

}  // namespace

RunRecorder::RunRecorder(const std::string& run_folder, const OdometryRun& header,
                         Odometry* odometry, std::function<Warnings()> source_warnings)
    : odometry_(odometry),
      source_warnings_(std::move(source_warnings)),
      journal_(run_folder, header),
      window_written_(std::chrono::steady_clock::now()) {}

void RunRecorder::Update() {
  const OdometryRun finished = odometry_->TakeFinished();
  const bool new_direction = std::ranges::any_of(finished.lines, [&](const Line& line) {
    return line.world >= (line.axis == LineAxis::kSloped ? slopes_ : worlds_);
  });
  if (new_direction || std::chrono::steady_clock::now() - window_written_ >= kWindowEvery) {
    UpdateWindow(finished);
  } else {
    journal_.Append(finished);
  }
}

// What leaves the window is in the journal before it is no longer in the window's file.
void RunRecorder::UpdateWindow(OdometryRun finished) {
  OdometryRun window = odometry_->Window();
  const Warnings warnings = source_warnings_();
  for (const auto& [kind, entry] : warnings.entries()) window.warnings[kind] += entry.count;
  finished.manhattan_worlds = window.manhattan_worlds;  // lines in both refer to them
  finished.sloped_directions = window.sloped_directions;
  journal_.Append(finished);
  journal_.Append(odometry_->TakeFinished());  // by the end of what Window() waited for
  journal_.SetWindow(window);
  worlds_ = static_cast<int>(window.manhattan_worlds.size());
  slopes_ = static_cast<int>(window.sloped_directions.size());
  window_written_ = std::chrono::steady_clock::now();
}

TrajectoryStream::TrajectoryStream(const std::string& path)
    : path_(path), file_(std::fopen(path.c_str(), "wb")) {
  if (!file_) throw OutputError(path_ + ": cannot be opened: " + std::strerror(errno));
  Write(kTumHeader);
}

void TrajectoryStream::Add(const StampedPose& pose) { Write(TumRow(pose)); }

void TrajectoryStream::Write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() ||
      std::fflush(file_.get()) != 0) {
    throw OutputError(path_ + ": cannot be written: " + std::strerror(errno));
  }
}

}  // namespace slcmap::commands
