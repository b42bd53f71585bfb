// What odometry hands to mapping: the contents of a run folder, in memory. Its method, and what it
// knows about itself, in figures.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/core/types.h"
#include "data/core/verdict.h"
#include "data/io/trajectory.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline odometry {

// Landmarks and sensors in use; see apps/README.md, "Methods".
enum class Method { kPointsMono, kPoints, kPointsLines, kStructural, kSlc };

// Throws ConfigError naming the methods there are.
Method MethodFromName(const std::string& name);
// The method of a run whose poses somebody else has estimated.
inline constexpr const char* kExternalPoses = "poses";

// The same as a DataError that names the place where the name was found; kExternalPoses is one.
void CheckMethodName(const std::string& place, const std::string& name);
std::string MethodName(Method method);
bool UsesTwoCameras(Method method, const Rig& rig);
bool UsesRight(Method method, const Rig& rig);  // images of a second camera that sees the same
bool UsesLines(Method method);
bool UsesStructure(Method method);  // lines along the building's axes

// Of a figure that is measured again and again.
struct FigureSummary {
  double mean = 0;
  double worst = 0;  // the highest mean over two seconds
  int64_t count = 0;
};

struct RunFigures {
  // Share of the points followed to an image that are far from where its state has them.
  FigureSummary points_rejected;
  // Share of the window's observations of points that do not fit once it is optimised.
  FigureSummary observations_rejected;
  // Squared residual, by its variance, of a coordinate of those that fit; 1 as claimed.
  FigureSummary reprojection_chi2;
  // The same of a row of the IMU's measurements between the window's keyframes.
  FigureSummary imu_chi2;
  // From the last keyframe to an image: how much the state's turn differs from the gyroscope's, and
  // its change of velocity from the accelerometer's, over the time between.
  FigureSummary turn_rate_rad_s;
  FigureSummary acceleration_m_s2;
  // Share of a keyframe's points that its right image shows.
  FigureSummary seen_right;
  // 1 for an image that shows none of the points that are followed, once one showed some; else 0.
  FigureSummary blind;
};

// By the names of run.json.
inline constexpr std::array<std::pair<const char*, FigureSummary RunFigures::*>, 8> kRunFigures = {
    {{"points_rejected", &RunFigures::points_rejected},
     {"observations_rejected", &RunFigures::observations_rejected},
     {"reprojection_chi2", &RunFigures::reprojection_chi2},
     {"imu_chi2", &RunFigures::imu_chi2},
     {"turn_rate_rad_s", &RunFigures::turn_rate_rad_s},
     {"acceleration_m_s2", &RunFigures::acceleration_m_s2},
     {"seen_right", &RunFigures::seen_right},
     {"blind", &RunFigures::blind}}};

// A pose as odometry first gave it out, at the moment of its image, with no look-ahead.
struct OnlineState {
  int64_t stamp_ns = 0;
  int segment = 0;  // counts re-starts after failures
  RigidTransform T_world_imu;
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
};

// One observation of a landmark from a keyframe, in pixels of the rectified images.
struct KeyframeObservation {
  int64_t landmark_id = 0;
  Eigen::Vector2d left_px = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right_px;
  int camera = 0;  // whose left_px it is; right_px is of the next one
};

// A keyframe with its pose as the window last had it.
struct Keyframe {
  int64_t id = 0;
  int segment = 0;
  int64_t stamp_ns = 0;
  RigidTransform T_world_imu;
  std::vector<KeyframeObservation> observations;
  // Ids are those of OdometryRun::lines; others never became a line, or one that was given up. Of
  // merged lines they are those of the line that remains, at most once a keyframe.
  std::vector<LineObservation> lines;
};

// The standard deviation of a landmark of which the window does not know how well it is known.
inline constexpr double kUnknownSigma_m = 1e9, kUnknownSigma_rad = 1e9;

// A point as the window last had it.
struct Landmark {
  int64_t id = 0;
  int segment = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  // Standard deviation along the ray from the oldest keyframe of the window that saw it when it
  // left the window, and counted from there: how well the poses in between are known is part of it,
  // the drift of that keyframe is not.
  double sigma_m = 0;
  int observations = 0;  // keyframes that saw it
};

// The directions of a building (or a wing of it): horizontal axes X and Y at right angles, and the
// vertical. X is turned by the heading from the world's x about the world's z.
struct ManhattanWorld {
  int segment = 0;
  double heading_rad = 0;   // in (-pi/4, pi/4]: X and Y are interchangeable
  double sigma_rad = 0;     // when it was found; the window has refined the heading since
  int64_t found_at_ns = 0;  // stamp of the image
  bool withdrawn = false;   // its lines turned out not to follow it: none of them is to be used
};

// A direction, neither vertical nor level, that lines share, as handrails and rafters do: the line
// rises by the elevation towards the azimuth from the world's x.
struct SlopedDirection {
  int segment = 0;
  double azimuth_rad = 0;
  double elevation_rad = 0;        // in (0, pi/2)
  double azimuth_sigma_rad = 0;    // as the window knows them; of one that it does not, as it was
  double elevation_sigma_rad = 0;  // found
  int64_t found_at_ns = 0;         // stamp of the image
  bool withdrawn = false;          // its lines turned out not to follow it
};

