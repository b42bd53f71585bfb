#include "export/plan/opening_symbols.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;

DrawnPath AlongWall(const WallSolid& solid, const PlanOpening& opening, double behind_m, Pen pen) {
  return {pen, {solid.At(opening.from_m, behind_m), solid.At(opening.to_m, behind_m)}};
}

// The leaf stands open at a right angle; the swing is a quarter of a circle.
std::vector<DrawnPath> LeafAndSwing(const WallSolid& solid, const PlanOpening& opening) {
  constexpr int kSteps = 24;
  const double width_m = opening.to_m - opening.from_m;
  DrawnPath swing = {Pen::kOverhead, {}};
  for (int i = 0; i <= kSteps; ++i) {
    const double angle_rad = M_PI / 2 * i / kSteps;
    swing.points.push_back(
        solid.At(opening.from_m + width_m * std::cos(angle_rad), -width_m * std::sin(angle_rad)));
  }
  return {{Pen::kOpening, {solid.At(opening.from_m, 0), swing.points.back()}}, swing};
}

// Along the wall, that far behind its face (negative: before it), as it is read.
DrawnText TextAlong(const WallSolid& solid, const std::string& text, double along_m,
                    double behind_m, double height_m) {
  const double angle_rad = ReadableAngle(solid.Direction());
  const Vector2d up(-std::sin(angle_rad), std::cos(angle_rad));
  return {text, solid.At(along_m, behind_m) - 0.5 * height_m * up, height_m, angle_rad};
}

// The first place beside the wall, behind it or before, at which nothing is in the way.
std::vector<DrawnText> PlaceBeside(const WallSolid& solid, const std::string& text,
                                   const std::vector<double>& places_m, const PlanTextSizes& sizes,
                                   TakenPlaces* taken) {
  const double clear_m = sizes.gap_m + 0.5 * sizes.small_m;
  for (const double behind_m : {solid.Thickness() + clear_m, -clear_m}) {
    for (const double along_m : places_m) {
      const DrawnText placed = TextAlong(solid, text, along_m, behind_m, sizes.small_m);
      if (!taken->HasRoomForText(MakeBox(placed))) continue;
      taken->AddText(MakeBox(placed));
      return {placed};
    }
  }
  return {};
}

std::vector<double> PlacesAlong(const WallSolid& solid) {
  std::vector<double> places_m;
  for (const double share : {0.5, 0.35, 0.65, 0.2, 0.8, 0.1, 0.9}) {
    places_m.push_back(share * solid.Length());
  }
  return places_m;
}

}  // namespace

Drawing DrawWalls(const std::vector<WallSolid>& solids) {
  std::vector<WallSolid> measured;
  for (const WallSolid& solid : solids) {
    if (!solid.wall->thickness_assumed) measured.push_back(solid);
  }
  Drawing drawing;
  for (Polygon& area : WallAreas(solids)) drawing.areas.push_back({Fill::kAssumed, area});
  for (Polygon& area : WallAreas(measured)) drawing.areas.push_back({Fill::kWall, area});
  for (const WallEdge& edge : WallEdges(solids)) {
    drawing.paths.push_back({edge.assumed ? Pen::kAssumed : Pen::kWall, {edge.start, edge.end}});
  }
  return drawing;
}

std::string OpeningText(const PlanOpening& opening, bool in_mm) {
  const double width_m = opening.to_m - opening.from_m;
  if (opening.kind == OpeningKind::kPassage) return LengthText(width_m, in_mm);
  const std::string size =
      LengthText(width_m, in_mm) + " x " + LengthText(opening.clear_height_m, in_mm);
  if (opening.kind == OpeningKind::kDoor) return size;
  return size + " +" + LengthText(opening.sill_m, in_mm);
}

Drawing OpeningSymbol(const WallSolid& solid, const PlanOpening& opening) {
  const double behind_m = solid.Thickness();
  const Pen pen = opening.kind == OpeningKind::kPassage ? Pen::kOverhead : Pen::kOpening;
  Drawing drawing;
  if (opening.kind == OpeningKind::kDoor && opening.walked) {
    drawing.paths = LeafAndSwing(solid, opening);
    return drawing;
  }
  drawing.paths = {AlongWall(solid, opening, 0, pen), AlongWall(solid, opening, behind_m, pen)};
  if (opening.kind == OpeningKind::kWindow) {
    drawing.paths.push_back(AlongWall(solid, opening, 0.5 * behind_m, pen));
  }
  return drawing;
}

std::vector<DrawnText> OpeningTexts(const WallSolid& solid, const PlanTextSizes& sizes,
                                    TakenPlaces* taken) {
  std::vector<DrawnText> texts;
  for (const PlanOpening& opening : solid.wall->openings) {
    const double middle_m = 0.5 * (opening.from_m + opening.to_m);
    const double aside_m = 0.5 * (opening.to_m - opening.from_m);
    const auto placed =
        PlaceBeside(solid, OpeningText(opening, sizes.in_mm),
                    {middle_m, middle_m - aside_m, middle_m + aside_m}, sizes, taken);
    texts.insert(texts.end(), placed.begin(), placed.end());
  }
  return texts;
}

std::vector<DrawnText> WallText(const WallSolid& solid, const PlanTextSizes& sizes,
                                TakenPlaces* taken) {
  const PlanWall& wall = *solid.wall;
  const std::string name = fmt::format("W{}", wall.id);
  const std::string text = fmt::format("{} {}{}", name, wall.thickness_assumed ? "~" : "",
                                       LengthText(wall.thickness_m, sizes.in_mm));
  const std::vector<double> places_m = PlacesAlong(solid);
  PlanTextSizes small = sizes;
  small.small_m *= 0.7;
  std::vector<DrawnText> placed = PlaceBeside(solid, text, places_m, sizes, taken);
  if (placed.empty()) placed = PlaceBeside(solid, name, places_m, sizes, taken);
  if (placed.empty()) placed = PlaceBeside(solid, name, places_m, small, taken);
  return placed;
}

std::vector<DrawnText> SigmaText(const WallSolid& solid, const PlanTextSizes& sizes,
                                 TakenPlaces* taken) {
  const std::string text = fmt::format("\u03c3 {:.0f} mm", 1e3 * solid.wall->sigma_m);
  return PlaceBeside(solid, text, PlacesAlong(solid), sizes, taken);
}

}  // namespace slcmap
