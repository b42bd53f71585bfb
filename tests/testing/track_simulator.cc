#include "tests/testing/track_simulator.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <random>

namespace slcmap {
namespace {

constexpr double kWallDistance_m = 3;  // of the box from the motion's outermost positions
constexpr double kMaxDepth_m = 12;     // where the wall is further, the landmark floats before it

Eigen::AlignedBox3d BoxAround(const MotionSpline& motion) {
  Eigen::AlignedBox3d box;
  for (double t_s = 0; t_s <= motion.Duration(); t_s += 0.05) {
    box.extend(motion.PoseAt(t_s).translation);
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kWallDistance_m);
  return {box.min() - margin, box.max() + margin};
}

// The distance along a unit ray from inside the box to its wall.
double DistanceToWall(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& origin,
                      const Eigen::Vector3d& ray) {
  double distance_m = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (ray[k] == 0) continue;
    const double wall = ray[k] > 0 ? box.max()[k] : box.min()[k];
    distance_m = std::min(distance_m, (wall - origin[k]) / ray[k]);
  }
  return distance_m;
}

class TrackSimulator {
 public:
  TrackSimulator(const MotionSpline& motion, const Rig& rig, const TrackSimulatorOptions& options)
      : motion_(motion),
        rig_(rig),
        options_(options),
        box_(BoxAround(motion)),
        generator_(options.seed) {}

  SimulatedTracks Run() {
    const double first_s = std::max(0.0, rig_.camera_time_offset_s);
    const auto count =
        static_cast<int64_t>((motion_.Duration() - first_s) * options_.image_rate_hz + 1e-6) + 1;
    for (int64_t i = 0; i < count; ++i) {
      AddFrame(first_s + static_cast<double>(i) / options_.image_rate_hz);
    }
    return std::move(result_);
  }

 private:
  void AddFrame(double t_s) {
    SimulatedTrackFrame frame;
    frame.stamp_ns = ToNanoseconds(t_s) - ToNanoseconds(rig_.camera_time_offset_s);
    frame.T_world_imu = motion_.PoseAt(t_s);
    std::erase_if(live_, [&](int64_t id) { return !See(t_s, id, 0); });
    TakeUpNew(t_s);
    for (const int64_t id : live_) frame.tracks.push_back(Measure(t_s, id));
    result_.frames.push_back(std::move(frame));
  }

  // The exact pixel of a landmark where the camera sees it, as its row is exposed.
  std::optional<Eigen::Vector2d> See(double t_s, int64_t id, int camera) const {
    constexpr int kRounds = 4;
    std::optional<Eigen::Vector2d> pixel;
    double row_px = 0.5 * (rig_.cameras[camera].height_px - 1);
    for (int round = 0; round < (IsTakenAtOnce(rig_) ? 1 : kRounds); ++round) {
      const RigidTransform T_world_imu = motion_.PoseAt(t_s + RowTime_s(rig_, camera, row_px));
      const RigidTransform T_camera_world = (T_world_imu * rig_.T_imu_camera[camera]).Inverse();
      pixel = rig_.cameras[camera].Project(T_camera_world * result_.landmarks_world[id]);
      if (!pixel) return std::nullopt;
      row_px = pixel->y();
    }
    if (pixel && !rig_.cameras[camera].Contains(*pixel, options_.margin_px)) pixel.reset();
    return pixel;
  }

  void TakeUpNew(double t_s) {
    const RigidTransform T_world_imu = motion_.PoseAt(t_s);
    const Camera& left = rig_.cameras[0];
    const double margin = options_.margin_px;
    std::uniform_real_distribution<double> x_px(margin, left.width_px - 1 - margin);
    std::uniform_real_distribution<double> y_px(margin, left.height_px - 1 - margin);
    // A fisheye's corners see nothing, hence more attempts than tracks.
    for (int i = 0; i < 20 * options_.max_tracks && MissingTracks() > 0; ++i) {
      const double x = x_px(generator_);
      const std::optional<Eigen::Vector3d> ray = left.Unproject({x, y_px(generator_)});
      if (!ray) continue;
      const auto id = static_cast<int64_t>(result_.landmarks_world.size());
      result_.landmarks_world.push_back(PlaceLandmark(T_world_imu * rig_.T_imu_camera[0], *ray));
      if (See(t_s, id, 0)) {
        live_.push_back(id);
      } else {
        result_.landmarks_world.pop_back();
      }
    }
  }

