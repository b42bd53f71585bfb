#include "mapping/building/rooms.h"

#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/connected_components.hpp>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <vector>

#include "data/core/math.h"
#include "mapping/building/wall_lines.h"

namespace slcmap::inline mapping {
namespace {

// What it costs to label a thing by itself.
struct LabelCosts {
  double inside = 0, outside = 0;
};

// What it costs to label two things differently.
struct PairCost {
  size_t a = 0, b = 0;
  double cost = 0;
};

// A flow network with residual capacities, as Boost asks for it.
using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
using MakeEdge = Traits::edge_descriptor;
using NodeProperties =
    boost::property<boost::vertex_color_t, boost::default_color_type,
                    boost::property<boost::vertex_distance_t, long,
                                    boost::property<boost::vertex_predecessor_t, MakeEdge>>>;
using EdgeProperties =
    boost::property<boost::edge_capacity_t, double,
                    boost::property<boost::edge_residual_capacity_t, double,
                                    boost::property<boost::edge_reverse_t, MakeEdge>>>;
using Network = boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, NodeProperties,
                                      EdgeProperties>;

void Connect(size_t a, size_t b, double forth, double back, Network* network) {
  const MakeEdge there = boost::add_edge(a, b, *network).first;
  const MakeEdge here = boost::add_edge(b, a, *network).first;
  boost::put(boost::edge_capacity, *network, there, forth);
  boost::put(boost::edge_capacity, *network, here, back);
  boost::put(boost::edge_reverse, *network, there, here);
  boost::put(boost::edge_reverse, *network, here, there);
}

// The labels of least cost in all, true: inside. Costs are not negative. Y. Boykov and
// V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy minimization
// in vision", PAMI 2004.
std::vector<bool> LeastCostLabels(const std::vector<LabelCosts>& things,
                                  const std::vector<PairCost>& pairs) {
  const size_t inside = things.size(), outside = inside + 1;
  Network network(things.size() + 2);
  for (size_t i = 0; i < things.size(); ++i) {
    // Cut off from the inside, it is outside.
    Connect(inside, i, things[i].outside, 0, &network);
    Connect(i, outside, things[i].inside, 0, &network);
  }
  for (const PairCost& pair : pairs) Connect(pair.a, pair.b, pair.cost, pair.cost, &network);
  boost::boykov_kolmogorov_max_flow(network, inside, outside);
  const auto colours = boost::get(boost::vertex_color, network);
  std::vector<bool> labels;
  for (size_t i = 0; i < things.size(); ++i) {
    labels.push_back(boost::get(colours, i) == boost::black_color);
  }
  return labels;
}

using Eigen::Vector2d;

constexpr double kBorderCost_m = 0.25;  // of a border without a wall, as area of a cell by length
constexpr double kFreeWeight = 8;       // of free area against area that was not seen
constexpr double kLeastWidth_m = 0.4;   // of a room, in the mean; the inside of a wall is none
constexpr double kNever = 1e9;          // costs more than all else
constexpr double kStraight_m = 1e-3, kApart_m = 2 * kPlanGrid_m;

struct Cell {
  Polygon polygon;
  double area_m2 = 0, free = 0;
  bool is_in_wall = false, is_inside = false;
};

// A piece of border between two cells; `other` is -1 at the outside of all.
struct Border {
  int cell = -1, other = -1;
  Vector2d from = Vector2d::Zero(), to = Vector2d::Zero();
  double length_m = 0;
  WallPart part = {};
};

using GridPoint = std::pair<int64_t, int64_t>;

GridPoint OnGrid(const Vector2d& point) {
  return {std::llround(point.x() / kPlanGrid_m), std::llround(point.y() / kPlanGrid_m)};
}

class BorderFinder {
 public:
  explicit BorderFinder(const std::vector<WallLine>& lines) : lines_(lines) {}

