#include "apps/run_recorder.h"

#include <algorithm>
#include <utility>

namespace slcmap {
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

}  // namespace slcmap
