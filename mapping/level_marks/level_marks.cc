#include "mapping/level_marks/level_marks.h"

#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "mapping/dense/dense_index.h"
#include "mapping/lines/map_lines.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kAtLine_m = 0.02;       // from a line on, points are at one of its sides
constexpr double kStep_m = 0.3;          // along a line
constexpr double kFacing = 0.7;          // least cosine of a point's normal to its surface's
constexpr double kSameHeight_m = 0.001;  // between the floors of rooms that are one floor
constexpr double kMaxTilt = 0.05;        // sine, of a line from its surface

// A floor or a ceiling, wherever it ends.
struct LevelSurface {
  Vector3d normal = Vector3d::UnitZ();
  double offset_m = 0;

  double Over_m(const Vector3d& p_world) const { return normal.dot(p_world) - offset_m; }
};

std::vector<LevelSurface> LevelSurfacesOf(const Building& building) {
  std::vector<LevelSurface> surfaces;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.kind != PlaneKind::kFloor && plane.kind != PlaneKind::kCeiling) continue;
    const auto is_same = [&](const LevelSurface& other) {
      return other.normal.dot(plane.normal) > kFacing &&
             std::abs(other.offset_m - plane.offset_m) < kSameHeight_m;
    };
    if (std::ranges::none_of(surfaces, is_same)) surfaces.push_back({plane.normal, plane.offset_m});
  }
  return surfaces;
}

// Cells of a strip along a line, of which some hold points.
class Strip {
 public:
  Strip(double length_m, double width_m, double cell_m)
      : cell_m_(cell_m), cells_(std::ceil(length_m / cell_m) * std::ceil(width_m / cell_m)) {}

  void Add(double along_m, double across_m) { held_.emplace(Index(along_m), Index(across_m)); }
  double Share() const { return static_cast<double>(held_.size()) / cells_; }

 private:
  int Index(double m) const { return static_cast<int>(std::floor(m / cell_m_)); }

  double cell_m_, cells_;
  std::set<std::pair<int, int>> held_;
};

// A stretch of a line on a surface, and what the cloud holds about it.
class Step {
 public:
  Step(const LevelSurface& surface, const Vector3d& start, const Vector3d& end, double cell_m,
       const LevelMarkOptions& options)
      : surface_(surface),
        options_(options),
        start_(start),
        along_((end - start).normalized()),
        length_m_((end - start).norm()),
        over_(length_m_, options.height_m - options.max_off_m, cell_m),
        sides_{{length_m_, options.beside_m - kAtLine_m, cell_m},
               {length_m_, options.beside_m - kAtLine_m, cell_m}} {}

  Vector3d Middle() const { return start_ + length_m_ / 2 * along_; }
  double Reach_m() const {
    return Vector3d(length_m_ / 2, options_.beside_m, options_.height_m).norm();
  }

  void Add(const DensePoint& point) {
    const Vector3d offset = point.p_world - start_;
    const double along_m = along_.dot(offset);
    const double aside_m = surface_.normal.cross(along_).normalized().dot(offset);
    const double beside_m = std::abs(aside_m), over_m = surface_.Over_m(point.p_world);
    if (along_m < 0 || along_m >= length_m_ || beside_m >= options_.beside_m) return;
    if (over_m > options_.max_off_m && over_m < options_.height_m) {
      over_.Add(along_m, over_m - options_.max_off_m);
    }
    if (std::abs(over_m) > options_.max_off_m || beside_m < kAtLine_m) return;
    if (point.normal_world.dot(surface_.normal) < kFacing) return;
    sides_[aside_m > 0].Add(along_m, beside_m - kAtLine_m);
  }

  // Whether the surface goes on at both sides, and hardly anything is over it.
  bool IsPlain() const {
    return over_.Share() <= options_.max_standing &&
           std::min(sides_[0].Share(), sides_[1].Share()) >= options_.min_flat;
  }

