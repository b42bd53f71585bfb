// slcmap evaluate: an estimated trajectory against the true one.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/commands.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/trajectory_plots.h"
#include "apps/evaluation/trajectory_report.h"
#include "data/error.h"
#include "data/file.h"
#include "data/text_row.h"

namespace slcmap {
namespace {

struct EvaluateArguments {
  EvaluationInputs inputs;
  std::string json, plots;
  TrajectoryMetricOptions options;
};

// The stamps of the images beside a EuRoC ground truth (mav0/*/data.csv); empty where there are
// none.
std::string ImageStampsBeside(const std::string& truth) {
  const auto folder = std::filesystem::absolute(truth).parent_path().parent_path();
  const auto stamps = folder / "cam0" / "data.csv";
  std::error_code error;
  return std::filesystem::exists(stamps, error) ? stamps.lexically_normal().string() : "";
}

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

void Evaluate(EvaluateArguments arguments) {
  EvaluationInputs& inputs = arguments.inputs;
  const Trajectory truth = ReadTrajectory(inputs.truth);
  const Trajectory estimate = ReadTrajectory(inputs.estimate);
  if (inputs.stamps.empty()) inputs.stamps = ImageStampsBeside(inputs.truth);
  const std::vector<int64_t> stamps_ns =
      inputs.stamps.empty() ? std::vector<int64_t>() : ReadStamps(inputs.stamps);

  TrajectoryMetrics metrics;
  try {
    metrics = EvaluateTrajectory(truth, estimate, stamps_ns, arguments.options);
  } catch (const DataError& error) {
    throw DataError(fmt::format("{} against {}: {}", inputs.estimate, inputs.truth, error.what()));
  }
  std::fputs(TrajectoryTable(inputs, metrics).c_str(), stdout);
  if (!arguments.json.empty()) WriteFile(arguments.json, TrajectoryJson(inputs, metrics));
  if (arguments.plots.empty()) return;
  for (const std::string& path : WriteTrajectoryPlots(arguments.plots, metrics)) {
    spdlog::info("wrote {}", path);
  }
}

}  // namespace

void AddEvaluateCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("evaluate", "Compare a trajectory with the true one");
  const auto arguments = std::make_shared<EvaluateArguments>();
  command->add_option("--truth", arguments->inputs.truth, "True trajectory, TUM or EuRoC file")
      ->required();
  command
      ->add_option("--estimate", arguments->inputs.estimate,
                   "Estimated trajectory, TUM or EuRoC file")
      ->required();
  command->add_option("--stamps", arguments->inputs.stamps,
                      "File whose first column holds the stamps [ns] that should have a pose "
                      "(default: ../cam0/data.csv beside the truth, else the truth's)");
  command->add_option("--json", arguments->json, "Write the figures to this file");
  command->add_option("--plots", arguments->plots,
                      "Write top.svg, side.svg and error.svg into this folder");
  command
      ->add_option("--max-truth-gap", arguments->options.max_truth_gap_s,
                   "Longest gap [s] across which the truth is interpolated")
      ->capture_default_str();
  command->footer(
      "Example:\n  slcmap evaluate --truth SEQ/mav0/state_groundtruth_estimate0/data.csv \\\n"
      "      --estimate OUT/run/trajectory.tum --json metrics.json --plots plots");
  command->callback([arguments] { Evaluate(*arguments); });
}

}  // namespace slcmap
