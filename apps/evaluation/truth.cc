#include "apps/evaluation/truth.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/ply.h"
#include "data/io/yaml.h"

namespace slcmap::inline evaluation {
namespace {

constexpr double kViewMinLength_m = 0.3;  // of an edge
constexpr double kViewMargin_m = 0.002;  // a surface this near in front of a place does not hide it
constexpr double kMaxRange_m = 8;        // what is further away was not seen

constexpr char kColumns[] = "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m";

bool HasExtent(const PlySegment& segment) {
  return (segment.end_world - segment.start_world).squaredNorm() > 0;
}

double SquaredDistance(const Eigen::Vector3d& p, const PlySegment& segment) {
  const Eigen::Vector3d way = segment.end_world - segment.start_world;
  const double length2 = way.squaredNorm();
  const double u =
      length2 > 0 ? std::clamp((p - segment.start_world).dot(way) / length2, 0.0, 1.0) : 0.0;
  return (segment.start_world + u * way - p).squaredNorm();
}

Eigen::Vector3d Vector(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1), table.Number(row, column + 2)};
}

bool SameEnds(const PlySegment& a, const PlySegment& b) {
  return a.start_world == b.start_world && a.end_world == b.end_world;
}

bool IsSeen(const EdgeRow& row) { return row.to_m != row.from_m && HasExtent(row.whole); }

// Of the edges of which something was seen.
TrueEdges SeenEdges(const std::vector<EdgeRow>& rows) {
  std::set<int64_t> seen;
  for (const EdgeRow& row : rows) {
    if (IsSeen(row)) seen.insert(row.edge);
  }
  TrueEdges edges;
  const EdgeRow* last = nullptr;  // of edges.whole; the parts of a piece follow each other
  for (const EdgeRow& row : rows) {
    if (!HasExtent(row.whole) || !seen.contains(row.edge)) continue;
    if (IsSeen(row)) edges.seen.push_back(row.Seen());
    if (!last || last->edge != row.edge || !SameEnds(last->whole, row.whole)) {
      edges.whole.push_back(row.whole);
      edges.edge_of_whole.push_back(row.edge);
    }
    last = &row;
  }
  return edges;
}

}  // namespace

double Length(const PlySegment& segment) {
  return (segment.end_world - segment.start_world).norm();
}

double Distance_m(const PlySegment& segment, const Eigen::Vector3d& p) {
  return std::sqrt(SquaredDistance(p, segment));
}

PlySegment EdgeRow::Seen() const {
  const Eigen::Vector3d direction = (whole.end_world - whole.start_world).normalized();
  return {whole.start_world + from_m * direction, whole.start_world + to_m * direction};
}

std::vector<EdgeRow> ReadEdgeTable(const std::string& path) {
  const CsvTable table = CsvTable::Read(path, kColumns);
  std::vector<EdgeRow> rows(table.rows());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = {table.Integer(i, 0),
               table.Integer(i, 1),
               {Vector(table, i, 3), Vector(table, i, 6)},
               table.Number(i, 9),
               table.Number(i, 10)};
    if (rows[i].to_m < rows[i].from_m) table.Fail(i, 10, "at least seen_from_m");
  }
  return rows;
}

TrueEdges ReadTrueEdges(const std::string& path) {
  TrueEdges edges;
  if (path.ends_with(".ply")) {
    edges.seen = ReadLinesPly(path);
    std::erase_if(edges.seen, [](const PlySegment& segment) { return !HasExtent(segment); });
    edges.whole = edges.seen;
  } else {
    edges = SeenEdges(ReadEdgeTable(path));
  }
  if (edges.seen.empty()) throw DataError(path + ": found no edge, expected at least one seen");
  return edges;
}

