// What an adjustment over all keyframes of a run estimates, and what was observed of it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mapping/adjustment/options.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/imu_factor.h"
#include "odometry/factors/line_residual.h"
#include "odometry/factors/point_residual.h"
#include "odometry/geometry/lines.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// The numbers of all parameter blocks, side by side in the order in which they are added: Ceres
// orders blocks by their addresses, and the same run has to give the same bytes.
class BlockStore {
 public:
  explicit BlockStore(size_t capacity) { numbers_.reserve(capacity); }
  // The address stays; more than the capacity must not be added.
  double* Add(std::span<const double> values);

 private:
  std::vector<double> numbers_;
};

// A keyframe: its pose, and its speed and biases.
struct AdjustedFrame {
  const Keyframe* keyframe = nullptr;
  double* pose = nullptr;
  double* speed_bias = nullptr;
  ImuCut cut;
  std::unique_ptr<Preintegration> from_previous;  // none for the first of a segment
};

// Observations name keyframes by their index.
struct AdjustedPointObservation {
  size_t frame = 0;
  StereoMeasurement measurement;
};

struct AdjustedLineObservation {
  size_t frame = 0;
  StereoLineMeasurement measurement;
};

// A point, by its inverse depth in the left camera of its host, the first keyframe that saw it, or
// in the one that sees it, where two look apart.
struct AdjustedPoint {
  const Landmark* landmark = nullptr;
  size_t host = 0;
  int camera = 0;
  double* block = nullptr;
  bool is_tied = false;                                // to another, by a known distance
  std::vector<AdjustedPointObservation> observations;  // by keyframe
};

// What lines of an axis that are near each other share of their deviation.
struct AdjustedShare {
  LineAxis axis = LineAxis::kNone;
  int world = -1;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double* block = nullptr;
};

struct AdjustedLine {
  const Line* line = nullptr;
  LineAxis axis = LineAxis::kNone;  // of the heading's X and Y
  bool exact = false;               // along its axis: two freedoms, else four
  double* heading = nullptr;        // null for all but those along X and Y
  double* slope = nullptr;          // null for all but sloped ones
  double* share = nullptr;          // null where it shares none
  double deviation_sigma_rad = 0;   // of its own from its axis or slope
  Eigen::Vector3d anchor_world = Eigen::Vector3d::Zero();
  double* block = nullptr;
  std::vector<AdjustedLineObservation> observations;  // by keyframe

  PointAndDirection InWorld() const;
};

// A block of numbers that refers to a world or slope of the run; null where that was withdrawn.
struct AdjustmentState {
  explicit AdjustmentState(size_t capacity) : blocks(capacity) {}

  BlockStore blocks;
  Rig rig;  // rectified
  std::vector<AdjustedFrame> frames;
  double* imu_calibration = nullptr;
  double* camera_calibration = nullptr;
  std::vector<double*> headings, slopes;
  std::vector<AdjustedShare> shares;
  double share_sigma_rad = 0;
  std::vector<AdjustedPoint> points;
  std::vector<AdjustedLine> lines;
  double* control_shift = nullptr;  // see ControlTie

  CalibrationState calibration() const;
};

// A landmark of the run, and where it was measured to be, in the run's world but for a common small
// turn about z and a shift, which are estimated. Metres.
struct ControlTie {
  int64_t landmark_id = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();
};

// Two landmarks of the run, and how far apart they were measured to be.
struct DistanceTie {
  int64_t from_id = 0, to_id = 0;
  double metres = 0, sigma_m = 0;
};

struct ControlTies {
  std::vector<ControlTie> points;
  std::vector<DistanceTie> distances;

  bool empty() const { return points.empty() && distances.empty(); }
};

// The shift s and the turn psi about z that all ties share.
inline constexpr int kControlShiftSize = 4;
inline constexpr BlockKind kControlShiftKind{kControlShiftSize, kControlShiftSize};

// All that the run knows, as it has it; points that too few keyframes saw and lines of headings
// that were withdrawn are left out. The run must outlive the state.
AdjustmentState StateOfRun(const OdometryRun& run, const AdjustmentOptions& options);

// The position of a point, with the cameras as they are estimated.
Eigen::Vector3d PointInWorld(const AdjustedPoint& point, const AdjustmentState& state);

// Preintegrates the samples between neighbouring keyframes about their biases, cut at the estimated
// time of exposure.
void Preintegrate(const OdometryRun& run, AdjustmentState* state);

}  // namespace slcmap::mapping
