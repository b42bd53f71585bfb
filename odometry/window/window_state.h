// What the sliding window holds: states, landmarks, and the prior; what a later image still shows
// of it, and its lines and directions as a frame's cameras see them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <unordered_set>
#include <vector>

#include "data/core/types.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/imu_factor.h"
#include "odometry/factors/line_residual.h"
#include "odometry/factors/point_residual.h"
#include "odometry/geometry/exposure.h"
#include "odometry/geometry/imu.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline odometry {

using PoseBlock = std::array<double, kPoseSize>;
using SpeedBiasBlock = std::array<double, kSpeedBiasSize>;

// The state of the body (see odometry/factors/blocks.h) at one image, with what the image showed.
// Its address is fixed while it lives: residuals and the prior point into it.
struct FrameState {
  int64_t id = 0;
  int64_t stamp_ns = 0;
  PoseBlock pose{0, 0, 0, 0, 0, 0, 1};
  SpeedBiasBlock speed_bias{};
  // Where the prior has linearised the blocks; unset while it does not touch them.
  std::optional<PoseBlock> pose_linearization;
  std::optional<SpeedBiasBlock> speed_bias_linearization;
  std::unique_ptr<Preintegration> from_previous;      // from the frame before; none for the oldest
  ImuCut cut;                                         // where from_previous ends
  std::map<int64_t, StereoMeasurement> measurements;  // by landmark id
  std::map<int64_t, StereoLineMeasurement> lines;     // by line id
  FeltMotion felt;  // around the stamp; only where rows are not exposed at it
  bool stands_still = false;
  std::optional<int64_t> rests_since_ns;  // from then to its cut the rig has not moved

  int64_t cut_stamp_ns() const { return stamp_ns + cut.offset_ns; }
  RigidTransform T_world_imu() const { return PoseFromBlock(pose.data()); }
  Eigen::Vector3d velocity() const { return Eigen::Vector3d::Map(speed_bias.data()); }
  Eigen::Vector3d gyro_bias() const { return Eigen::Vector3d::Map(speed_bias.data() + 3); }
  Eigen::Vector3d accel_bias() const { return Eigen::Vector3d::Map(speed_bias.data() + 6); }
};

// A point, by its inverse depth in the camera that follows it, of the frame that hosts it: the
// oldest frame of the window that saw it.
struct PointLandmark {
  int64_t id = 0;
  int camera = 0;                          // that follows it: the left one of its pair
  std::vector<FrameState*> frames;         // that saw it, oldest first; the first is the host
  std::array<double, kPointSize> point{};  // x, y on z = 1 and the inverse depth in 1 / m
  bool triangulated = false;
  int released_frames = 0;  // that saw it too, but have left the window

  FrameState* host() const { return frames.front(); }
  double inverse_depth_per_m() const { return point[2]; }
};

using HeadingBlock = std::array<double, kHeadingSize>;

// The heading of a Manhattan world. Its address is fixed while the segment lasts.
struct HeadingState {
  int world = 0;  // counts those of the segment
  HeadingBlock heading_rad{};
  std::optional<HeadingBlock> linearization;
  double found_sigma_rad = 0;  // as it was found
  int64_t found_at_ns = 0;
  int lines_kept = 0;      // that followed it and have left the window
  int lines_given_up = 0;  // that were taken to follow it, and turned out not to
  bool withdrawn = false;  // nothing follows it any more
};

using SharedDeviationBlock = std::array<double, kSharedDeviationSize>;

// By how much lines of one axis that are near each other are off it in common; see
// odometry/factors/line_constraints.h. Its address is fixed while it lives.
struct SharedDeviation {
  LineAxis axis = LineAxis::kNone;
  const HeadingState* heading = nullptr;              // of its lines' world; null for vertical ones
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  // around which its lines were seen
  SharedDeviationBlock off_rad{};
  double sigma_rad = 0;  // as it is known without its lines
};

// A slope that lines share. Its address is fixed while the segment lasts.
struct SlopeState {
  int index = 0;  // counts those of the segment
  SlopeBlock angles_rad{};
  std::optional<SlopeBlock> linearization;
  double found_sigma_rad = 0;  // as it was found
  int64_t found_at_ns = 0;
  int lines_kept = 0;      // that followed it and have left the window
  int lines_given_up = 0;  // that were taken to follow it, and turned out to be off it
  bool withdrawn = false;  // nothing follows it any more
};

// How far along itself a line was seen, in metres from the point of it that is nearest to its
// anchor. The outermost end on either side is left out: a single wrong match must not stretch a
// line.
class LineExtent {
 public:
  void Add(double from_m, double to_m);
  // All that another line was seen along, whose nearest point is so far along this one.
  void Add(const LineExtent& other, double along_m);
  bool empty() const { return from_m_[0] > to_m_[0]; }
  double from_m() const { return std::isfinite(from_m_[1]) ? from_m_[1] : from_m_[0]; }
  double to_m() const { return std::isfinite(to_m_[1]) ? to_m_[1] : to_m_[0]; }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> from_m_{kInfinity, kInfinity};  // the two lowest, lowest first
  std::array<double, 2> to_m_{-kInfinity, -kInfinity};  // the two highest, highest first
};