namespace {

constexpr int32_t kLeafSize = 4;
constexpr std::size_t kMaxDepth = 64;

Eigen::Vector3d Centre(const Triangle& triangle) {
  return (triangle[0] + triangle[1] + triangle[2]) / 3;
}

// T. Moeller and B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
double Hit_m(const Triangle& triangle, const Eigen::Vector3d& origin,
             const Eigen::Vector3d& direction) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d side1 = triangle[1] - triangle[0], side2 = triangle[2] - triangle[0];
  const Eigen::Vector3d p = direction.cross(side2);
  const double determinant = side1.dot(p);
  if (std::abs(determinant) < 1e-14) return kNone;
  const Eigen::Vector3d from = origin - triangle[0];
  const double u = from.dot(p) / determinant;
  const Eigen::Vector3d q = from.cross(side1);
  const double v = direction.dot(q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return kNone;
  const double distance_m = side2.dot(q) / determinant;
  return distance_m > 0 ? distance_m : kNone;
}

// Where a ray enters a box; infinite where it misses it.
double Entry_m(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& inverse_direction) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    double near = (box.min()[i] - origin[i]) * inverse_direction[i];
    double far = (box.max()[i] - origin[i]) * inverse_direction[i];
    if (near > far) std::swap(near, far);
    if (near > enter) enter = near;  // false for a ray that lies in the box's face (not a number)
    if (far < leave) leave = far;
  }
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

double SquaredDistance(const Eigen::Vector3d& p, const Triangle& triangle) {
  const Eigen::Vector3d normal =
      (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
  bool is_above = normal.squaredNorm() > 0.5;  // not of a triangle without area
  for (int i = 0; i < 3 && is_above; ++i) {
    const Eigen::Vector3d side = triangle[(i + 1) % 3] - triangle[i];
    is_above = normal.dot(side.cross(p - triangle[i])) >= 0;
  }
  if (is_above) return std::pow(normal.dot(p - triangle[0]), 2);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    least = std::min(least, SquaredDistance(p, PlySegment{triangle[i], triangle[(i + 1) % 3]}));
  }
  return least;
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  nodes_.reserve(triangles_.size() + 1);
  if (!triangles_.empty()) Build(0, static_cast<int32_t>(triangles_.size()));
}

void TriangleTree::Build(int32_t begin, int32_t end) {
  const std::size_t index = nodes_.size();
  nodes_.push_back({{}, begin, end - begin});
  Eigen::AlignedBox3d centres;
  for (int32_t i = begin; i < end; ++i) {
    for (const Eigen::Vector3d& corner : triangles_[i]) nodes_[index].box.extend(corner);
    centres.extend(Centre(triangles_[i]));
  }
  if (end - begin <= kLeafSize) return;
  int axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int32_t middle = begin + (end - begin) / 2;
  std::nth_element(
      triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
      [axis](const Triangle& a, const Triangle& b) { return Centre(a)[axis] < Centre(b)[axis]; });
  Build(begin, middle);
  nodes_[index].first = static_cast<int32_t>(nodes_.size());
  nodes_[index].count = 0;
  Build(middle, end);
}

double TriangleTree::FirstHit_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                double max_m) const {
  if (nodes_.empty()) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d inverse_direction = direction.cwiseInverse();
  double nearest_m = std::numeric_limits<double>::infinity();
  std::array<int32_t, kMaxDepth> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const int32_t index = stack[--waiting];
    const Node& node = nodes_[index];
    if (Entry_m(node.box, origin, inverse_direction) > std::min(nearest_m, max_m)) continue;
    for (int32_t i = node.first; i < node.first + node.count; ++i) {
      nearest_m = std::min(nearest_m, Hit_m(triangles_[i], origin, direction));
    }
    if (node.count > 0) continue;
    stack[waiting++] = node.first;
    stack[waiting++] = index + 1;
  }
  return nearest_m <= max_m ? nearest_m : std::numeric_limits<double>::infinity();
}

double TriangleTree::Distance_m(const Eigen::Vector3d& p, double max_m) const {
  if (nodes_.empty()) return max_m;
  double nearest2 = max_m * max_m;
  std::array<int32_t, kMaxDepth> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const int32_t index = stack[--waiting];
    const Node& node = nodes_[index];
    if (node.box.squaredExteriorDistance(p) >= nearest2) continue;
    for (int32_t i = node.first; i < node.first + node.count; ++i) {
      nearest2 = std::min(nearest2, SquaredDistance(p, triangles_[i]));
    }
    if (node.count > 0) continue;
    stack[waiting++] = node.first;
    stack[waiting++] = index + 1;
  }
  return std::sqrt(nearest2);
}

