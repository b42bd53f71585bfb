// Where the lines of a map lose edges, and where wrong ones are, by direction: along the axes of
// the building, vertical, level or sloped.
//
//   line_recall MAP SEQ [FOLDER]
//
// With FOLDER: missed.csv, the places of clearly seen edges every 5 cm with the distance of the
// nearest line and mark, and wrong.csv, places on lines that no edge is near, to be drawn.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "apps/evaluation/line_gaps.h"
#include "apps/evaluation/line_metrics.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/truth.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/trajectory.h"

namespace slcmap {
namespace {

const std::map<LineAxis, const char*> kAxisNames = {{LineAxis::kX, "X or Y"},
                                                    {LineAxis::kY, "X or Y"},
                                                    {LineAxis::kVertical, "vertical"},
                                                    {LineAxis::kSloped, "sloped"},
                                                    {LineAxis::kNone, "no axis"}};

constexpr double kStep_m = 0.05, kNear_m = 0.05, kFar_m = 0.2, kMaxAngle_rad = 0.17;
constexpr std::array<double, 4> kTolerances_m = {0.02, kNear_m, 0.1, kFar_m};

std::string ClassOf(const PlySegment& segment, int64_t axis) {
  if (axis == 2) return "vertical";
  if (axis >= 0) return "X or Y";
  const Eigen::Vector3d d = (segment.end_world - segment.start_world).normalized();
  if (std::abs(d.z()) < 0.01) return "other level";
  return std::abs(d.z()) > 0.9999 ? "vertical" : "sloped";
}

struct Lengths {
  double all_m = 0, marked_m = 0;
  std::array<double, kTolerances_m.size()> within_m{};