 private:
  const LevelSurface& surface_;
  const LevelMarkOptions& options_;
  Vector3d start_, along_;
  double length_m_;
  Strip over_;
  Strip sides_[2];
};

class LevelMarks {
 public:
  LevelMarks(const std::vector<DensePoint>& cloud, double cell_m, const LevelMarkOptions& options)
      : cloud_(cloud), index_(cloud), cell_m_(cell_m), options_(options) {}

  // Of a line in pieces.
  bool IsMarkOn(const LevelSurface& surface, const std::vector<MapLine*>& pieces) const {
    double plain_m = 0, all_m = 0;
    for (const MapLine* piece : pieces) {
      if (!IsOn(surface, *piece)) return false;
      plain_m += Plain_m(surface, *piece);
      all_m += (piece->end_world - piece->start_world).norm();
    }
    return all_m > 0 && plain_m >= options_.min_share * all_m;
  }

 private:
  bool IsOn(const LevelSurface& surface, const MapLine& piece) const {
    const Vector3d way = piece.end_world - piece.start_world;
    return std::abs(surface.normal.dot(way)) <= kMaxTilt * way.norm() &&
           std::abs(surface.Over_m(piece.start_world)) <= options_.max_off_m &&
           std::abs(surface.Over_m(piece.end_world)) <= options_.max_off_m;
  }

  double Plain_m(const LevelSurface& surface, const MapLine& piece) const {
    const Vector3d way = piece.end_world - piece.start_world;
    const double steps = std::max(1.0, std::ceil(way.norm() / kStep_m));
    double plain_m = 0;
    std::vector<int> found;
    for (double i = 0; i < steps; ++i) {
      Step step(surface, piece.start_world + i / steps * way,
                piece.start_world + (i + 1) / steps * way, cell_m_, options_);
      index_.Find(step.Middle(), step.Reach_m(), &found);
      for (const int k : found) step.Add(cloud_[k]);
      if (step.IsPlain()) plain_m += way.norm() / steps;
    }
    return plain_m;
  }

  const std::vector<DensePoint>& cloud_;
  DenseIndex index_;
  double cell_m_;
  const LevelMarkOptions& options_;
};

// Of unknown kind, of which the cloud says little, are joints and reflections on floors, but on
// ceilings the lamps in them.
bool MayBeMark(LineKind kind, const LevelSurface& surface) {
  const bool is_floor = surface.normal.z() > 0;
  return kind == LineKind::kEdge || kind == LineKind::kOutline ||
         (kind == LineKind::kUnknown && is_floor);
}

}  // namespace

void TellLevelMarks(const Building& building, const std::vector<DensePoint>& cloud, double cell_m,
                    const LevelMarkOptions& options, std::vector<MapLine>* lines) {
  options.Check();
  const std::vector<LevelSurface> surfaces = LevelSurfacesOf(building);
  if (!options.find || surfaces.empty()) return;
  std::map<int64_t, std::vector<MapLine*>> pieces_of;
  for (MapLine& line : *lines) pieces_of[line.id].push_back(&line);
  const LevelMarks marks(cloud, cell_m, options);
  for (const auto& [id, pieces] : pieces_of) {
    const bool is_mark = std::ranges::any_of(surfaces, [&](const LevelSurface& surface) {
      return MayBeMark(pieces.front()->kind, surface) && marks.IsMarkOn(surface, pieces);
    });
    if (!is_mark) continue;
    for (MapLine* piece : pieces) piece->kind = LineKind::kMark;
  }
}

void MoveLevelMarks(const MappingOptions& options, MapResult* map) {
  const double cell_m = std::max(options.dense.voxel_m, options.planes.cell_m);
  TellLevelMarks(map->building, map->dense, cell_m, options.level_marks, &map->lines);
  const std::vector<MapLine> marks = TakeMarks(&map->lines);
  map->marks.insert(map->marks.end(), marks.begin(), marks.end());
  spdlog::debug("{} pieces of lines on floors and ceilings are marks", marks.size());
}

}  // namespace slcmap