// A line as the window last had it, however well it is known: covariance and observations say so.
struct Line {
  int64_t id = 0;
  int segment = 0;
  LineAxis axis = LineAxis::kNone;  // kNone: general, with four degrees of freedom
  // Of OdometryRun::manhattan_worlds, whose axis it has, or for kSloped of sloped_directions; -1
  // for kVertical and kNone.
  int world = -1;
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();  // how far it was seen
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  // Of its midpoint across it, in the axes of the world and counted from last_keyframe: rank 2. How
  // well poses and heading are known is part of it, the drift of that keyframe is not.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  // The angle between it and its axis, and the standard deviation of its direction, where that is
  // largest: 0 of a line that was taken to be exactly along its axis and of one that has none,
  // kUnknownSigma_rad where it is not known.
  double deviation_rad = 0, deviation_sigma_rad = 0;
  int observations = 0;            // keyframes that saw it
  int64_t last_keyframe = 0;       // that saw it
  std::vector<int64_t> point_ids;  // landmarks that belong to it
};

// What was found of the rig's calibration: corrections of what was given, with their standard
// deviations, which are 0 of what was held and not estimated. See odometry/factors/blocks.h for
// what they say exactly.
struct CalibrationEstimate {
  int64_t stamp_ns = 0;  // of the newest keyframe that it knows
  int segment = 0;
  // Camera stamps are this much more behind the IMU's clock than given.
  double time_offset_s = 0;
  // The IMU's true frame in the one where the given calibration has it, about x, y, z; and where
  // its origin is there.
  Eigen::Vector3d imu_rotation_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d lever_m = Eigen::Vector3d::Zero();
  // The right camera's true frame in its given one, both rectified.
  Eigen::Vector3d right_rotation_rad = Eigen::Vector3d::Zero();
  double focal_length = 0;  // by this share longer than given
  // cx and cy of the right camera, in px of its image as it was recorded, more than given.
  Eigen::Vector2d right_centre_px = Eigen::Vector2d::Zero();
  // Of scale and axes of the IMU, after what was given; see data/core/types.h.
  ImuErrors imu_errors = ImuErrors::Zero();
  double time_offset_sigma_s = 0;
  Eigen::Vector3d imu_rotation_sigma_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d lever_sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d right_rotation_sigma_rad = Eigen::Vector3d::Zero();
  double focal_length_sigma = 0;
  Eigen::Vector2d right_centre_sigma_px = Eigen::Vector2d::Zero();
  ImuErrors imu_errors_sigma = ImuErrors::Zero();
};

// Wall time of one stage of the program, summed over the run. With several threads stages overlap:
// their sum may exceed the wall time of the whole.
struct StageTiming {
  std::string name;
  double wall_s = 0;
  int64_t calls = 0;
};

struct RunTimings {
  std::vector<StageTiming> stages;
  int64_t window_iterations = 0;  // of the optimisations of all keyframes
  double cpu_s = 0;               // user + system, whole process
  double wall_s = 0;
  double peak_memory_mib = 0;
  int64_t stereo_frames = 0;
  double data_s = 0;                        // length of the recording that was processed
  std::optional<RealTimeReport> real_time;  // of a recording played at its own pace
};

// Where a run came from: what is needed to repeat it, and to open its images again.
struct RunSource {
  std::string version;                       // of slcmap
  std::string sequence;                      // folder of the recording
  std::string calibration;                   // where the raw rig was read, in words
  std::string options;                       // YAML: all options in effect
  std::vector<CheckCorrection> corrections;  // of that calibration, made before the start
  Rig raw_rig;  // the cameras as calibrated and corrected; the rectifier's options lead from it to
                // OdometryRun::rectified_rig
  std::vector<StereoEntry> images;        // all, by stamp; paths are in that folder
  std::vector<std::string> check_errors;  // that the run went on in spite of, in words
  SequenceOptions opened = {};            // how the recording was opened
};

// All stamps are on the camera's clock, as those of the images are: a keyframe has the stamp of its
// image, and of the image's state. (The estimator works on the IMU's clock, which is ahead by
// Rig::camera_time_offset_s.)
struct OdometryRun {
  std::string id;  // of its contents; set when it is written or read
  std::string method;
  bool complete = false;
  std::string partial_reason;               // why it is not complete
  std::map<std::string, int64_t> warnings;  // counted by kind
  RunFigures figures;
  std::optional<Verdict> verdict;  // none of a run that nobody has judged
  Rig rectified_rig;               // the cameras that KeyframeObservation's pixels belong to
  std::vector<OnlineState> states;
  std::vector<Keyframe> keyframes;
  std::vector<Landmark> landmarks;
  std::vector<ManhattanWorld> manhattan_worlds;
  std::vector<SlopedDirection> sloped_directions;
  // Standard deviation of lines' directions from the axes that they follow, as the run has found it
  // for the building; 0 where lines were taken to be exactly along their axes, or not used.
  double line_deviation_rad = 0;
  std::vector<CalibrationEstimate>
      calibration;  // with each keyframe; the last one is what is known
  std::vector<Line> lines;
  // Lines that turned out to be the same edge as an older one, by their ids: that of the line that
  // took them over, which was not merged itself.
  std::map<int64_t, int64_t> line_merges;
  std::vector<ImuSample> imu;       // that were accepted, on the IMU's clock
  std::optional<RunSource> source;  // none of a run that was made by hand
  RunTimings timings;
};

// Appends to `taken` what a list that only grows holds beyond the mark, and moves the mark.
template <typename Item>
void TakeNew(const std::vector<Item>& items, size_t* mark, std::vector<Item>* taken) {
  taken->insert(taken->end(), items.begin() + static_cast<std::ptrdiff_t>(*mark), items.end());
  *mark = items.size();
}

}  // namespace slcmap::odometry
