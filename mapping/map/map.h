// What mapping hands to export: the contents of a map folder, in memory. Its points and lines with
// the images that show them, its pipes, poses and figures.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "data/core/coordinate_system.h"
#include "data/core/math.h"
#include "data/core/types.h"
#include "data/core/verdict.h"
#include "data/io/map_line.h"
#include "data/io/trajectory.h"
#include "data/source/sequence_source.h"
#include "mapping/map/building.h"
#include "mapping/map/control_fit.h"
#include "mapping/map/occupancy_map.h"
#include "mapping/map/plan_comparison.h"

namespace slcmap::inline mapping {

// What an adjustment was made of, and how it went.
struct AdjustmentFigures {
  int64_t keyframes = 0, points = 0, point_observations = 0, lines = 0, line_observations = 0;
  int64_t rejected_point_observations = 0, rejected_line_observations = 0;
  int64_t closures = 0, closures_rejected = 0;    // found, and of these
  int64_t matched_points = 0, matched_edges = 0;  // of those that stayed
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;  // half the robustified sum of squares
};

// How an adjustment of poses that were given went.

struct ExternalPoseFigures {
  int64_t views = 0, pairs = 0, points = 0;
  // How far points are from where poses have them: the median over pairs of views of the length of
  // their median.
  double given_off_px = 0, off_px = 0;
  // What all poses shared: how far the body that was tracked is turned and shifted against the
  // rig's IMU, and how far its clock is behind the images'.
  double body_turned_rad = 0, body_shifted_m = 0, clock_s = 0;
  double moved_m = 0, turned_rad = 0;  // of each on top of that: root mean square over the views
};

// A point of a surface.
struct DensePoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();        // metres
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();  // towards the cameras that saw it
  double sigma_m = 0;                                       // along the normal
  uint8_t grey = 0;
};

// What a map knows of its lines besides what MapLine says: how well each is known along its
// length, and which images show it.

// A piece of a line is one of the MapLines that share its id: they count from 0, in their order.

// What the ends of a piece may be off across the line, in the axes of the world; along it they
// say how far it was seen, so nothing is said of that. The displacement of the place at the share t
// of the way from start to end is (1 - t) times that of the start and t times that of the end.
struct LineCovariance {
  int64_t line_id = 0;
  int piece = 0;
  Eigen::Matrix3d start_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d end_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d start_end_m2 = Eigen::Matrix3d::Zero();  // rows: the start's x, y, z
};

// The edge of a piece in a rectified image: how far it was seen there.
struct LineSupport {
  int64_t line_id = 0;
  int piece = 0;
  int64_t stamp_ns = 0;  // of the image
  int camera = 0;        // of the rig
  LineSegment px;
};

// What they are ordered by.
inline auto MakeKey(const LineCovariance& covariance) {
  return std::tuple(covariance.line_id, covariance.piece);
}
inline auto MakeKey(const LineSupport& support) {
  return std::tuple(support.line_id, support.piece, support.stamp_ns, support.camera);
}

struct LineEvidence {
  std::vector<LineCovariance> covariances;
  std::vector<LineSupport> supports;
};

// A pipe of a map: a straight round thing.

struct MapPipe {
  int64_t id = 0;
  int segment = 0;  // of the run
  LineAxis axis = LineAxis::kNone;
  int world = -1;                                         // as of a line (data/io/map_line.h)
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();  // of its axis, as far as it was seen
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  double radius_m = 0;
  double sigma_m = 0;         // standard deviation of the axis across it, where that is largest
  double radius_sigma_m = 0;  // of the radius
  int images = 0;             // that show an outline of it
};

// Marks on a surface that repeat at one distance: joints of bricks, tiles and boards.
struct MapPattern {
  int64_t id = 0;
  int segment = 0;                                             // of the run
  Eigen::Vector3d origin_world = Eigen::Vector3d::Zero();      // on one of its lines
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();  // of its lines
  Eigen::Vector3d across_world = Eigen::Vector3d::UnitZ();     // from line to line
  double spacing_m = 0;
  double scatter_m = 0;           // of lines about their places, as standard deviation
  Interval along_m, across_m;     // from the origin, as far as they were seen
  std::vector<int64_t> line_ids;  // of the marks, in order
};

// Where a rectified image shows what a point of the map was made of. A track is one feature,
// followed from image to image; a point that was fused of several has as many, which lie a little
// beside it and each other.
struct MapPointObservation {
  int64_t point = 0;     // of the map's, from 0
  int track = 0;         // of the point's, from 0
  int64_t stamp_ns = 0;  // of the image
  int camera = 0;        // of the rig
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
};

// What they are ordered by.
inline auto MakeKey(const MapPointObservation& seen) {
  return std::tuple(seen.point, seen.track, seen.stamp_ns, seen.camera);
}

