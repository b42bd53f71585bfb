// slcmap register, and what other commands share with it.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/progress.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/csv.h"
#include "data/io/output_folder.h"
#include "mapping/align/map_agreement.h"
#include "mapping/map/map_folder.h"
#include "mapping/plan/plan_deviations.h"
#include "mapping/plan/plan_files.h"

namespace slcmap::inline commands {
namespace {

template <typename Row>
int Count(const std::vector<Row>& rows, PlanStatus status) {
  return static_cast<int>(
      std::ranges::count_if(rows, [&](const Row& row) { return row.status == status; }));
}

template <typename Row>
std::string InWords(const std::vector<Row>& rows) {
  return fmt::format("{} as planned, {} deviate, {} missing, {} new",
                     Count(rows, PlanStatus::kAsPlanned), Count(rows, PlanStatus::kDeviates),
                     Count(rows, PlanStatus::kMissing), Count(rows, PlanStatus::kNew));
}

constexpr double kMostDiffering = 0.5;  // of walls, against those that agree

void LogComparison(const PlanComparison& comparison) {
  const Eigen::Vector3d& p = comparison.T_plan_world.translation;
  spdlog::info(
      "{}: the map's origin is at {:.3f}, {:.3f} m, turned by {:.2f} degrees, known to {:.1f} mm; "
      "{:.0f} m of walls agree, {:.0f} m do not; the next best place fits {:.0f} % as well",
      comparison.plan, p.x(), p.y(), ComputeYaw(comparison.T_plan_world) / kDegree,
      1e3 * comparison.sigma_m, comparison.agreeing_m, comparison.differing_m,
      100 * comparison.rival_share);
  spdlog::info("{}: walls: {}; openings: {}", comparison.plan, InWords(comparison.walls),
               InWords(comparison.openings));
  if (comparison.differing_m > kMostDiffering * comparison.agreeing_m) {
    spdlog::warn(
        "{}: much of the map is not as planned: is it the plan of this floor, and in its "
        "scale?",
        comparison.plan);
  }
}

}  // namespace

CLI::Option* AddPlanOptions(CLI::App& command, PlanArguments* arguments) {
  CLI::Option* plan =
      command
          .add_option(
              "--plan", arguments->plan,
              "Floor plan that the map is placed in and held against: an image (dark walls, "
              "x right, y up, origin bottom left), DXF, IFC, GeoJSON in metres, or another "
              "map of the building")
          ->type_name("PLAN");
  command
      .add_option("--plan-pixel-m", arguments->pixel_m,
                  "Metres a pixel, of a plan that is an image")
      ->type_name("M")
      ->needs(plan);
  command
      .add_option(
          "--plan-at", arguments->at,
          "Rough place of the map's origin in the plan, and its turn: looked for within 2 m "
          "and 20 degrees of it")
      ->type_name("X,Y,YAW_DEG")
      ->needs(plan);
  return plan;
}

std::optional<RoughStart> ParseStart(const std::string& option, size_t lengths,
                                     const std::string& at) {
  constexpr double kFarthest_m = 1e5, kMostTurn_deg = 360;
  if (at.empty()) return std::nullopt;
  std::vector<double> values;
  for (const std::string& number : SplitAtCommas(at)) {
    values.push_back(ParseNumber(number).value_or(NAN));
  }
  RoughStart start;
  bool is_good = values.size() == lengths + 1 && std::abs(values.back()) <= kMostTurn_deg;
  for (size_t i = 0; is_good && i < lengths; ++i) {
    is_good = std::abs(values[i]) <= kFarthest_m;
    start.p_world[static_cast<Eigen::Index>(i)] = values[i];
  }
  if (!is_good) {
    throw ConfigError(fmt::format(
        "{}: found '{}', expected {}: {} numbers, metres of at most {:.0f} and degrees of at most "
        "{:.0f}",
        option, at, lengths == 3 ? "X,Y,Z,YAW_DEG" : "X,Y,YAW_DEG", lengths + 1, kFarthest_m,
        kMostTurn_deg));
  }
  start.yaw_rad = values.back() * kDegree;
  return start;
}

PlanStage::PlanStage(const PlanArguments& arguments)
    : arguments_(arguments), start_(ParseStart("--plan-at", 2, arguments.at)) {
  if (!arguments.plan.empty()) plans_ = ReadPlans(arguments.plan, arguments.pixel_m);
}

void PlanStage::Compare(const Progress& progress, MapResult* map) {
  map->plan.reset();
  if (plans_.empty()) return;
  try {
    map->plan = RegisterToPlan(*map, plans_, start_, progress);
    map->plan->plan = arguments_.plan;
    LogComparison(*map->plan);
  } catch (const StoppedError&) {
    throw;
  } catch (const DataError& error) {
    fault_ = fmt::format("{}: {}", arguments_.plan, error.what());
  }
}

void PlanStage::RequirePlaced() const {
  if (!fault_.empty()) throw DataError(fault_);
}

namespace {

struct RegisterArguments {
  std::string map, output;
  PlanArguments plan;
  bool accept_changed = false;
};

void Register(const RegisterArguments& arguments) {
  ExpectFolder(arguments.map, FolderKind::kMap);
  PlanStage plan(arguments.plan);
  OutputFolder output(arguments.output, MapFiles(), {arguments.map, arguments.plan.plan});
  MapResult map = ReadMapToShow(arguments.map, arguments.accept_changed);
  plan.Compare(StageProgress("register"), &map);
  plan.RequirePlaced();
  output.Open();
  WriteMapFolder(&output, map);
  spdlog::info("wrote {}: the map with {}", output.path(),
               fmt::join(kPlanComparisonFiles, " and "));
}

}  // namespace

void AddRegisterCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "register", "Place a map in a floor plan, and tell what was built otherwise");
  const auto arguments = std::make_shared<RegisterArguments>();
  command->add_option("map", arguments->map, "Map folder")->type_name("MAP")->required();
  AddPlanOptions(*command, &arguments->plan)->required();
  command->add_option("-o,--output", arguments->output, "Map folder to write, with the comparison")
      ->type_name("MAP")
      ->required();
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take a map whose files are not as map wrote them");
  command->footer(
      "Examples:\n  slcmap register OUT/map --plan floor.png --plan-pixel-m 0.01 -o PLACED\n"
      "  slcmap register TODAY/map --plan LAST_YEAR/map -o CHANGES\n\n"
      "Writes plan_deviations.csv and plan_comparison.json beside the map; export draws them.\n"
      "Where the map fits into the plan in several places about as well, or hardly anywhere,\n"
      "nothing is written and the exit code is 1.");
  command->callback([arguments] { Register(*arguments); });
}

}  // namespace slcmap::commands
