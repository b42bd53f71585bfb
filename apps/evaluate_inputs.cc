#include "apps/evaluate_inputs.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "apps/commands.h"
#include "apps/evaluation/estimate_finding.h"
#include "data/error.h"
#include "data/text_row.h"

namespace slcmap {
namespace {

// The first column of a file such as cam0/data.csv, in nanoseconds.
std::vector<int64_t> ReadStamps(const std::string& path) {
  std::vector<int64_t> stamps_ns;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    const std::optional<int64_t> stamp_ns = ParseScaledInteger(fields[0], 0);
    if (!stamp_ns || (!stamps_ns.empty() && *stamp_ns <= stamps_ns.back())) {
      throw DataError(
          fmt::format("{}: row {}: found '{}', expected a stamp in nanoseconds after that "
                      "of the row before",
                      path, row, fields[0]));
    }
    stamps_ns.push_back(*stamp_ns);
  });
  if (stamps_ns.empty()) throw DataError(path + ": found no stamp, expected at least one row");
  return stamps_ns;
}

PoseForm FormOf(const EvaluationInputs& inputs, const char* file) {
  return inputs.form_of == file ? inputs.form : PoseForm();
}

// Rows without stamps are those of the images, or of the truth.
PoseTable ReadAtStamps(const std::string& path, const PoseForm& form, const Clock& images_ns,
                       const Clock& truth_ns) {
  if (images_ns.empty()) return ReadPoseTable(path, form, truth_ns, false);
  try {
    return ReadPoseTable(path, form, images_ns);
  } catch (const DataError&) {
    return ReadPoseTable(path, form, truth_ns, false);
  }
}

TrajectoryMetrics MeasureTrajectory(EvaluationInputs* inputs,
                                    const TrajectoryMetricOptions& options) {
  const Trajectory truth = ReadTruth(*inputs);
  const ReadEstimate estimate = EstimateOf(*inputs, truth);
  const std::vector<int64_t> stamps_ns =
      inputs->stamps.empty() ? std::vector<int64_t>() : ReadStamps(inputs->stamps);
  inputs->finding = FindOtherForm(estimate.table, estimate.form, truth, [&] {
                      return FindCameraPose(inputs->calibration, inputs->truth);
                    }).value_or("");
  try {
    return EvaluateTrajectory(truth, estimate.poses, stamps_ns, options);
  } catch (const DataError& error) {
    throw DataError(fmt::format("{} against {}: {}{}", inputs->estimate, inputs->truth,
                                error.what(),
                                inputs->finding.empty() ? "" : "; " + inputs->finding));
  }
}

// Reading takes several times a file's size.
void CheckTrajectoryFile(const std::string& path) {
  constexpr uintmax_t kMaxBytes = 300000000;  // some three million poses
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw DataError(path + ": found a folder, expected a trajectory file (TUM or EuRoC)");
  }
  const uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error || bytes <= kMaxBytes) return;  // what is wrong with it, reading says
  throw DataError(fmt::format(
      "{}: found {} bytes, expected at most {}: a trajectory of some three million poses", path,
      bytes, kMaxBytes));
}

}  // namespace

std::string ImageStampsBeside(const std::string& truth) {
  const auto folder = std::filesystem::absolute(truth).parent_path().parent_path();
  const auto stamps = folder / "cam0" / "data.csv";
  std::error_code error;
  return std::filesystem::exists(stamps, error) ? stamps.lexically_normal().string() : "";
}

std::string CalibrationBeside(const std::string& estimate) {
  const auto folder = std::filesystem::path(estimate).parent_path();
  const auto table = folder / "calibration.csv";
  std::error_code error;
  const bool is_run = std::filesystem::exists(folder / "run.json", error);
  return is_run && std::filesystem::exists(table, error) ? table.string() : "";
}

Trajectory ReadTruth(const EvaluationInputs& inputs) {
  const PoseForm form = FormOf(inputs, "truth");
  const Clock images_ns = inputs.stamps.empty() ? Clock() : ReadStamps(inputs.stamps);
  return PosesOf(ReadPoseTable(inputs.truth, form, images_ns), form,
                 form.IsOfCamera() ? FindCameraPose(inputs.calibration, inputs.truth) : std::nullopt);
}

ReadEstimate EstimateOf(const EvaluationInputs& inputs, const Trajectory& truth) {
  ReadEstimate estimate;
  estimate.form = FormOf(inputs, "estimate");
  Clock truth_ns;
  for (const StampedPose& pose : truth) truth_ns.push_back(pose.stamp_ns);
  estimate.table =
      ReadAtStamps(inputs.estimate, estimate.form,
                   inputs.stamps.empty() ? Clock() : ReadStamps(inputs.stamps), truth_ns);
  estimate.poses = PosesOf(
      estimate.table, estimate.form,
      estimate.form.IsOfCamera() ? FindCameraPose(inputs.calibration, inputs.truth) : std::nullopt);
  return estimate;
}

TrajectoryMetrics CompareTrajectories(EvaluationInputs* inputs,
                                      const TrajectoryMetricOptions& options) {
  const EndsAtOnce nothing_is_written;
  options.Check();
  for (const std::string& path : {inputs->truth, inputs->estimate}) CheckTrajectoryFile(path);
  return MeasureTrajectory(inputs, options);
}

}  // namespace slcmap