// A point of the cloud, fused from the landmarks of one voxel.
struct MapPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double sigma_m = 0;                 // standard deviation along the landmarks' rays
  int observations = 0;               // summed over the landmarks
  std::vector<int64_t> landmark_ids;  // those that were fused; not kept in files
  int64_t line_id = -1;               // of the line that it lies on; -1: of none
};

// From a stamp to a later one.
struct StampSpan {
  int64_t from_ns = 0, to_ns = 0;
};

// A run that went into a map that was merged of several.
struct MergedRun {
  std::string run_id, sequence, version;  // as MapSource has them
  int64_t stamps_moved_ns = 0;            // stamps of the run are this much earlier
  RigidTransform T_world_run;             // from the run's world: a turn about z, and a translation
  // Of its poses, as the map has them: no other run has any in between. None of a run without
  // poses.
  std::optional<StampSpan> poses_ns;
  SequenceOptions opened = {};  // as MapSource has it
  std::string date = {};        // of the recording, YYYY-MM-DD; "": not said
};

// Where a map came from; a merged one from its first run.
struct MapSource {
  std::string run_id;
  RigidTransform T_world_run;  // from the run's world to the map's: a turn about z
  // Where it lies in a grid: by control points, or of poses that were given far from their origin,
  // as in UTM (MoveNearOrigin), without a name and not turned.
  std::optional<Georeference> georeference = {};
  std::string sequence;           // folder of the recording; "" of a run that was made by hand
  SequenceOptions opened;         // how it was opened
  std::string version;            // of slcmap
  std::string options;            // YAML: all of mapping's in effect
  std::vector<MergedRun> merged;  // all runs of a merged map, the first among them; else none
};

struct MapResult {
  std::string id;  // of its contents; set when it is written or read
  MapSource source;
  std::string method;
  bool complete = false;
  std::string partial_reason;
  bool interrupted = false;                 // before it was done
  std::map<std::string, int64_t> warnings;  // counted by kind
  std::optional<Verdict> verdict;           // on the run
  Rig rectified_rig;                        // the cameras of the images that observations are of
  // What the adjustment over all keyframes was made of; none where there was none. Not read back.
  std::optional<AdjustmentFigures> adjustment;
  // How poses that were given were moved; none where they stay. Not read back.
  std::optional<ExternalPoseFigures> given_poses;
  // The raw cameras with what the run, or its adjustment, found of their calibration; none of a run
  // that does not say how they were calibrated. Not read back.
  std::optional<Rig> calibrated_rig;
  Trajectory trajectory;  // refined, a pose an image
  Trajectory keyframes;
  std::vector<MapPoint> points;
  std::vector<MapPointObservation> point_observations;  // by point, track, stamp and camera
  std::vector<DensePoint> dense;   // measured by stereo; none of a map that was made without images
  std::vector<DensePoint> filled;  // derived: on planes of the building, where nothing was measured
  std::vector<MapLine> lines;      // but marks; and junctions, which are derived (IsJunction)
  std::vector<MapLine> marks;      // lines that are on surfaces, and no edges of them
  std::vector<MapPattern> patterns;  // of marks
  LineEvidence line_evidence;        // for lines and marks
  std::vector<MapPipe> pipes;        // their outlines are not among the lines
  Building building;                 // empty of a map that was made without images
  // Of the surfaces that the cameras saw, as far as the map can tell, that which it holds: 0 to 1.
  // None of a map that was made without images.
  std::optional<double> seen_share = {};
  std::optional<ControlFit> control = {};  // how it lies on control points, if they were given
  std::optional<PlanComparison> plan;  // where it lies in a plan of the building, if it was given
  OccupancyMap occupancy{0.1};
};

// The points of surfaces as files have them: those that were measured, then those that were filled.
inline std::size_t CountDense(const MapResult& map) { return map.dense.size() + map.filled.size(); }
inline bool IsFilled(const MapResult& map, std::size_t index) { return index >= map.dense.size(); }
inline const DensePoint& DenseAt(const MapResult& map, std::size_t index) {
  return IsFilled(map, index) ? map.filled[index - map.dense.size()] : map.dense[index];
}

// Of the rig's body, in world, for all keyframes and all images of the trajectory.
inline std::unordered_map<int64_t, RigidTransform> PosesByStamp(const MapResult& map) {
  std::unordered_map<int64_t, RigidTransform> poses;
  for (const Trajectory* trajectory : {&map.keyframes, &map.trajectory}) {
    for (const StampedPose& pose : *trajectory) poses.emplace(pose.stamp_ns, pose.T_world_imu);
  }
  return poses;
}

}  // namespace slcmap::mapping
