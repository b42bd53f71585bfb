#include "export/plan/drawing.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace slcmap::inline exporting {
namespace {

void Place(PlanPoints* points, double scale, const Eigen::Vector2d& offset) {
  for (Eigen::Vector2d& point : *points) point = scale * point + offset;
}

}  // namespace

void Drawing::Add(const Drawing& other) {
  Append(other.areas, &areas);
  Append(other.paths, &paths);
  Append(other.texts, &texts);
}

Drawing Placed(const Drawing& drawing, double scale, const Eigen::Vector2d& offset) {
  Drawing placed = drawing;
  for (DrawnArea& area : placed.areas) {
    Place(&area.polygon.outline, scale, offset);
    for (PlanPoints& hole : area.polygon.holes) Place(&hole, scale, offset);
  }
  for (DrawnPath& path : placed.paths) Place(&path.points, scale, offset);
  for (DrawnText& text : placed.texts) {
    text.position = scale * text.position + offset;
    text.height *= scale;
  }
  return placed;
}

double ReadableAngle(const Eigen::Vector2d& direction) {
  constexpr double kSlack_rad = 0.05;  // what is about upright is read from the right
  const double angle_rad = std::atan2(direction.y(), direction.x());
  if (angle_rad > M_PI / 2 + kSlack_rad) return angle_rad - M_PI;
  if (angle_rad <= -M_PI / 2 + kSlack_rad) return angle_rad + M_PI;
  return angle_rad;
}

double TextWidth(const std::string& text, double height) {
  constexpr double kWidthOfACharacter = 0.87;  // DejaVu Sans, among the widest, over its capitals
  const auto characters = std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;  // what goes on in UTF-8 does not count
  });
  return kWidthOfACharacter * height * static_cast<double>(characters);
}

namespace {

using Eigen::Vector2d;

Vector2d Axis(const Box& box, int index) {
  const double angle_rad = box.angle_rad + (index == 0 ? 0 : M_PI / 2);
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

double HalfAlong(const Box& box, const Vector2d& direction) {
  return box.half.x() * std::abs(Axis(box, 0).dot(direction)) +
         box.half.y() * std::abs(Axis(box, 1).dot(direction));
}

bool Parted(const Box& a, const Box& b, const Vector2d& direction) {
  const double between = std::abs((b.centre - a.centre).dot(direction));
  return between >= HalfAlong(a, direction) + HalfAlong(b, direction);
}

bool IsFree(const std::vector<Box>& taken, const Box& box) {
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Box& other) { return Overlap(other, box); });
}

}  // namespace

bool Overlap(const Box& a, const Box& b) {
  for (const int index : {0, 1}) {
    if (Parted(a, b, Axis(a, index)) || Parted(a, b, Axis(b, index))) return false;
  }
  return true;
}

Box MakeBox(const DrawnText& text) {
  constexpr double kAround = 0.3;  // of its height
  const Vector2d up(-std::sin(text.angle_rad), std::cos(text.angle_rad));
  return {text.position + 0.5 * text.height * up,
          {0.5 * TextWidth(text.text, text.height), (0.5 + kAround) * text.height},
          text.angle_rad};
}

Box MakeBox(const Vector2d& start, const Vector2d& end, double reach) {
  const Vector2d along = end - start;
  return {0.5 * (start + end), {0.5 * along.norm(), reach}, std::atan2(along.y(), along.x())};
}

bool TakenPlaces::HasRoomForText(const Box& box) const {
  return IsFree(texts_, box) && IsFree(lines_, box) && IsFree(walls_, box);
}

bool TakenPlaces::HasRoomForLine(const Box& box, double into_walls) const {
  Box within = box;
  within.half.x() = std::max(0.0, box.half.x() - into_walls);
  return IsFree(texts_, box) && IsFree(walls_, within);
}

bool TakenPlaces::IsAtWall(const Vector2d& point, double reach) const {
  return !IsFree(walls_, {point, {reach, reach}, 0});
}

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
  const std::string name = opening.name.empty() ? "" : opening.name + " ";
  if (opening.kind == OpeningKind::kPassage) return name + LengthText(width_m, in_mm);
  const std::string size =
      name + LengthText(width_m, in_mm) + " x " + LengthText(opening.clear_height_m, in_mm);
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

