#include "mapping/plan/building_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

constexpr double kLeastOpening_m = 0.5, kMostOpening_m = 2.6;
constexpr double kSameWay = 0.985;     // cosine, 10 degrees
constexpr double kLeastFace_m = 0.03;  // shorter ones tell no direction

double CrossProduct(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

void AddRing(const PlanPoints& ring, bool free_at_right, BuildingPlan* plan) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    PlannedFace face{ring[i], ring[(i + 1) % ring.size()]};
    if (!free_at_right) std::swap(face.start, face.end);
    if (face.Length() >= kLeastFace_m) plan->faces.push_back(face);
  }
}

// The length that two parallel pieces have side by side.
double SharedLength(const PlannedFace& a, const PlannedFace& b) {
  const Vector2d along = a.Along();
  const double first = along.dot(b.start - a.start), second = along.dot(b.end - a.start);
  return std::min(a.Length(), std::max(first, second)) - std::max(0.0, std::min(first, second));
}

// Whether both sides of a gap are open for a wall's thickness.
bool IsOpenThrough(const PlannedFace& a, const PlannedFace& b,
                   const std::vector<PlannedFace>& faces) {
  constexpr double kBeyond_m = 0.4;
  const Vector2d middle = 0.5 * (a.Middle() + b.Middle());
  const Vector2d reach = (0.5 * std::max(a.Length(), b.Length()) + kBeyond_m) * a.Along();
  return std::ranges::none_of(faces, [&](const PlannedFace& face) {
    return Cross(middle - reach, middle + reach, face.start, face.end) ||
           (&face != &a && &face != &b &&
            Cross(a.Middle() + 0.02 * a.Normal(), b.Middle() + 0.02 * b.Normal(), face.start,
                  face.end));
  });
}

bool AreJambs(const PlannedFace& a, const PlannedFace& b) {
  const double width_m = a.Normal().dot(b.Middle() - a.Middle());
  return width_m > kLeastOpening_m && width_m < kMostOpening_m &&
         a.Normal().dot(b.Normal()) < -kSameWay &&
         SharedLength(a, b) > 0.5 * std::max(a.Length(), b.Length());
}

}  // namespace

bool Cross(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto side = [](const Vector2d& from, const Vector2d& to, const Vector2d& p) {
    return CrossProduct(to - from, p - from) > 0;
  };
  return side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b);
}

void AddFaces(const Polygon& area, bool free_inside, BuildingPlan* plan) {
  AddRing(area.outline, (SignedArea(area.outline) > 0) != free_inside, plan);
  for (const PlanPoints& hole : area.holes) {
    AddRing(hole, (SignedArea(hole) < 0) != free_inside, plan);
  }
}

double MeanWidth(const Polygon& area) { return 2 * Area(area) / Perimeter(area); }

namespace {

// Lines that have another beside them at one side only, within a wall's thickness, get their free
// side: that is the other one.
void FindFreeSides(BuildingPlan* plan) {
  const std::vector<PlannedFace> drawn = plan->faces;
  for (PlannedFace& face : plan->faces) {
    if (!face.two_sided) continue;
    double before_m = 0, behind_m = 0;  // that has another line so near
    for (const PlannedFace& other : drawn) {
      const double off_m = face.Normal().dot(other.Middle() - face.Middle());
      if (std::abs(off_m) < kLeastFace_m || std::abs(off_m) > kThickestWall_m ||
          std::abs(face.Along().dot(other.Along())) < kSameWay) {
        continue;
      }
      (off_m > 0 ? before_m : behind_m) += std::max(0.0, SharedLength(face, other));
    }
    const double most_m = std::max(before_m, behind_m);
    if (most_m < 0.5 * face.Length() || std::min(before_m, behind_m) > 0.5 * most_m) continue;
    face.two_sided = false;
    if (before_m > behind_m) std::swap(face.start, face.end);
  }
}

bool IsOnFace(const Vector2d& p, const std::vector<PlannedFace>& faces) {
  return std::ranges::any_of(faces, [&](const PlannedFace& face) {
    const double along_m = face.Along().dot(p - face.start);
    return along_m > -kLeastFace_m && along_m < face.Length() + kLeastFace_m &&
           std::abs(face.Normal().dot(p - face.start)) < kLeastFace_m;
  });
}

}  // namespace

