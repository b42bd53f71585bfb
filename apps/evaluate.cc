// slcmap evaluate: an estimated trajectory against the true one.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/commands.h"
#include "apps/evaluation/line_report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/trajectory_plots.h"
#include "apps/evaluation/trajectory_report.h"
#include "data/error.h"
#include "data/json_file.h"
#include "data/text_row.h"

namespace slcmap {
namespace {

struct EvaluateArguments {
  EvaluationInputs inputs;
  LineInputs lines;
  std::string json, plots;
  TrajectoryMetricOptions options;
  LineMetricOptions line_options;
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

TrajectoryMetrics MeasureTrajectory(const EvaluationInputs& inputs,
                                    const TrajectoryMetricOptions& options) {
  const Trajectory truth = ReadTrajectory(inputs.truth);
  const Trajectory estimate = ReadTrajectory(inputs.estimate);
  const std::vector<int64_t> stamps_ns =
      inputs.stamps.empty() ? std::vector<int64_t>() : ReadStamps(inputs.stamps);
  try {
    return EvaluateTrajectory(truth, estimate, stamps_ns, options);
  } catch (const DataError& error) {
    throw DataError(fmt::format("{} against {}: {}", inputs.estimate, inputs.truth, error.what()));
  }
}

// Compares the lines where they lie when the trajectory lies on the truth; prints the table and
// draws the plan.
Json EvaluateLineMap(const EvaluateArguments& arguments, const Alignment& alignment) {
  const LineInputs& inputs = arguments.lines;
  const TrueEdges truth = ReadTrueEdges(inputs.true_edges);
  const std::vector<MapLine> lines = Aligned(alignment, ReadMapLines(inputs.lines));
  const LineMetrics metrics = EvaluateLines(truth, lines, arguments.line_options);
  std::fputs(("\n" + LineTable(inputs, metrics)).c_str(), stdout);
  if (!arguments.plots.empty()) {
    MakeFolder(arguments.plots);
    const std::string plan = arguments.plots + "/lines.svg";
    WriteLinePlan(plan, truth, lines);
    spdlog::info("wrote {}", plan);
  }
  return LineJson(inputs, metrics);
}

void Evaluate(EvaluateArguments arguments) {
  EvaluationInputs& inputs = arguments.inputs;
  if (inputs.stamps.empty()) inputs.stamps = ImageStampsBeside(inputs.truth);
  const TrajectoryMetrics metrics = MeasureTrajectory(inputs, arguments.options);
  std::fputs(TrajectoryTable(inputs, metrics).c_str(), stdout);
  Json json = TrajectoryJson(inputs, metrics);
  if (!arguments.lines.lines.empty()) {
    json["lines"] = EvaluateLineMap(arguments, metrics.absolute.front().alignment);
  }
  if (!arguments.json.empty()) WriteJsonFile(arguments.json, json);
  if (arguments.plots.empty()) return;
  for (const std::string& path : WriteTrajectoryPlots(arguments.plots, metrics)) {
    spdlog::info("wrote {}", path);
  }
}

}  // namespace

void AddEvaluateCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare a trajectory, and mapped lines, with the true ones");
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
  CLI::Option* true_edges =
      command->add_option("--true-edges", arguments->lines.true_edges,
                          "True edges: edges.csv of a simulated sequence, or an edge-PLY");
  CLI::Option* lines = command->add_option(
      "--lines", arguments->lines.lines, "Mapped lines, an edge-PLY, in the world of the estimate");
  true_edges->needs(lines);
  lines->needs(true_edges);
  command->add_option("--json", arguments->json, "Write the figures to this file");
  command->add_option("--plots", arguments->plots,
                      "Write top.svg, side.svg, error.svg and lines.svg into this folder");
  command
      ->add_option("--max-truth-gap", arguments->options.max_truth_gap_s,
                   "Longest gap [s] across which the truth is interpolated")
      ->capture_default_str();
  command->footer(
      "Example:\n  slcmap evaluate --truth SEQ/mav0/state_groundtruth_estimate0/data.csv \\\n"
      "      --estimate OUT/run/trajectory.tum --json metrics.json --plots plots\n"
      "  slcmap evaluate --truth SEQ/truth/trajectory.tum --estimate RUN/trajectory.tum \\\n"
      "      --true-edges SEQ/truth/edges.csv --lines RUN/lines.ply");
  command->callback([arguments] { Evaluate(*arguments); });
}

}  // namespace slcmap
