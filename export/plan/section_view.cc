#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>

#include "data/core/error.h"
#include "data/io/yaml.h"
#include "export/plan/drawing.h"
#include "export/plan/section_drawing.h"
#include "export/scene/building_solids.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;

constexpr char kSides[] = "sides", kRooms[] = "rooms";

[[noreturn]] void RefuseSection(const std::string& text) {
  throw ConfigError(fmt::format(
      "section: found '{}', expected x=METRES or y=METRES (with ,back to look the other way), or "
      "the two ends of a line, X1,Y1:X2,Y2, at least 0.1 m apart, in the frame of the export, such "
      "as x=3.2 or 1,2:8,2",
      text));
}

// Numbers that are parted by that character, as many as are wanted; throws where they are not.
std::vector<double> ParseNumbers(const std::string& part, size_t count, const std::string& text) {
  std::vector<double> numbers;
  const char *at = part.data(), *end = at + part.size();
  while (numbers.size() < count) {
    double number = 0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc() || !(std::abs(number) <= 1e6)) RefuseSection(text);
    numbers.push_back(number);
    at = next;
    if (numbers.size() < count && (at == end || *at++ != ',')) RefuseSection(text);
  }
  if (at != end) RefuseSection(text);
  return numbers;
}

// Seen along an axis, to larger numbers or to smaller ones.
Vector2d GetRight(int axis, bool back) {
  const Vector2d right = axis == 0 ? Vector2d(0, -1) : Vector2d(1, 0);
  return back ? Vector2d(-right) : right;
}

SectionView AcrossAxis(const std::string& text) {
  constexpr char kBack[] = ",back";
  const int axis = text[0] == 'x' ? 0 : 1;
  const bool back = text.ends_with(kBack);
  const size_t end = text.size() - (back ? std::size(kBack) - 1 : 0);
  SectionView view;
  view.origin[axis] = ParseNumbers(text.substr(2, end - 2), 1, text)[0];
  view.right = GetRight(axis, back);
  view.place = fmt::format("{} = {:g}, seen towards {} {}", text[0], view.origin[axis],
                           back ? "smaller" : "larger", text[0]);
  return view;
}

SectionView BetweenPoints(const std::string& text) {
  constexpr double kLeast_m = 0.1;
  const size_t colon = text.find(':');
  if (colon == std::string::npos) RefuseSection(text);
  const std::vector<double> from = ParseNumbers(text.substr(0, colon), 2, text);
  const std::vector<double> to = ParseNumbers(text.substr(colon + 1), 2, text);
  SectionView view;
  view.origin = {from[0], from[1]};
  const Vector2d along = Vector2d(to[0], to[1]) - view.origin;
  if (along.norm() < kLeast_m) RefuseSection(text);
  view.right = along.normalized();
  view.from_m = 0;
  view.to_m = along.norm();
  view.place = fmt::format("From ({:g}, {:g}) to ({:g}, {:g})", from[0], from[1], to[0], to[1]);
  return view;
}

struct ViewSide {
  const char* name;  // on the plan
  int axis;          // along which one looks
  bool back;         // to smaller numbers
};
constexpr ViewSide kPlanSides[] = {
    {"left", 0, false}, {"right", 0, true}, {"bottom", 1, false}, {"top", 1, true}};

// The building's sides are named by where they are on the plan; one looks at them from outside.
SectionView OfSide(const ViewSide& side, const Eigen::AlignedBox2d& extent) {
  constexpr double kBefore_m = 1;
  SectionView view;
  view.name = fmt::format("elevation_{}", side.name);
  view.title = fmt::format("Elevation, {} side", side.name);
  view.place = fmt::format("The plan's {} side, from outside", side.name);
  view.right = GetRight(side.axis, side.back);
  view.origin[side.axis] =
      side.back ? extent.max()[side.axis] + kBefore_m : extent.min()[side.axis] - kBefore_m;
  return view;
}

