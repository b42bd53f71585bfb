// What mapping hands to export: the contents of a map folder, in memory.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/map_line.h"
#include "data/sequence_options.h"
#include "data/trajectory.h"
#include "data/types.h"
#include "data/verdict.h"
#include "mapping/adjustment/adjustment_figures.h"
#include "mapping/building/building.h"
#include "mapping/dense/dense_point.h"
#include "mapping/given_poses/given_pose_figures.h"
#include "mapping/line_evidence.h"
#include "mapping/occupancy_map.h"
#include "mapping/pipes/map_pipe.h"
#include "mapping/point_observation.h"

namespace slcmap {

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
  // Of its poses, as the map has them: no other run has any in between. None of a map that was
  // merged by an earlier version, or of a run without poses.
  std::optional<StampSpan> poses_ns;
  SequenceOptions opened = {};  // as MapSource has it
};

// Where a map came from; a merged one from its first run.
struct MapSource {
  std::string run_id;
  RigidTransform T_world_run;  // from the run's world to the map's: a turn about z
  // Added to the map's coordinates they are those of poses that were given far from their origin,
  // as in UTM.
  Eigen::Vector3d world_offset_m = Eigen::Vector3d::Zero();
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
  std::optional<GivenPoseFigures> given_poses;
  // The raw cameras with what the run, or its adjustment, found of their calibration; none of a run
  // that does not say how they were calibrated. Not read back.
  std::optional<Rig> calibrated_rig;
  Trajectory trajectory;  // refined, a pose an image
  Trajectory keyframes;
  std::vector<MapPoint> points;
  std::vector<MapPointObservation> point_observations;  // by point, track, stamp and camera
  std::vector<DensePoint> dense;  // none of a map that was made without images
  std::vector<MapLine> lines;     // but marks
  std::vector<MapLine> marks;     // lines that are on surfaces, and no edges of them
  LineEvidence line_evidence;     // for lines and marks
  std::vector<MapPipe> pipes;     // their outlines are not among the lines
  Building building;              // empty of a map that was made without images
  OccupancyMap occupancy{0.1};
};

}  // namespace slcmap