// A line: along an axis of the building, with two degrees of freedom where it is exactly along it
// and with four of which two are tied to the axis where it may deviate, along a slope, to which it
// is tied likewise, or of any direction with four. Unlike a point it is hosted by no frame: its
// block stays, in the prior too, when frames leave.
struct LineLandmark {
  int64_t id = 0;
  int camera = 0;                   // that looks for it: the left one of its pair
  std::vector<FrameState*> frames;  // of the window that saw it, oldest first
  LineAxis axis = LineAxis::kNone;
  HeadingState* heading = nullptr;  // of its world; null for all but those along X and Y
  SlopeState* slope = nullptr;      // that a sloped line follows, null for others
  Eigen::Vector3d anchor_world = Eigen::Vector3d::Zero();
  // How far a line of an axis or a slope may be off its direction, beside what it shares with its
  // neighbours; zero for one that is exactly along its axis.
  double deviation_sigma_rad = 0;
  SharedDeviation* shared = nullptr;  // null for one that shares none
  GeneralLineBlock block{};           // of a line exactly along an axis the first numbers
  std::optional<GeneralLineBlock> linearization;
  bool estimated = false;  // triangulated, and part of the cost
  bool retired = false;    // no longer part of the cost; the prior has yet to forget it
  bool finished = false;   // what is seen of the edge from now on is another line
  std::vector<int64_t> released_frames;  // ids of those that saw it but have left, oldest first
  LineExtent extent;
  std::vector<int64_t> points;  // landmarks that belong to it; see odometry/window/line_priors.h
  // The landmark that it was placed through, where its views alone did not tell where it is.
  std::optional<int64_t> placed_by;

  bool IsStructural() const { return axis != LineAxis::kNone; }
  // Its direction is that of the axis, and no state.
  bool IsExact() const { return IsStructural() && deviation_sigma_rad == 0; }
  // Its direction is a state that is tied to the axis.
  bool MayDeviate() const { return IsStructural() && !IsExact(); }
  const BlockKind& kind() const { return IsExact() ? kStructuralLineKind : kGeneralLineKind; }
  StructuralLine structural() const { return {axis, anchor_world}; }
  double heading_rad() const { return heading ? heading->heading_rad[0] : 0; }
  // The direction of the axis or slope that it follows, and the axes across that.
  Eigen::Vector3d AxisInWorld() const;
  Matrix32d AcrossAxisInWorld() const;
  // The id of the last frame whose observation of it counts; -1 where none does.
  int64_t last_seen_frame() const {
    if (!frames.empty()) return frames.back()->id;
    return released_frames.empty() ? -1 : released_frames.back();
  }
  // The point nearest to the anchor, and the direction.
  PointAndDirection InWorld() const;
};

// A cut so much after a stamp. The gyroscope's rate is averaged before it: what its noise alone
// says must not look as if the motion told the time offset.
ImuCut MakeCut(const ImuBuffer& imu, int64_t stamp_ns, int64_t offset_ns);

struct WindowState {
  std::deque<std::unique_ptr<FrameState>> frames;  // oldest first
  std::map<int64_t, PointLandmark> landmarks;      // by id
  std::deque<HeadingState> headings;               // by world
  std::list<SharedDeviation> shared_deviations;
  std::deque<SlopeState> slopes;          // by index
  std::map<int64_t, LineLandmark> lines;  // by id
  Prior prior;
};

// The headings of all worlds, radians, by world; none of those that were withdrawn.
std::vector<std::optional<double>> CollectHeadings(const WindowState& window);

// The estimated structural lines that a landmark belongs to.
std::vector<LineLandmark*> CollectLines(const PointLandmark& landmark, WindowState* window);

// The camera that a landmark is told in, at its host.
RigidTransform WorldFromHost(const PointLandmark& landmark, const StereoGeometry& geometry);

// The position of a triangulated landmark.
Eigen::Vector3d LandmarkInWorld(const PointLandmark& landmark, const StereoGeometry& geometry);

// The points of the last keyframe, and those of them that a later frame has.
struct KeptPoints {
  int all = 0, kept = 0;
  // Shown by something else than the last keyframe's left image. What was detected in noise is soon
  // gone, and must not look as if the view had changed.
  int proven = 0, proven_kept = 0;

  // Those that the later frame proves count too.
  int True() const { return proven + kept - proven_kept; }
  bool AreFewerThan(double share) const;
};

// A point is proven by a keyframe before the last one, or by the last one's right image together
// with the image that came next, which had the points `followed` (none while it is the frame):
// noise is found alike in both images of a pair often enough, but not in the next one as well.
KeptPoints CountKept(const WindowState& window, const FrameState& frame,
                     const std::optional<std::unordered_set<int64_t>>& followed);

// Where the estimated lines are expected in a frame's cameras, in pixels of the rectified images.
std::vector<LinePrediction> PredictLines(const WindowState& window, const FrameState& frame,
                                         const Rig& rectified_rig);

// The vertical, the horizontal axes of all known worlds, and all known slopes, in a frame's left
// (or first) camera.
std::vector<Eigen::Vector3d> AxesInCamera(const WindowState& window, const FrameState& frame,
                                          const Rig& rectified_rig);

// What a frame saw of lines, in pixels of the rectified cameras, which share their intrinsics.
std::vector<LineObservation> LinesInPixels(const FrameState& frame, const Camera& camera);

}  // namespace slcmap::odometry
