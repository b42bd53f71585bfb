// The lines of a simulated recording before they are told apart, what votes for each of them being
// an edge, and whether it is one: a row a line, for fit_line_votes.py.
//
//   line_votes RUN SEQ > votes.csv    SEQ with its truth/
#include <cstdio>
#include <iostream>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/truth.h"
#include "data/core/error.h"
#include "mapping/adjustment/adjustment.h"
#include "mapping/dense/dense_map.h"
#include "mapping/lines/line_kinds.h"
#include "mapping/lines/map_lines.h"
#include "mapping/map/refinement.h"
#include "mapping/options.h"
#include "mapping/views/recorded_views.h"
#include "odometry/run/run_folder.h"

namespace slcmap {
namespace {

constexpr double kTolerance_m = kLineTolerances_m[2];

struct FoundLines {
  std::vector<TrackedLine> tracked;
  std::vector<MapLine> pieces;
  Trajectory keyframes;
};

FoundLines FindLines(const std::string& run_folder, const std::string& sequence) {
  const MappingOptions options;
  const OdometryRun online = ReadRunFolder(run_folder);
  OdometryRun run =
      AdjustRun(online, options.adjustment, KeyframeImages(online, sequence).get()).run;
  TurnAlongBuilding(&run);
  const RecordedViews recorded = ViewsOfRun(run, sequence);
  MapResult map;
  MapDensely(recorded.views, *recorded.images, options.dense, options.occupancy, {}, &map);
  const RecordedViews chosen = ViewsForLines(recorded, options.lines.views);
  const VisibilityDepths depths(map.dense, options.dense.voxel_m,
                                ViewCameras(chosen.views, chosen.images->rig()));
  const std::vector<BuildingAxis> axes = AxesOfRun(run, options.lines.min_axis_sigma_rad);
  FoundLines found;
  found.tracked = TrackLines(
      chosen.views, *chosen.images, axes,
      KnownLines(run, axes, options.run_lines.max_sigma_m, options.run_lines.min_observations),
      depths, LineSurfaces(map.dense), options.lines);
  found.pieces = AsMapLines(found.tracked, axes);
  for (const Keyframe& keyframe : run.keyframes) {
    found.keyframes.push_back({keyframe.stamp_ns, keyframe.T_world_imu});
  }
  return found;
}

// The share of a line's length that is on an outline of a round thing, which is no mark either.
double ShareOnPipes(const std::vector<TruePipe>& pipes, const std::vector<MapLine>& pieces) {
  constexpr int kPlaces = 10;
  int on = 0, all = 0;
  for (const MapLine& piece : pieces) {
    for (int i = 0; i < kPlaces; ++i, ++all) {
      const double share = (i + 0.5) / kPlaces;
      const Eigen::Vector3d p = (1 - share) * piece.start_world + share * piece.end_world;
      on += std::any_of(pipes.begin(), pipes.end(), [&](const TruePipe& pipe) {
        const Eigen::Vector3d axis = pipe.end_world - pipe.start_world;
        const double along =
            std::clamp((p - pipe.start_world).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
        const double distance_m = (pipe.start_world + along * axis - p).norm();
        return std::abs(distance_m - pipe.radius_m) < kTolerance_m;
      });
    }
  }
  return static_cast<double>(on) / std::max(all, 1);
}

void Print(const std::string& run_folder, const std::string& sequence) {
  const FoundLines found = FindLines(run_folder, sequence);
  const TrajectoryMetrics trajectory =
      EvaluateTrajectory(ReadTrajectory(sequence + "/truth/trajectory.tum"), found.keyframes, {});
  const std::vector<MapLine> pieces = Aligned(trajectory.absolute.front().alignment, found.pieces);
  const TrueEdges truth = ReadTrueEdges(sequence + "/truth/edges.csv");
  const std::vector<TruePipe> pipes = ReadTruePipes(sequence + "/truth/pipes.csv");
  std::printf("length_m,on_edge,on_pipe,edge_probability,votes\n");
  for (size_t i = 0; i < found.tracked.size(); ++i) {
    std::vector<MapLine> line;
    for (const MapLine& piece : pieces) {
      if (piece.id == static_cast<int64_t>(i)) line.push_back(piece);
    }
    const LineMetrics metrics = EvaluateLines(truth, line);
    std::printf("%.4f,%.4f,%.4f,%.4f", metrics.mapped_length_m, metrics.scores[2].precision,
                ShareOnPipes(pipes, line), ComputeEdgeProbability(found.tracked[i]));
    for (const double vote : CountVotes(found.tracked[i])) std::printf(",%.6g", vote);
    std::printf("\n");
  }
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: line_votes RUN SEQ\n";
    return 2;
  }
  try {
    slcmap::Print(argv[1], argv[2]);
  } catch (const slcmap::Error& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