namespace {

double DistanceToRing(const PlanPoints& ring, const Vector2d& point) {
  double least_m = std::numeric_limits<double>::infinity();
  for (size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vector2d along = ring[i] - ring[j];
    const double length2 = along.squaredNorm();
    const double at =
        length2 > 0 ? std::clamp((point - ring[j]).dot(along) / length2, 0.0, 1.0) : 0;
    least_m = std::min(least_m, (ring[j] + at * along - point).norm());
  }
  return least_m;
}

double DistanceToBorder(const Polygon& polygon, const Vector2d& point) {
  double least_m = DistanceToRing(polygon.outline, point);
  for (const PlanPoints& hole : polygon.holes) {
    least_m = std::min(least_m, DistanceToRing(hole, point));
  }
  return least_m;
}

// Places within a polygon, those farthest from its border first; of places that are about as far
// from it, those nearest to its middle.
std::vector<Vector2d> Places(const Polygon& polygon) {
  constexpr int kSteps = 40;
  constexpr double kAlike_m = 0.05;
  Eigen::AlignedBox2d extent;
  for (const Vector2d& point : polygon.outline) extent.extend(point);
  std::vector<std::pair<std::pair<double, double>, Vector2d>> ranked;
  for (int i = 1; i < kSteps; ++i) {
    for (int j = 1; j < kSteps; ++j) {
      const Vector2d at(static_cast<double>(i) / kSteps, static_cast<double>(j) / kSteps);
      const Vector2d place = extent.min() + extent.sizes().cwiseProduct(at);
      if (!Contains(polygon, place)) continue;
      const double rank = -std::floor(DistanceToBorder(polygon, place) / kAlike_m);
      ranked.push_back({{rank, (place - extent.center()).norm()}, place});
    }
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Vector2d> places;
  for (const auto& [rank, place] : ranked) places.push_back(place);
  if (places.empty()) places.push_back(extent.center());  // thinner than what was looked at
  return places;
}

// The lines around a middle.
std::vector<DrawnText> Stacked(const std::vector<std::string>& lines, const Vector2d& middle,
                               const PlanTextSizes& sizes, double shrunk) {
  const double name_m = shrunk * sizes.name_m, figure_m = shrunk * sizes.figure_m;
  const double gap_m = 0.7 * figure_m;
  const double height_m = name_m + static_cast<double>(lines.size() - 1) * (figure_m + gap_m);
  double base_m = 0.5 * height_m - name_m;
  std::vector<DrawnText> texts;
  for (const std::string& line : lines) {
    texts.push_back({line, middle + Vector2d(0, base_m), texts.empty() ? name_m : figure_m});
    base_m -= figure_m + gap_m;
  }
  return texts;
}

bool Fits(const std::vector<DrawnText>& texts, const Polygon& polygon, const TakenPlaces& taken) {
  return std::all_of(texts.begin(), texts.end(), [&](const DrawnText& text) {
    const Box box = MakeBox(text);
    for (const double x : {-1, 1}) {
      for (const double y : {-1, 1}) {
        if (!Contains(polygon, box.centre + box.half.cwiseProduct(Vector2d(x, y)))) return false;
      }
    }
    return taken.HasRoomForText(box);
  });
}

// A name that is not in its room: in the first free place around it.
Drawing LabelBeside(const std::string& name, const Vector2d& room, double height_m,
                    const TakenPlaces& taken) {
  constexpr int kRings = 12, kDirections = 16;
  DrawnText text = {name, room, height_m};
  for (int i = 0; i < kRings * kDirections; ++i) {
    const double turn_rad = 2 * M_PI * (i % kDirections) / kDirections;
    const double away_m = (2 + i / kDirections) * height_m;
    const Vector2d direction(std::cos(turn_rad), std::sin(turn_rad));
    text.position = room + away_m * direction.cwiseProduct(Vector2d(2, 1));
    if (taken.HasRoomForText(MakeBox(text))) break;
  }
  const Vector2d under = text.position - Vector2d(0, 0.3 * height_m);
  return {{}, {{Pen::kDimension, {room, under}}}, {text}};
}

std::string AreaText(const Room& room) {
  constexpr double kWhollySeen = 0.85;  // what is missing there is doors and corners
  return fmt::format("{}{:.2f} m\u00b2", room.bounded < kWhollySeen ? "about " : "", room.area_m2);
}

}  // namespace

Drawing RoomLabel(const Room& room, const Polygon& polygon, const PlanTextSizes& sizes,
                  TakenPlaces* taken) {
  constexpr double kSmallest = 0.6;
  constexpr double kWellHeld = 0.8;  // of what was seen, of which nothing is said
  std::vector<std::string> lines = {GetTitle(room), AreaText(room)};
  if (room.seen_share && *room.seen_share < kWellHeld) {
    lines.push_back(fmt::format("{:.0f} % of what was seen", 100 * *room.seen_share));
  }
  if (room.height_m) lines.push_back("h " + LengthText(*room.height_m, sizes.in_mm));
  const std::vector<Vector2d> places = Places(polygon);
  Drawing label;
  const auto find = [&](double shrunk) {
    for (const Vector2d& place : places) {
      const std::vector<DrawnText> texts = Stacked(lines, place, sizes, shrunk);
      if (!Fits(texts, polygon, *taken)) continue;
      label.texts = texts;
      return true;
    }
    return false;
  };
  while (!find(1) && !find(kSmallest) && lines.size() > 1) lines.pop_back();
  if (label.texts.empty()) {
    label = LabelBeside(lines[0], places.front(), kSmallest * sizes.name_m, *taken);
  }
  for (const DrawnText& text : label.texts) taken->AddText(MakeBox(text));
  return label;
}

}  // namespace slcmap::exporting
