#include "mapping/level_marks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "data/option_table.h"
#include "mapping/dense/dense_index.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kMaxTilt = 0.03;   // sine, of a line from the surface that it is on
constexpr double kAtLine_m = 0.02;  // from a line on, points are at one of its sides
constexpr double kStep_m = 0.3;     // along a line, that is asked for at once

constexpr OptionTable kTable{Option{"find", &LevelMarkOptions::find, false, true},
                             Option{"max_off_m", &LevelMarkOptions::max_off_m, 0.001, 0.3},
                             Option{"beside_m", &LevelMarkOptions::beside_m, 0.03, 1.0},
                             Option{"height_m", &LevelMarkOptions::height_m, 0.05, 3.0},
                             Option{"max_standing", &LevelMarkOptions::max_standing, 0.0, 1.0},
                             Option{"min_flat", &LevelMarkOptions::min_flat, 0.0, 1.0}};

// How many points of the cloud are beside a line.
struct PointsBeside {
  int left = 0, right = 0;  // on the surface
  int standing = 0;
};

bool IsOn(const BuildingPlane& plane, const MapLine& line, double max_off_m) {
  const Vector3d along = line.end_world - line.start_world;
  const Vector3d middle = line.start_world + along / 2;
  return std::abs(plane.normal.dot(middle) - plane.offset_m) <= max_off_m &&
         std::abs(plane.normal.dot(along)) <= kMaxTilt * along.norm();
}

double Length_m(const MapLine& piece) { return (piece.end_world - piece.start_world).norm(); }

void CountBeside(const BuildingPlane& plane, const MapLine& piece,
                 const std::vector<DensePoint>& cloud, const DenseIndex& index,
                 const LevelMarkOptions& options, PointsBeside* count) {
  const Vector3d along = (piece.end_world - piece.start_world).normalized();
  const Vector3d aside = plane.normal.cross(along).normalized();
  const int steps = std::max(1, static_cast<int>(std::ceil(Length_m(piece) / kStep_m)));
  const double step_m = Length_m(piece) / steps;
  const double reach_m = Vector3d(step_m / 2, options.beside_m, options.height_m).norm();
  std::vector<int> found;
  for (int i = 0; i < steps; ++i) {
    const Vector3d middle = piece.start_world + (i + 0.5) * step_m * along;
    index.Find(middle, reach_m, &found);
    for (const int k : found) {
      const Vector3d offset = cloud[k].p_world - middle;
      const double along_m = along.dot(offset), aside_m = aside.dot(offset);
      const double over_m = plane.normal.dot(cloud[k].p_world) - plane.offset_m;
      if (along_m < -step_m / 2 || along_m >= step_m / 2) continue;
      if (std::abs(aside_m) > options.beside_m || over_m > options.height_m) continue;
      if (over_m > options.max_off_m) {
        ++count->standing;
      } else if (over_m >= -options.max_off_m && std::abs(aside_m) > kAtLine_m) {
        ++(aside_m > 0 ? count->left : count->right);
      }
    }
  }
}

// The pieces of a line; the surface is fused by voxel_m.
bool IsMarkOn(const BuildingPlane& plane, const std::vector<MapLine*>& pieces,
              const std::vector<DensePoint>& cloud, const DenseIndex& index, double voxel_m,
              const LevelMarkOptions& options) {
  if (!IsOn(plane, *pieces.front(), options.max_off_m)) return false;
  PointsBeside beside;
  double length_m = 0;
  for (const MapLine* piece : pieces) {
    CountBeside(plane, *piece, cloud, index, options, &beside);
    length_m += Length_m(*piece);
  }
  const double points_m = length_m / (voxel_m * voxel_m);  // of a whole surface, a metre across
  const double strip = (options.beside_m - kAtLine_m) * points_m;
  const double face = (options.height_m - options.max_off_m) * points_m;
  return std::min(beside.left, beside.right) >= options.min_flat * strip &&
         beside.standing <= options.max_standing * face;
}

bool IsLevel(const BuildingPlane& plane) {
  return plane.kind == PlaneKind::kFloor || plane.kind == PlaneKind::kCeiling;
}

}  // namespace

void LevelMarkOptions::Check() const {
  kTable.Check("mapping.level_marks", *this);
  CheckOrder("mapping.level_marks", "max_off_m", max_off_m, "height_m", height_m);
}
void LevelMarkOptions::Read(YamlSection section) { kTable.Read(section, this); }

void TellLevelMarks(const Building& building, const std::vector<DensePoint>& cloud, double voxel_m,
                    const LevelMarkOptions& options, std::vector<MapLine>* lines) {
  options.Check();
  if (!options.find) return;
  std::map<int64_t, std::vector<MapLine*>> pieces_of;
  for (MapLine& line : *lines) {
    if (line.kind == LineKind::kEdge || line.kind == LineKind::kOutline) {
      pieces_of[line.id].push_back(&line);
    }
  }
  const DenseIndex index(cloud);
  for (const auto& [id, pieces] : pieces_of) {
    const bool is_mark = std::any_of(
        building.planes.begin(), building.planes.end(), [&](const BuildingPlane& plane) {
          return IsLevel(plane) && IsMarkOn(plane, pieces, cloud, index, voxel_m, options);
        });
    if (!is_mark) continue;
    for (MapLine* piece : pieces) piece->kind = LineKind::kMark;
  }
}

}  // namespace slcmap