std::vector<Triangle> ReadSurfaces(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const std::vector<Eigen::Vector3d> corners = Positions(file.Get("vertex", path), path);
  const auto corner = [&](std::size_t face, std::size_t i) {
    const auto vertex = static_cast<std::size_t>(file.faces[face][i]);
    if (vertex < corners.size()) return corners[vertex];
    throw DataError(fmt::format("{}: face row {}: found vertex {}, expected one of {}", path,
                                face + 1, vertex, corners.size()));
  };
  std::vector<Triangle> triangles;
  for (std::size_t face = 0; face < file.faces.size(); ++face) {
    for (std::size_t i = 2; i < file.faces[face].size(); ++i) {
      triangles.push_back({corner(face, 0), corner(face, i - 1), corner(face, i)});
    }
  }
  if (triangles.empty()) {
    throw DataError(path + ": found no faces, expected the surfaces of a building");
  }
  return triangles;
}

namespace {

constexpr OptionTable kVisibilityTable{
    Option{"interval_s", &VisibilityOptions::interval_s, 1e-3, 1e3},
    Option{"stride_px", &VisibilityOptions::stride_px, 1, 1000}};

std::vector<Eigen::Vector3d> CollectRays(const Camera& camera, int stride_px) {
  std::vector<Eigen::Vector3d> rays;
  for (int v = stride_px / 2; v < camera.height_px; v += stride_px) {
    for (int u = stride_px / 2; u < camera.width_px; u += stride_px) {
      if (const auto ray = camera.Unproject(Eigen::Vector2d(u, v))) rays.push_back(*ray);
    }
  }
  return rays;
}

}  // namespace

void VisibilityOptions::Check() const { kVisibilityTable.Check("visibility", *this); }

Trajectory PosesApart(const Trajectory& poses, double interval_s) {
  const int64_t step_ns = ToNanoseconds(interval_s);
  Trajectory apart;
  for (const StampedPose& pose : poses) {
    if (apart.empty() || pose.stamp_ns >= apart.back().stamp_ns + step_ns) apart.push_back(pose);
  }
  return apart;
}

std::vector<ReferenceView> ReferenceViews(const TriangleTree& surfaces, const Trajectory& truth,
                                          const Rig& rig, const VisibilityOptions& options,
                                          const Progress& progress) {
  const std::vector<Eigen::Vector3d> rays = CollectRays(rig.cameras[0], options.stride_px);
  const Trajectory poses = PosesApart(truth, options.interval_s);
  std::vector<ReferenceView> views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(poses.size()));
    const RigidTransform T_world_camera = poses[i].T_world_imu * rig.T_imu_camera[0];
    ReferenceView view{T_world_camera.translation, {}};
    for (const Eigen::Vector3d& ray : rays) {
      const Eigen::Vector3d direction = T_world_camera.rotation * ray;
      const double range_m = surfaces.FirstHit_m(view.p_camera, direction, kMaxRange_m);
      if (std::isfinite(range_m)) view.ends.emplace_back(view.p_camera + range_m * direction);
    }
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<SeenSample> SeenSurfaces(const std::vector<ReferenceView>& views, double cell_m) {
  std::map<std::array<int64_t, 3>, SeenSample> cells;
  for (const ReferenceView& view : views) {
    for (const Eigen::Vector3d& end : view.ends) {
      const Eigen::Vector3d scaled = end / cell_m;
      const std::array<int64_t, 3> cell = {std::llround(scaled.x()), std::llround(scaled.y()),
                                           std::llround(scaled.z())};
      const double range_m = (end - view.p_camera).norm();
      const auto [entry, is_new] = cells.try_emplace(cell, SeenSample{end, range_m});
      if (!is_new && range_m < entry->second.range_m) entry->second = {end, range_m};
    }
  }
  std::vector<SeenSample> samples;
  for (const auto& [cell, sample] : cells) samples.push_back(sample);
  return samples;
}