  void Add(int cell, const PlanPoints& outline) {
    for (size_t i = 0; i < outline.size(); ++i) {
      const Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
      const GridPoint first = OnGrid(a), second = OnGrid(b);
      const auto key = first < second ? std::pair(first, second) : std::pair(second, first);
      const auto [entry, is_new] = borders_.try_emplace(key, Border{});
      if (is_new) {
        entry->second = NewBorder(cell, a, b);
      } else {
        entry->second.other = cell;
      }
    }
  }

  std::vector<Border> Borders() const {
    std::vector<Border> borders;
    for (const auto& [key, border] : borders_) borders.push_back(border);
    return borders;
  }

 private:
  Border NewBorder(int cell, const Vector2d& a, const Vector2d& b) const {
    Border border{cell, -1, a, b, (b - a).norm()};
    if (const auto part = PartAt(lines_, a, b)) border.part = *part;
    return border;
  }

  const std::vector<WallLine>& lines_;
  std::map<std::pair<GridPoint, GridPoint>, Border> borders_;
};

// Around all that is free and all walls, along these; empty where nothing is free.
PlanPoints MakeFrame(const std::vector<WallLine>& lines, const FreeSpace& free) {
  std::vector<Face> faces;
  for (const WallLine& line : lines) faces.push_back(line.wall->face);
  const Eigen::Rotation2Dd R_world_frame(MainHeading(faces));
  Eigen::AlignedBox2d box = free.FreeBox(R_world_frame.inverse());
  if (box.isEmpty()) return {};
  for (const Face& face : faces)
    for (const double at_m : {face.from_m, face.to_m})
      box.extend(R_world_frame.inverse() * face.PointAt(at_m));
  const Vector2d &low = box.min(), &high = box.max();
  PlanPoints frame = {low, {high.x(), low.y()}, high, {low.x(), high.y()}, low};
  for (Vector2d& corner : frame) corner = R_world_frame * corner;
  return frame;
}

// Across a wall at the ends of its gaps, so that what lies in them is a cell of its own.
std::vector<PlanPoints> FindCheeks(const WallFace& wall, double max_thickness_m) {
  std::vector<PlanPoints> cheeks;
  for (const Interval& gap : wall.gaps) {
    for (const double at_m : {gap.from_m, gap.to_m}) {
      const Vector2d p = wall.face.PointAt(at_m);
      cheeks.push_back({p, p - max_thickness_m * wall.face.normal});
    }
  }
  return cheeks;
}

std::vector<Cell> FindCells(const std::vector<WallLine>& lines, const FreeSpace& free,
                            double max_thickness_m) {
  const PlanPoints frame = MakeFrame(lines, free);
  if (frame.empty()) return {};
  std::vector<PlanPoints> chains = {frame};
  for (const WallLine& line : lines) {
    chains.push_back(line.Chain());
    std::ranges::copy(FindCheeks(*line.wall, max_thickness_m), std::back_inserter(chains));
  }
  std::vector<Cell> cells;
  for (Polygon& polygon : ArrangementCells(chains, kPlanGrid_m)) {
    Cell cell{std::move(polygon)};
    cell.area_m2 = Area(cell.polygon);
    cell.free = free.ComputeShareFree(cell.polygon);
    cells.push_back(std::move(cell));
  }
  return cells;
}

Vector2d Middle(const PlanPoints& outline) {
  Vector2d sum = Vector2d::Zero();
  for (const Vector2d& point : outline) sum += point;
  return sum / static_cast<double>(outline.size());
}

// Rays that graze a wall, or end in it, do not make a room of it, and rooms on one side of it are
// not connected through it.
void FindWallBodies(const std::vector<WallFace>& walls, const std::vector<WallLine>& lines,
                    const BuildingOptions& options, std::vector<Cell>* cells) {
  const std::vector<WallBody> bodies = MakeBodies(walls, options);
  for (Cell& cell : *cells) {
    cell.is_in_wall = IsInWall(lines, bodies, Middle(cell.polygon.outline));
  }
}

void LabelCells(const std::vector<Border>& borders, std::vector<Cell>* cells) {
  std::vector<LabelCosts> costs;
  for (const Cell& cell : *cells) {
    if (cell.is_in_wall) {
      costs.push_back({kNever, 0});
    } else {
      costs.push_back({cell.area_m2 * (1 - cell.free), kFreeWeight * cell.area_m2 * cell.free});
    }
  }
  std::vector<PairCost> pairs;
  for (const Border& border : borders) {
    const double cost = border.part.is_wall ? 0 : kBorderCost_m * border.length_m;
    const auto a = static_cast<size_t>(border.cell);
    if (border.other < 0) {
      costs[a].inside += cost;  // beyond the frame is outside
    } else {
      pairs.push_back({a, static_cast<size_t>(border.other), cost});
    }
  }
  const std::vector<bool> labels = LeastCostLabels(costs, pairs);
  for (size_t i = 0; i < cells->size(); ++i) (*cells)[i].is_inside = labels[i];
}

bool AreInside(const std::vector<Cell>& cells, const Border& border) {
  return border.other >= 0 && cells[border.cell].is_inside && cells[border.other].is_inside;
}

// By cell: which of those that open borders connect it is of, numbered by the first cell of each.
std::vector<int> ConnectedCells(const std::vector<Border>& borders,
                                const std::vector<Cell>& cells) {
  boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS> open(cells.size());
  for (const Border& border : borders) {
    if (!border.part.parts_rooms && AreInside(cells, border)) {
      boost::add_edge(border.cell, border.other, open);
    }
  }
  std::vector<int> groups(cells.size());
  boost::connected_components(open, groups.data());
  return groups;
}

double BoundedShare(const std::vector<Border>& borders, const std::vector<Cell>& cells, int group,
                    const std::vector<int>& groups) {
  double covered_m = 0, all_m = 0;
  for (const Border& border : borders) {
    const auto is_in = [&](int cell) {
      return cell >= 0 && cells[cell].is_inside && groups[cell] == group;
    };
    if (is_in(border.cell) == is_in(border.other)) continue;
    all_m += border.length_m;
    if (border.part.is_measured) covered_m += border.length_m;
  }
  return all_m > 0 ? covered_m / all_m : 0;
}

}  // namespace

std::vector<FoundRoom> FindRooms(const std::vector<WallFace>& walls, const FreeSpace& free,
                                 const BuildingOptions& options) {
  const std::vector<WallLine> lines = CollectLines(walls, free, options);
  std::vector<Cell> cells = FindCells(lines, free, options.max_thickness_m);
  FindWallBodies(walls, lines, options, &cells);
  BorderFinder finder(lines);
  for (size_t i = 0; i < cells.size(); ++i) {
    finder.Add(static_cast<int>(i), cells[i].polygon.outline);
    for (const PlanPoints& hole : cells[i].polygon.holes) finder.Add(static_cast<int>(i), hole);
  }
  const std::vector<Border> borders = finder.Borders();
  LabelCells(borders, &cells);

  const std::vector<int> groups = ConnectedCells(borders, cells);
  std::map<int, std::vector<int>> members;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].is_inside) members[groups[i]].push_back(static_cast<int>(i));
  }
  std::vector<FoundRoom> rooms;
  for (const auto& [group, indices] : members) {
    std::vector<Polygon> polygons;
    double area_m2 = 0;
    for (const int i : indices) {
      polygons.push_back(cells[i].polygon);
      area_m2 += cells[i].area_m2;
    }
    if (area_m2 < options.min_room_m2) continue;
    const double bounded = BoundedShare(borders, cells, group, groups);
    for (Polygon& polygon : Union(polygons, kPlanGrid_m)) {
      if (2 * Area(polygon) < kLeastWidth_m * Perimeter(polygon)) continue;
      polygon.outline = Straightened(polygon.outline, kStraight_m, kApart_m);
      for (PlanPoints& hole : polygon.holes) hole = Straightened(hole, kStraight_m, kApart_m);
      std::erase_if(polygon.holes, [](const PlanPoints& hole) { return hole.size() < 3; });
      rooms.push_back({polygon, bounded});
    }
  }
  return rooms;
}

}  // namespace slcmap::mapping
