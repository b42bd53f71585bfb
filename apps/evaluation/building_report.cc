#include "apps/evaluation/building_report.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "apps/evaluation/no_figure.h"
#include "apps/evaluation/svg_plot.h"
#include "data/file.h"

namespace slcmap {
namespace {

using Json = nlohmann::ordered_json;

std::string Percent(int64_t part, int64_t all) { return FigureText(100 * ComputeShare(part, all), 1); }

void AddSide(const Eigen::Vector2d& a, const Eigen::Vector2d& b, SvgSeries* series) {
  series->points.push_back(a);
  series->points.push_back(b);
}

void AddOutline(const PlanPoints& outline, SvgSeries* series) {
  for (size_t i = 0; i < outline.size(); ++i) {
    AddSide(outline[i], outline[(i + 1) % outline.size()], series);
  }
}

// The foot of an upright rectangle: its first side.
void AddFoot(const std::vector<Eigen::Vector3d>& outline, SvgSeries* series) {
  AddSide(outline[0].head<2>(), outline[1].head<2>(), series);
}

}  // namespace

std::string BuildingTable(const BuildingInputs& inputs, const BuildingMetrics& metrics) {
  std::string text = fmt::format("building  {}, {}\n\n", inputs.true_building, inputs.planes);
  text +=
      fmt::format("walls     {} of {} found ({} %), offset {} m median, {} m 95 %\n",
                  metrics.walls_found, metrics.walls, Percent(metrics.walls_found, metrics.walls),
                  FigureText(metrics.offset_median_m, 4), FigureText(metrics.offset_95_m, 4));
  text += fmt::format("distances {} between opposite walls, error {} m 95 %\n", metrics.distances,
                      FigureText(metrics.distance_error_95_m, 4));
  text += fmt::format("intervals {} of {} hold the truth ({} %)\n", metrics.intervals_held,
                      metrics.intervals, Percent(metrics.intervals_held, metrics.intervals));
  text += fmt::format(
      "openings  {} of {} found, {} false, F1 {} %, clear width off by {} m median\n",
      metrics.openings_found, metrics.openings, metrics.openings_false,
      FigureText(100 * metrics.openings_f1, 1), FigureText(metrics.clear_width_median_m, 3));
  text += fmt::format(
      "rooms     {} of {} found, {} with the right area, off by {} % median; {} mapped\n",
      metrics.rooms_found, metrics.rooms, metrics.rooms_right,
      FigureText(100 * metrics.area_error_median, 2), metrics.rooms_mapped);
  return text;
}

Json BuildingJson(const BuildingInputs& inputs, const BuildingMetrics& metrics) {
  return {{"planes", inputs.planes},
          {"true_building", inputs.true_building},
          {"walls", metrics.walls},
          {"walls_found", metrics.walls_found},
          {"offset_median_m", metrics.offset_median_m},
          {"offset_95_m", metrics.offset_95_m},
          {"distances", metrics.distances},
          {"distance_error_95_m", metrics.distance_error_95_m},
          {"intervals", metrics.intervals},
          {"intervals_held", metrics.intervals_held},
          {"openings", metrics.openings},
          {"openings_found", metrics.openings_found},
          {"openings_false", metrics.openings_false},
          {"openings_f1", metrics.openings_f1},
          {"clear_width_median_m", metrics.clear_width_median_m},
          {"rooms", metrics.rooms},
          {"rooms_found", metrics.rooms_found},
          {"rooms_right", metrics.rooms_right},
          {"rooms_mapped", metrics.rooms_mapped},
          {"area_error_median", metrics.area_error_median}};
}

void WriteBuildingPlan(const std::string& path, const TrueBuilding& truth,
                       const Building& building) {
  SvgSeries true_walls{"true walls", "#bbbbbb", {}, SvgStyle::kSegments};
  SvgSeries rooms{"rooms", "#2c7fb8", {}, SvgStyle::kSegments};
  SvgSeries walls{"walls", "#222222", {}, SvgStyle::kSegments};
  SvgSeries others{"other planes", "#f0a030", {}, SvgStyle::kSegments};
  SvgSeries openings{"openings", "#d7301f", {}, SvgStyle::kSegments};
  for (const TrueWall& wall : truth.walls) AddFoot(wall.outline_world, &true_walls);
  for (const Room& room : building.rooms) {
    AddOutline(room.polygon.outline, &rooms);
    for (const PlanPoints& hole : room.polygon.holes) AddOutline(hole, &rooms);
  }
  for (const BuildingPlane& plane : building.planes) {
    if (plane.kind == PlaneKind::kWall) AddFoot(plane.outline_world, &walls);
    if (plane.kind == PlaneKind::kOther) AddFoot(plane.outline_world, &others);
    for (const PlaneOpening& opening : plane.openings) AddFoot(opening.outline_world, &openings);
  }
  SvgPlot plot{"Mapped building over the true one, from above", "x [m]", "y [m]", true, {}};
  for (const SvgSeries& series : {true_walls, rooms, others, walls, openings}) {
    if (!series.points.empty()) plot.series.push_back(series);
  }
  WriteFile(path, DrawSvg(plot));
}

}  // namespace slcmap