// From the middle of a room to its walls, which are named by where they are on the plan.
SectionView OfRoomWall(const ViewSide& side, const Room& room, const Eigen::AlignedBox2d& extent) {
  constexpr double kAround_m = 0.3;  // so that walls beside it are cut, as far as they are thick
  const char* seen = kPlanSides[2 * side.axis + (side.back ? 0 : 1)].name;
  SectionView view;
  view.name = fmt::format("room_{}_{}", room.id + 1, seen);
  view.title = fmt::format("{}, {}", GetTitle(room), seen);
  view.place = fmt::format("Towards the plan's {}, from its middle", seen);
  view.right = GetRight(side.axis, side.back);
  view.origin[side.axis] = extent.center()[side.axis];
  const double a_m = view.At(extent.min()).x(), b_m = view.At(extent.max()).x();
  view.from_m = std::min(a_m, b_m) - kAround_m;
  view.to_m = std::max(a_m, b_m) + kAround_m;
  view.depth_m = 0.5 * extent.sizes()[side.axis] + kAround_m;
  view.storey = room.storey;
  return view;
}

// A plane that passes the building shows nothing.
void ExpectCut(const SectionView& view, const std::string& text,
               const Eigen::AlignedBox2d& extent) {
  Eigen::AlignedBox2d seen;
  for (const auto corner : {Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
                            Eigen::AlignedBox2d::TopLeft, Eigen::AlignedBox2d::TopRight}) {
    seen.extend(view.At(extent.corner(corner)));
  }
  const bool is_cut = seen.min().y() < 0 && seen.max().y() > 0 && seen.min().x() < view.to_m &&
                      seen.max().x() > view.from_m;
  if (is_cut) return;
  throw ConfigError(fmt::format(
      "section: found '{}', which passes the building, expected one through x {:.2f} to {:.2f} and "
      "y {:.2f} to {:.2f}, where it is in the frame of the export",
      text, extent.min().x(), extent.max().x(), extent.min().y(), extent.max().y()));
}

}  // namespace

SectionView ParseSection(const std::string& text, int number) {
  const bool across = text.starts_with("x=") || text.starts_with("y=");
  SectionView view = across ? AcrossAxis(text) : BetweenPoints(text);
  view.mark = fmt::format("{}", number);
  view.name = "section_" + view.mark;
  view.title = fmt::format("Section {0}-{0}", number);
  return view;
}

void CheckSections(const PlanOptions& options) {
  for (const std::string& text : options.sections) ParseSection(text, 1);
  for (const std::string& name : options.elevations) {
    if (name == kSides || name == kRooms) continue;
    throw ConfigError(fmt::format("elevations: found '{}', expected {} or {}{}", name, kSides,
                                  kRooms, DidYouMean(name, {kSides, kRooms})));
  }
}

void PlanOptions::Check() const {
  constexpr int kLargest = 1000000;
  if (scale < 0 || scale > kLargest) {
    throw ConfigError(fmt::format("plan scale: found 1:{}, expected 1:1 to 1:{}, or 0 to choose",
                                  scale, kLargest));
  }
  if (north_deg && !(std::abs(*north_deg) <= 360)) {
    throw ConfigError(
        fmt::format("plan north: found {} degrees, expected -360 to 360: clockwise "
                    "from up on the sheet",
                    *north_deg));
  }
  CheckSections(*this);
}

std::vector<SectionView> SectionViews(const Building& building, const PlanOptions& options) {
  CheckSections(options);
  std::vector<SectionView> views;
  if (options.sections.empty() && options.elevations.empty()) return views;
  const Eigen::AlignedBox2d extent = PlanExtent(building);
  if (extent.isEmpty()) {
    throw ConfigError(
        "section: found a map without walls and rooms, expected some to cut: export it without "
        "--section and --elevations");
  }
  for (const std::string& text : options.sections) {
    views.push_back(ParseSection(text, static_cast<int>(views.size()) + 1));
    ExpectCut(views.back(), text, extent);
  }
  const auto wants = [&](const char* name) {
    return std::find(options.elevations.begin(), options.elevations.end(), name) !=
           options.elevations.end();
  };
  for (const ViewSide& side : kPlanSides) {
    if (wants(kSides)) views.push_back(OfSide(side, extent));
  }
  for (const Room& room : building.rooms) {
    if (!wants(kRooms)) break;
    Eigen::AlignedBox2d of_room;
    for (const Vector2d& p : room.polygon.outline) of_room.extend(p);
    if (of_room.isEmpty()) continue;
    for (const ViewSide& side : kPlanSides) views.push_back(OfRoomWall(side, room, of_room));
  }
  return views;
}

}  // namespace slcmap::exporting
