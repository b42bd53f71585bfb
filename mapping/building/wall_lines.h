// The lines of walls in the plan, each in parts: a wall, an opening of one, open; and what lies
// between the two faces of a wall.
#pragma once

#include <optional>
#include <vector>

#include "mapping/building/options.h"
#include "mapping/building/rooms.h"

namespace slcmap::inline mapping {

inline constexpr double kPlanGrid_m = 5e-4;  // of the points of a plan

struct WallPart {
  double from_m = 0, to_m = 0;  // along the face
  bool is_wall = false;         // seen, or as what is beside it
  bool parts_rooms = false;     // a wall, or an opening of one
  bool is_measured = false;

  int Rank() const { return is_wall + parts_rooms + is_measured; }
  bool IsLike(const WallPart& other) const { return Rank() == other.Rank(); }
};

struct WallLine {
  const WallFace* wall = nullptr;
  std::vector<WallPart> parts;  // one after the other, the first and last beyond the face

  PlanPoints Chain() const;
};

// Lines extended at both ends beyond the first wall that goes across, or by 30 m. Their parts are
// what costs least by what was measured: where rays went through, there is no wall; openings are
// narrow; a wall begins and ends at others; what was not seen is as what is beside it.
std::vector<WallLine> CollectLines(const std::vector<WallFace>& walls, const FreeSpace& free,
                                   const BuildingOptions& options);

// The part of any of the lines that is most of a wall along a piece; nothing where it is on none.
std::optional<WallPart> PartAt(const std::vector<WallLine>& lines, const Eigen::Vector2d& a,
                               const Eigen::Vector2d& b);

// Where two faces cross, as metres along each; nothing where they are nearly parallel.
std::optional<std::pair<double, double>> Crossing(const Face& a, const Face& b);

// A face behind another, as the other side of the same wall.
struct WallBody {
  size_t front = 0, back = 0;   // indices of faces, as MakeBodies gives them
  double from_m = 0, to_m = 0;  // along the front, where there are both
  double thickness_m = 0;
};

// Nothing unless the faces look away from each other, between the least and the largest thickness
// apart and beside each other for half of the shorter one.
std::optional<WallBody> BodyBetween(const Face& front, const Face& back,
                                    const BuildingOptions& options);

// The median thickness; the assumed one of the options where there are none.
double TypicalThickness(std::vector<WallBody> bodies, const BuildingOptions& options);

// Behind what was seen of each wall from one side alone, the face that it must have: at its own
// thickness where some of its back was seen, else the typical one. The room behind it ends there.
std::vector<WallFace> UnseenFaces(const std::vector<WallFace>& walls,
                                  const BuildingOptions& options);

// Between all faces, each as the front: a wall that was seen from both sides has two.
std::vector<WallBody> MakeBodies(const std::vector<WallFace>& walls,
                                 const BuildingOptions& options);

// Whether a place is between two faces of one wall, or in an opening of it, and not in a gap of
// both faces that is open; the bodies are those of the lines' walls.
bool IsInWall(const std::vector<WallLine>& lines, const std::vector<WallBody>& bodies,
              const Eigen::Vector2d& p);

}  // namespace slcmap::mapping
