// What a plan is drawn with: filled areas, paths and texts. Coordinates are in a right-handed
// plane, y up; whether they are metres of the building or millimetres on paper, who holds a drawing
// says.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "data/core/polygon.h"

namespace slcmap::inline exporting {

enum class Pen {
  kWall,      // what was measured of walls
  kAssumed,   // the back of walls that were seen from one side
  kOpening,   // leaves, panes, thresholds
  kOverhead,  // what is above the cut: lintels of passages
  kRoom,      // the border of a room, where no wall hides it
  kDimension,
  kFrame,
  kBeyond,       // of sections: what is seen beyond the cut
  kLine,         // mapped lines there
  kSectionLine,  // where a plan is cut by sections
  kPlanned,      // where walls were planned that are elsewhere
};
enum class Fill { kAssumed, kWall, kInk };  // in the order in which they are laid over each other

// How lines of a pen look on paper; dashes of length 0 are none.
struct PenStyle {
  const char* name;
  double width_mm;
  double dash_mm, gap_mm;
};
inline constexpr std::array<PenStyle, 11> kPenStyles = {{{"walls", 0.5, 0, 0},
                                                         {"assumed", 0.25, 1.4, 0.9},
                                                         {"openings", 0.25, 0, 0},
                                                         {"overhead", 0.18, 0.9, 0.9},
                                                         {"rooms", 0.18, 0.3, 0.9},
                                                         {"dimensions", 0.18, 0, 0},
                                                         {"frame", 0.35, 0, 0},
                                                         {"beyond", 0.25, 0, 0},
                                                         {"lines", 0.09, 0, 0},
                                                         {"section_lines", 0.35, 5, 1.5},
                                                         {"planned", 0.25, 0.7, 0.7}}};

struct FillStyle {
  const char* name;
  double grey;  // 0 black to 1 white
};
inline constexpr std::array<FillStyle, 3> kFillStyles = {
    {{"assumed_areas", 0.88}, {"wall_areas", 0.62}, {"ink", 0}}};

// Height of capitals over the size of a font, in DejaVu Sans and about so in others.
inline constexpr double kCapitalOfFont = 0.729;

struct DrawnArea {
  Fill fill = Fill::kWall;
  Polygon polygon;
};

struct DrawnPath {
  Pen pen = Pen::kWall;
  PlanPoints points;
};

enum class Align { kCentre, kLeft };

// A line of text (UTF-8); it stands on a line through `position`, from which it is turned.
struct DrawnText {
  std::string text;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double height = 0;  // of capitals
  double angle_rad = 0;
  Align align = Align::kCentre;
};

template <typename Part>
void Append(const std::vector<Part>& parts, std::vector<Part>* all) {
  all->insert(all->end(), parts.begin(), parts.end());
}

struct Drawing {
  std::vector<DrawnArea> areas;
  std::vector<DrawnPath> paths;
  std::vector<DrawnText> texts;

  void Add(const Drawing& other);
};

// A drawing moved and scaled: p -> scale * p + offset.
Drawing Placed(const Drawing& drawing, double scale, const Eigen::Vector2d& offset);

// The angle of a text along a direction, so that it is read from below or from the right.
double ReadableAngle(const Eigen::Vector2d& direction);

// How wide a text is drawn at most, in common sans serif faces.
double TextWidth(const std::string& text, double height);

// Which places of a drawing are taken, so that texts do not lie over each other.

// A rectangle, in the drawing's unit.
struct Box {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d half = Eigen::Vector2d::Zero();  // along its own axes
  double angle_rad = 0;                            // from x to the first of them
};

bool Overlap(const Box& a, const Box& b);

// Around a centred text.
Box MakeBox(const DrawnText& text);

// Around a line, that far at each side.
Box MakeBox(const Eigen::Vector2d& start, const Eigen::Vector2d& end, double reach);

// Lines may cross lines, but neither texts nor walls; texts keep clear of everything.
class TakenPlaces {
 public:
  void AddWall(const Box& box) { walls_.push_back(box); }
  void AddText(const Box& box) { texts_.push_back(box); }
  void AddLine(const Box& box) { lines_.push_back(box); }

  bool HasRoomForText(const Box& box) const;
  // Both ends may reach into a wall by that much.
  bool HasRoomForLine(const Box& box, double into_walls) const;

  // Whether a wall is no farther from a point than that.
  bool IsAtWall(const Eigen::Vector2d& point, double reach) const;

 private:
  std::vector<Box> texts_, lines_, walls_;
};

}  // namespace slcmap::exporting
