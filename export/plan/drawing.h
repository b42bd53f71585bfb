// What a plan is drawn with: filled areas, paths and texts. Coordinates are in a right-handed
// plane, y up; whether they are metres of the building or millimetres on paper, who holds a drawing
// says.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "data/core/polygon.h"
#include "export/scene/building_solids.h"
#include "mapping/map/building.h"

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

// Dimensions of a plan: which there are, and how one is drawn. Metres, in the plan's frame.

// The distance from one point to another, written beside a line that is parallel to it.
struct Dimension {
  Eigen::Vector2d from, to;
  double offset_m = 0;    // of the line, to the left of the direction from -> to
  double text_at = 0.5;   // where along the line the text stands, 0 to 1
  int text_row = 0;       // 0 on the line, as it is read; 1 above that; -1 under the line
  bool is_about = false;  // an end was not measured
  bool in_mm = false;     // the text is in millimetres

  double Length() const { return (to - from).norm(); }
  Eigen::Vector2d LineEnd() const;  // where the line ends, beside `to`
  // In metres and centimetres, or in millimetres; "~4.00" where it is about so long.
  std::string Text() const;
};

// "4.00" or, in millimetres, "4000".
std::string LengthText(double length_m, bool in_mm);

// How large texts of a plan are, and what lies around them: metres in the building.
struct PlanTextSizes {
  explicit PlanTextSizes(int scale, bool millimetres = false);
  double name_m, figure_m, small_m;  // heights of capitals: room names; dimensions, areas; openings
  double gap_m;                      // between a line and its text
  double row_m;                      // from one chain of dimensions to the next
  bool in_mm;                        // lengths are written in millimetres
};

// The line with its ticks, extension lines and the text. Heights are those of the text.
Drawing DrawDimension(const Dimension& dimension, const PlanTextSizes& sizes);

// The text alone, as it is read from below or from the right.
DrawnText DimensionText(const Dimension& dimension, const PlanTextSizes& sizes);

// Between opposite sides of a room, at least half a metre long and parallel within a degree, that
// walls stand at: one for each two, where there is room for it and no wall between them. What is
// placed is taken.
std::vector<Dimension> RoomDimensions(const Polygon& room, const PlanTextSizes& sizes,
                                      TakenPlaces* taken);

// What a chain of dimensions goes to: a side of a wall across it, or a height.
struct ChainMark {
  double at_m = 0;      // along the axis
  double weight_m = 0;  // of a wall, its length
  const PlanWall* wall = nullptr;
  bool assumed = false;  // nobody saw it
};

// A side of what is drawn, from which it is measured: along an axis (0 x, 1 y), and whether it is
// the upper one across that.
struct Outside {
  int axis = 0;
  bool upper = false;
};

// A chain outside of an extent and, of more than two marks, a second one from the first to the
// last. Of marks of two walls that lie too near for a text between them, the heavier are taken.
std::vector<Dimension> ChainsOutside(const Outside& outside, const Eigen::AlignedBox2d& extent,
                                     const std::vector<ChainMark>& marks,
                                     const PlanTextSizes& sizes);

// Chains on all four sides of walls and rooms: the sides of those walls across them that can be
// seen from there, and a second one from the first to the last. Of sides of walls that lie too near
// for a text between them, those of longer walls are taken; the two sides of one wall stay. Where
// one was not measured, they are about so long. Where no wall is along an axis, they are along the
// longest one.
std::vector<Dimension> OuterChains(std::vector<WallSolid> solids, std::vector<Polygon> rooms,
                                   const PlanTextSizes& sizes);

// How walls, openings and rooms are drawn in a plan, and what is written beside them.

// The areas of walls, those that were measured on both sides over the others, and the paths of
// their borders.
Drawing DrawWalls(const std::vector<WallSolid>& solids);

// Its name, if it has one, clear width, of others than passages its height, and of a window the
// sill's: "1.20 x 1.40 +0.90".
std::string OpeningText(const PlanOpening& opening, bool in_mm);

// Of a door that was walked through, its leaf and swing, at one hinge of two that it may have and
// into the room that it was seen from: which way doors open is not known. Of other doors the
// threshold, of windows the pane, of passages what is overhead.
Drawing OpeningSymbol(const WallSolid& solid, const PlanOpening& opening);

// Clear width, and height where it ends below the ceiling, of each opening, where there is room.
std::vector<DrawnText> OpeningTexts(const WallSolid& solid, const PlanTextSizes& sizes,
                                    TakenPlaces* taken);

// "W3 0.15" beside a wall: its number, which is its id, and thickness, "~" where that is assumed;
// without the thickness, or smaller, where there is no room for both.
std::vector<DrawnText> WallText(const WallSolid& solid, const PlanTextSizes& sizes,
                                TakenPlaces* taken);

// "sigma 4 mm" beside the back of a wall, where there is room.
std::vector<DrawnText> SigmaText(const WallSolid& solid, const PlanTextSizes& sizes,
                                 TakenPlaces* taken);

// What is written into the rooms of a plan.

// Name, area ("about" where a part of the border was not seen) and, where the ceiling was seen,
// height, one below the other, with how much of what was seen of the room the map holds, where that
// is little: at the place within the
// polygon that is farthest from its border among those with nothing in the way; smaller, or with
// fewer lines, in rooms that do not hold them. A room that does not hold its name has it nearby,
// with a line to it. What is placed is taken.
Drawing RoomLabel(const Room& room, const Polygon& polygon, const PlanTextSizes& sizes,
                  TakenPlaces* taken);

}  // namespace slcmap::exporting
