// How straight, flat and square a run is, without a true building.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/evaluation/truth.h"
#include "data/core/progress.h"
#include "data/io/trajectory.h"
#include "odometry/run/run.h"

namespace slcmap::inline evaluation {

// A place in the frame of the IMU, from one stereo pair alone.
struct Placed {
  Eigen::Vector3d p_imu = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  // of rank 2 or 3, in the IMU's axes
};

// What one stereo pair shows of an edge. Ends along it are not repeatable.
struct EdgeObservation {
  int64_t edge = 0;
  int64_t stamp_ns = 0;
  std::array<Placed, 2> ends;
};

struct PointOfPair {
  int64_t stamp_ns = 0;
  Placed place;
};

struct ReferenceObservations {
  std::vector<EdgeObservation> edges;  // by keyframe
  std::vector<PointOfPair> points;     // by keyframe
  int64_t left_out = 0;  // observations whose places are not known, or not well enough
};

// The observations of a run's lines and points by both cameras. Edges are those that the run took
// its lines to be. Throws StoppedError when progress says so.
ReferenceObservations ObservationsOfRun(const OdometryRun& run, const Progress& progress = {});

// The same observations of edges, told apart by the true edges that they lie on from true poses, so
// that an edge that is seen again later is one edge, whatever the run took it for. What is on none,
// or on several, is left out; so is what has no true pose.
std::vector<EdgeObservation> OnTrueEdges(const std::vector<EdgeObservation>& observations,
                                         const Trajectory& truth, const TrueEdges& edges);

// Those that all trajectories have a pose for.
ReferenceObservations SeenByAll(const ReferenceObservations& observations,
                                const std::vector<const Trajectory*>& trajectories);

// A place as a pose has it in the world.
struct PlacedInWorld {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
};
PlacedInWorld InWorld(const Placed& place, const RigidTransform& T_world_imu);

// How straight edges are by observations that are placed alone, and how square directions are.

struct WeightedDirection {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // unit; its sign means nothing
  double weight = 1;                                     // such as a length
};

struct DirectionMetrics {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, at right angles; of any sign
  double following = 0;                                // share of the weight near an axis
  double dispersion_deg = 0;                           // weighted RMS angle of these to their axes
  // From 90 degrees, of axes that are fitted each by itself; nothing where two have too few.
  std::optional<double> orthogonality_deg;  // the largest
};

// The axes are those, of all pairs of directions, that most weight follows, then refined by least
// squares. The world may be turned as it likes. What is further than max_angle_deg from an axis
// follows none; an axis needs min_weight, a share of all weight, to be fitted by itself. Nothing
// without two directions at about a right angle.
std::optional<DirectionMetrics> MeasureDirections(const std::vector<WeightedDirection>& directions,
                                                  double max_angle_deg = 5,
                                                  double min_weight = 0.02);

// The axis (0, 1, 2) within max_angle_deg of a direction; nothing where there is none.
std::optional<int> FindAxis(const Eigen::Matrix3d& axes, const Eigen::Vector3d& direction,
                            double max_angle_deg);

// How straight edges are that a building has straight: each observation placed alone with the pose
// of its moment, one line fitted to all of them.

// A line fitted to observations of an edge, which nothing imposed a direction on.
struct FittedEdge {
  int64_t edge = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();           // in its middle
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();  // unit
  double length_m = 0;
  double direction_sigma_rad = 0;  // where that is largest
  double thickness_m = 0;
  int observations = 0;
};

// How far apart observations of one edge are that were made so long after each other.
struct TimeGap {
  double from_s = 0, to_s = 0;  // to_s is infinite in the last
  int64_t pairs = 0;
  double apart_m = 0;  // RMS; kNoFigure without pairs
};

struct EdgeStraightness {
  int64_t edges = 0;
  int64_t observations = 0;
  int64_t without_pose = 0;  // observations that the trajectory has no pose for
  // RMS distance of the observations' ends from their lines. A distance counts by how well a stereo
  // pair knows it in its direction: with residuals r across the line and weights W = (C + s^2
  // I)^-1, sqrt(2 sum r'Wr / sum tr W). kNoFigure without edges.
  double thickness_m = 0;
  std::vector<TimeGap> gaps;
  std::vector<FittedEdge> lines;  // by edge
};

// Throws StoppedError when progress says so.
EdgeStraightness RetriangulateEdges(const std::vector<EdgeObservation>& observations,
                                    const Trajectory& trajectory, const Progress& progress = {});

// What is left of a thickness without that which the observations have with true poses: by squares,
// as errors add up that have nothing to do with each other.
double ThicknessBeyond_m(double thickness_m, double with_true_poses_m);

// The observations without those that are far from the line through all of their edge, with the
// poses of one trajectory: of things that its run took for the edge and are not. To be called once,
// for all trajectories.
std::vector<EdgeObservation> OfOneEdge(const std::vector<EdgeObservation>& observations,
                                       const Trajectory& trajectory);

// How flat a cloud is.

// A. Kornilova and G. Ferrer, "Be your own benchmark: no-reference trajectory metric on
// registered point clouds", ECMR 2021; the first two go back to D. Droeschel and S. Behnke (2014).
struct FlatnessMetrics {
  int64_t points = 0;            // of the cloud
  int64_t looked_at = 0;         // that have neighbours enough
  double mpv_m2 = 0;             // mean plane variance: mean of the neighbourhoods' least variances
  double mme = 0;                // mean map entropy: of 0.5 ln det(2 pi e covariance), in nats
  int64_t on_planes = 0;         // points on mutually orthogonal planes
  std::optional<double> mom_m2;  // MPV over these; nothing where there are none
};

// radius_m: of a point's neighbourhood. Nothing where no point has neighbours enough. Throws
// StoppedError when progress says so.
std::optional<FlatnessMetrics> MeasureFlatness(const std::vector<Eigen::Vector3d>& points,
                                               double radius_m, const Progress& progress = {});

// Measures of straightness that need no truth, of one trajectory: all trajectories of a sequence
// with the same observations.

// What is known of a sequence beside its recording; nothing where empty.
struct KnownTruth {
  Trajectory trajectory;
  TrueEdges edges;  // in the world of the trajectory
};

// What all trajectories of a sequence are measured with.
struct StraightnessReference {
  ReferenceObservations observations;
  bool true_edges = false;  // tell the edges apart, else the run's lines do
};

// The observations of a run that all `trajectories` have a pose for. Where no true poses are known,
// the run's own, `final_poses`, tell what belongs together. Here and below StoppedError is thrown
// when progress says so.
StraightnessReference MakeReference(const OdometryRun& run, const Trajectory& final_poses,
                                    const std::vector<const Trajectory*>& trajectories,
                                    const KnownTruth& truth, const Progress& progress = {});

struct Straightness {
  EdgeStraightness edges;
  std::optional<DirectionMetrics> directions;  // of the edges' free lines, by their lengths
  std::optional<FlatnessMetrics> flatness;     // of the free points
};

Straightness MeasureStraightness(const StraightnessReference& reference,
                                 const Trajectory& trajectory, const Progress& progress = {});

}  // namespace slcmap::evaluation
