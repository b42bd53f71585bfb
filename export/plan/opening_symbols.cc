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

std::string TextOf(const PlanOpening& opening) {
  const double width_m = opening.to_m - opening.from_m;
  if (opening.kind == OpeningKind::kPassage) return fmt::format("{:.2f}", width_m);
  const std::string size = fmt::format("{:.2f} x {:.2f}", width_m, opening.clear_height_m);
  if (opening.kind == OpeningKind::kDoor) return size;
  return fmt::format("{} +{:.2f}", size, opening.sill_m);
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
      if (!taken->HasRoomForText(BoxOf(placed))) continue;
      taken->AddText(BoxOf(placed));
      return {placed};
    }
  }
  return {};
}

}  // namespace

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
    const auto placed = PlaceBeside(
        solid, TextOf(opening), {middle_m, middle_m - aside_m, middle_m + aside_m}, sizes, taken);
    texts.insert(texts.end(), placed.begin(), placed.end());
  }
  return texts;
}

std::vector<DrawnText> SigmaText(const WallSolid& solid, const PlanTextSizes& sizes,
                                 TakenPlaces* taken) {
  const std::string text = fmt::format("\u03c3 {:.0f} mm", 1e3 * solid.wall->sigma_m);
  const double length_m = solid.Length();
  return PlaceBeside(solid, text, {0.5 * length_m, 0.35 * length_m, 0.65 * length_m}, sizes, taken);
}

}  // namespace slcmap