  int MissingTracks() const { return options_.max_tracks - static_cast<int>(live_.size()); }

  Eigen::Vector3d PlaceLandmark(const RigidTransform& T_world_camera,
                                const Eigen::Vector3d& ray_camera) {
    const Eigen::Vector3d ray_world = T_world_camera.rotation * ray_camera;
    std::uniform_real_distribution<double> floating_m(0.5 * kMaxDepth_m, kMaxDepth_m);
    double distance_m = DistanceToWall(box_, T_world_camera.translation, ray_world);
    if (distance_m > kMaxDepth_m) distance_m = floating_m(generator_);
    return T_world_camera.translation + distance_m * ray_world;
  }

  SimulatedTrack Measure(double t_s, int64_t id) {
    SimulatedTrack track{id, *See(t_s, id, 0) + Noise(), See(t_s, id, 1)};
    if (track.right_px) *track.right_px += Noise();
    return track;
  }

  Eigen::Vector2d Noise() {
    const double x = normal_(generator_);
    return options_.sigma_px * Eigen::Vector2d(x, normal_(generator_));
  }

  const MotionSpline& motion_;
  const Rig& rig_;
  const TrackSimulatorOptions& options_;
  Eigen::AlignedBox3d box_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::vector<int64_t> live_;
  SimulatedTracks result_;
};

// What one camera of a rig sees.
SimulatedTracks TracksOf(int camera, const MotionSpline& motion, Rig rig,
                         TrackSimulatorOptions options) {
  rig.cameras[0] = rig.cameras[camera];
  rig.T_imu_camera[0] = rig.T_imu_camera[camera];
  options.seed += static_cast<uint64_t>(camera);
  SimulatedTracks tracks = TrackSimulator(motion, rig, options).Run();
  for (SimulatedTrackFrame& frame : tracks.frames) {
    for (SimulatedTrack& track : frame.tracks) {
      track = {2 * track.id + camera, track.left_px, std::nullopt, camera};
    }
  }
  return tracks;
}

}  // namespace

SimulatedTracks SimulateTracks(const MotionSpline& motion, const Rig& rig,
                               const TrackSimulatorOptions& options) {
  if (!HasTwoCameras(rig) || IsStereo(rig)) return TrackSimulator(motion, rig, options).Run();
  SimulatedTracks both = TracksOf(0, motion, rig, options);
  const SimulatedTracks second = TracksOf(1, motion, rig, options);
  for (size_t i = 0; i < both.frames.size(); ++i) {
    std::vector<SimulatedTrack>& tracks = both.frames[i].tracks;
    tracks.insert(tracks.end(), second.frames[i].tracks.begin(), second.frames[i].tracks.end());
    std::ranges::sort(tracks, {}, &SimulatedTrack::id);
  }
  const size_t rows = std::max(both.landmarks_world.size(), second.landmarks_world.size());
  std::vector<Eigen::Vector3d> landmarks_world(2 * rows, Eigen::Vector3d::Zero());
  for (size_t i = 0; i < both.landmarks_world.size(); ++i) {
    landmarks_world[2 * i] = both.landmarks_world[i];
  }
  for (size_t i = 0; i < second.landmarks_world.size(); ++i) {
    landmarks_world[2 * i + 1] = second.landmarks_world[i];
  }
  both.landmarks_world = std::move(landmarks_world);
  return both;
}

}  // namespace slcmap