  void Add(double step_m, double distance_m, bool marked) {
    all_m += step_m;
    for (size_t i = 0; i < kTolerances_m.size(); ++i) {
      if (distance_m <= kTolerances_m[i]) within_m[i] += step_m;
    }
    if (marked) marked_m += step_m;
  }
};

std::vector<MapLine> WithExtent(std::vector<MapLine> lines) {
  std::erase_if(lines, [](const MapLine& line) { return line.start_world == line.end_world; });
  return lines;
}

std::vector<PlySegment> CollectSegments(const std::vector<MapLine>& lines) {
  std::vector<PlySegment> segments;
  for (const MapLine& line : lines) segments.push_back({line.start_world, line.end_world});
  return segments;
}

// Calls visit(place, direction, step) along a segment.
template <typename Visitor>
void Walk(const PlySegment& segment, Visitor visit) {
  const Eigen::Vector3d along = segment.end_world - segment.start_world;
  const double length_m = along.norm(), count = std::max(1.0, std::round(length_m / kStep_m));
  for (double i = 0.5; i < count; ++i) {
    visit(Eigen::Vector3d(segment.start_world + i / count * along),
          Eigen::Vector3d(along / length_m), length_m / count);
  }
}

double DistanceTo(const SegmentIndex& index, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  const auto match = index.Nearest(p, d, kFar_m, kMaxAngle_rad);
  return match ? match->distance_m : INFINITY;
}

std::map<std::string, TrueEdges> EdgesByClass(const std::string& path) {
  std::map<std::string, TrueEdges> edges;
  for (const EdgeRow& row : ReadEdgeTable(path)) {
    if (row.to_m <= row.from_m) continue;
    TrueEdges& of_class = edges[ClassOf(row.whole, row.axis)];
    of_class.seen.push_back(row.Seen());
    // The parts of an edge follow each other.
    if (!of_class.whole.empty() && of_class.whole.back().start_world == row.whole.start_world &&
        of_class.whole.back().end_world == row.whole.end_world) {
      continue;
    }
    of_class.whole.push_back(row.whole);
    of_class.edge_of_whole.push_back(row.edge);
  }
  return edges;
}

void PrintRow(const std::string& name, const Lengths& lengths) {
  std::printf("%-16s %8.1f m", name.c_str(), lengths.all_m);
  for (const double within_m : lengths.within_m) {
    std::printf(" %6.1f %%", 100 * within_m / std::max(1e-9, lengths.all_m));
  }
  std::printf(" %6.1f %%\n", 100 * lengths.marked_m / std::max(1e-9, lengths.all_m));
}

void Measure(const std::string& map, const std::string& sequence, const std::string& folder) {
  const std::string truth = sequence + "/truth/";
  const Trajectory true_poses = ReadTrajectory(truth + "trajectory.tum");
  const Alignment alignment =
      EvaluateTrajectory(true_poses, ReadTrajectory(map + "/trajectory.tum"), {}, {})
          .absolute.front()
          .alignment;
  const auto lines = WithExtent(Aligned(alignment, ReadMapLines(map + "/lines.ply")));
  const auto marks = WithExtent(Aligned(alignment, ReadMapLines(map + "/marks.ply")));
  const SegmentIndex line_index(CollectSegments(lines)), mark_index(CollectSegments(marks));
  Warnings warnings;
  const Rig rig = ReadCalibration(truth + "rig.yaml", &warnings).rig;
  const TriangleTree surfaces(ReadSurfaces(truth + "surfaces.ply"));
  std::ofstream missed, wrong;
  if (!folder.empty()) {
    missed.open(folder + "/missed.csv");
    wrong.open(folder + "/wrong.csv");
  }
  missed << "class,x_m,y_m,z_m,dx,dy,dz,line_m,mark_m\n";
  wrong << "axis,x_m,y_m,z_m,dx,dy,dz,edge_m\n";
  std::printf("clearly seen                   2 cm     5 cm    10 cm    20 cm   marked\n");
  std::vector<PlySegment> whole;
  for (const auto& [name, edges] : EdgesByClass(truth + "edges.csv")) {
    Lengths lengths;
    for (const PlySegment& part : ClearlySeen(edges, surfaces, true_poses, rig, {})) {
      Walk(part, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& d, double step_m) {
        const double line_m = DistanceTo(line_index, p, d), mark_m = DistanceTo(mark_index, p, d);
        lengths.Add(step_m, line_m, line_m > kNear_m && mark_m <= kNear_m);
        missed << name << ',' << p.x() << ',' << p.y() << ',' << p.z() << ',' << d.x() << ','
               << d.y() << ',' << d.z() << ',' << line_m << ',' << mark_m << '\n';
      });
    }
    PrintRow(name, lengths);
    whole.insert(whole.end(), edges.whole.begin(), edges.whole.end());
  }
  const SegmentIndex all(whole);
  std::map<std::string, Lengths> precision;
  for (const MapLine& line : lines) {
    const std::string axis = "lines, " + std::string(kAxisNames.at(line.axis));
    Walk({line.start_world, line.end_world},
         [&](const Eigen::Vector3d& p, const Eigen::Vector3d& d, double step_m) {
           const double edge_m = DistanceTo(all, p, d);
           precision[axis].Add(step_m, edge_m, false);
           precision["lines"].Add(step_m, edge_m, false);
           wrong << kAxisNames.at(line.axis) << ',' << p.x() << ',' << p.y() << ',' << p.z() << ','
                 << d.x() << ',' << d.y() << ',' << d.z() << ',' << edge_m << '\n';
         });
  }
  for (const MapLine& line : marks) {
    Walk({line.start_world, line.end_world},
         [&](const Eigen::Vector3d& p, const Eigen::Vector3d& d, double step_m) {
           precision["marks"].Add(step_m, DistanceTo(all, p, d), false);
         });
  }
  for (const auto& [name, lengths] : precision) PrintRow(name, lengths);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::cerr << "usage: line_recall MAP SEQ [FOLDER]\n";
    return 2;
  }
  try {
    slcmap::Measure(argv[1], argv[2], argc > 3 ? argv[3] : "");
  } catch (const slcmap::Error& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