void AddLines(const std::vector<PlanPoints>& lines, BuildingPlan* plan) {
  constexpr double kGrid_m = 1e-3;
  std::vector<Polygon> walls;
  for (Polygon& cell : ArrangementCells(lines, kGrid_m)) {
    if (MeanWidth(cell) < kThickestWall_m) walls.push_back(std::move(cell));
  }
  BuildingPlan enclosed, open;
  for (const Polygon& wall : Union(walls, kGrid_m)) AddFaces(wall, false, &enclosed);
  for (const PlanPoints& line : lines) {
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
      const PlannedFace face{line[i], line[i + 1], 0, true};
      if (face.Length() < kLeastFace_m || IsOnFace(face.Middle(), enclosed.faces)) continue;
      if (!std::ranges::any_of(
              walls, [&](const Polygon& wall) { return Contains(wall, face.Middle()); })) {
        open.faces.push_back(face);
      }
    }
  }
  FindFreeSides(&open);
  for (const BuildingPlan* part : {&enclosed, &open}) {
    plan->faces.insert(plan->faces.end(), part->faces.begin(), part->faces.end());
  }
}

void FindOpenings(BuildingPlan* plan) {
  std::vector<const PlannedFace*> jambs;
  for (const PlannedFace& face : plan->faces) {
    if (!face.two_sided && face.Length() < kThickestWall_m) jambs.push_back(&face);
  }
  for (std::size_t i = 0; i < jambs.size(); ++i) {
    for (std::size_t j = i + 1; j < jambs.size(); ++j) {
      const PlannedFace &a = *jambs[i], &b = *jambs[j];
      if (!AreJambs(a, b) || !IsOpenThrough(a, b, plan->faces)) continue;
      const double width_m = a.Normal().dot(b.Middle() - a.Middle());
      plan->openings.push_back({a.Middle(), a.Middle() + width_m * a.Normal()});
    }
  }
}

BuildingPlan StretchPlan(const BuildingPlan& plan, const Vector2d& times) {
  BuildingPlan stretched = plan;
  const auto stretch = [&](auto* part) {
    part->start = part->start.cwiseProduct(times).eval();
    part->end = part->end.cwiseProduct(times).eval();
  };
  for (PlannedFace& face : stretched.faces) {
    stretch(&face);
    if (times.prod() < 0) std::swap(face.start, face.end);
  }
  for (PlannedOpening& opening : stretched.openings) stretch(&opening);
  return stretched;
}

namespace {

int64_t CellKey(const Vector2d& p) {
  const auto x = static_cast<int64_t>(std::floor(p.x() / FaceIndex::kReach_m));
  const auto y = static_cast<int64_t>(std::floor(p.y() / FaceIndex::kReach_m));
  return (x << 32) ^ (y & 0xffffffff);
}

}  // namespace

FaceIndex::FaceIndex(const std::vector<PlannedFace>& faces) : faces_(faces) {
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const PlannedFace& face = faces[i];
    const int steps = static_cast<int>(std::ceil(2 * face.Length() / kReach_m));
    for (int step = 0; step <= steps; ++step) {
      const Vector2d at = face.start + step / std::max(1.0, 1.0 * steps) * (face.end - face.start);
      for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
          std::vector<std::size_t>& cell = cells_[CellKey(at + kReach_m * Vector2d(x, y))];
          if (cell.empty() || cell.back() != i) cell.push_back(i);
        }
      }
    }
  }
}

std::optional<std::size_t> FaceIndex::FindNearest(const Vector2d& p, const Vector2d& normal,
                                                  double reach_m) const {
  constexpr double kBeyondEnd_m = 0.05;
  const auto cell = cells_.find(CellKey(p));
  if (cell == cells_.end()) return std::nullopt;
  std::optional<std::size_t> nearest;
  for (const std::size_t i : cell->second) {
    const PlannedFace& face = faces_[i];
    Vector2d to_free = face.Normal();
    if (face.two_sided && to_free.dot(normal) < 0) to_free = -to_free;
    if (to_free.dot(normal) < kSameWay) continue;
    const double off_m = to_free.dot(p - face.start), along_m = face.Along().dot(p - face.start);
    if (along_m < -kBeyondEnd_m || along_m > face.Length() + kBeyondEnd_m) continue;
    if (std::abs(off_m) > reach_m) continue;
    reach_m = std::abs(off_m);
    nearest = i;
  }
  return nearest;
}

}  // namespace slcmap::mapping