namespace {

constexpr int kClearFrames = 20;           // that do
constexpr double kClearInterval_s = 0.05;  // between frames, however many images a second there are
constexpr double kClearSample_m = 0.04;    // along an edge

// Of those that are long enough; the pieces of a bent edge count as one.
std::vector<PlySegment> LongEdges(const TrueEdges& edges, double min_length_m) {
  const auto edge_of = [&](std::size_t i) {
    return edges.edge_of_whole.empty() ? static_cast<int64_t>(i) : edges.edge_of_whole[i];
  };
  std::map<int64_t, double> lengths_m;
  for (std::size_t i = 0; i < edges.whole.size(); ++i) {
    lengths_m[edge_of(i)] += Length(edges.whole[i]);
  }
  std::vector<PlySegment> pieces;
  for (std::size_t i = 0; i < edges.whole.size(); ++i) {
    if (lengths_m[edge_of(i)] >= min_length_m) pieces.push_back(edges.whole[i]);
  }
  return pieces;
}

// How many frames show each place of a piece of an edge.
struct WatchedEdge {
  PlySegment piece;
  std::vector<int> frames;

  Eigen::Vector3d At(double sample) const {
    return piece.start_world +
           sample / static_cast<double>(frames.size()) * (piece.end_world - piece.start_world);
  }
};

// A camera at a place, and what hides things from it.
struct Watcher {
  const Camera& camera;
  const TriangleTree& surfaces;

  bool Sees(const RigidTransform& T_world_camera, const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d to_place = p_world - T_world_camera.translation;
    const double distance_m = to_place.norm();
    if (distance_m > kMaxRange_m || distance_m <= kViewMargin_m) return false;
    const auto px = camera.Project(T_world_camera.rotation.conjugate() * to_place);
    if (!px || !camera.Contains(*px)) return false;
    const double free_m = distance_m - kViewMargin_m;
    return !std::isfinite(
        surfaces.FirstHit_m(T_world_camera.translation, to_place / distance_m, free_m));
  }

  void Watch(const RigidTransform& T_world_camera, WatchedEdge* edge) const {
    if (Distance_m(edge->piece, T_world_camera.translation) > kMaxRange_m) return;
    for (std::size_t i = 0; i < edge->frames.size(); ++i) {
      int& frames = edge->frames[i];
      if (frames >= kClearFrames) continue;
      frames += Sees(T_world_camera, edge->At(static_cast<double>(i) + 0.5));
    }
  }
};

void AddParts(const WatchedEdge& edge, std::vector<PlySegment>* parts) {
  const std::size_t count = edge.frames.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (edge.frames[i] < kClearFrames) continue;
    const std::size_t first = i;
    while (i < count && edge.frames[i] >= kClearFrames) ++i;
    parts->push_back({edge.At(static_cast<double>(first)), edge.At(static_cast<double>(i))});
  }
}

}  // namespace

std::vector<PlySegment> ClearlySeen(const TrueEdges& edges, const TriangleTree& surfaces,
                                    const Trajectory& truth, const Rig& rig,
                                    const Progress& progress) {
  std::vector<WatchedEdge> watched;
  for (const PlySegment& piece : LongEdges(edges, kViewMinLength_m)) {
    const double samples = std::max(std::round(Length(piece) / kClearSample_m), 1.0);
    watched.push_back({piece, std::vector<int>(static_cast<std::size_t>(samples), 0)});
  }
  const Watcher watcher{rig.cameras[0], surfaces};
  const Trajectory frames = PosesApart(truth, kClearInterval_s);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(frames.size()));
    const RigidTransform T_world_camera = frames[i].T_world_imu * rig.T_imu_camera[0];
    for (WatchedEdge& edge : watched) watcher.Watch(T_world_camera, &edge);
  }
  std::vector<PlySegment> parts;
  for (const WatchedEdge& edge : watched) AddParts(edge, &parts);
  return parts;
}

}  // namespace slcmap::evaluation
