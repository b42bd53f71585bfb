#include "mapping/point_observations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <unordered_map>
#include <utility>

#include "odometry/geometry/lens_shift.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/residuals/calibration.h"
#include "odometry/residuals/point_residual.h"
#include "odometry/run_rows.h"
#include "odometry/window/calibration_estimate.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

// Brings a pixel of the run's images, which were rectified as its cameras were given, into those of
// another rig, by what the run has found of its cameras.
class PixelsOfRun {
 public:
  PixelsOfRun(const OdometryRun& run, const Rig& rig)
      : from_(run.rectified_rig), to_(rig), geometry_(run.rectified_rig.T_imu_camera, 1) {
    if (run.calibration.empty() || !run.source) return;
    geometry_.lens_shifts = std::make_shared<const std::array<LensShift, 2>>(
        LensShiftsOf(run.source->raw_rig, run.rectified_rig));
    const CalibrationEstimate& found = run.calibration.back();
    const CameraCalibrationBlock block = CameraBlockOf(found);
    geometry_ = geometry_.CorrectedBy(block.data());
  }

  Vector2d Moved(int camera, const Vector2d& px) const {
    const Vector2d true_plane =
        geometry_.OnTruePlane(camera, PlaneFromPixel(from_.cameras[camera], px));
    const Eigen::Vector3d ray =
        to_.T_imu_camera[camera].rotation.conjugate() *
        (geometry_.T_imu_camera[camera].rotation * true_plane.homogeneous());
    return PixelFromPlane(to_.cameras[camera], Vector2d(ray.hnormalized()));
  }

 private:
  const Rig &from_, &to_;
  StereoGeometry geometry_;
};

// The point that a landmark went into, and which of its tracks it is.
struct Track {
  int64_t point;
  int number;
};

std::unordered_map<int64_t, Track> TracksOf(const std::vector<MapPoint>& points) {
  std::unordered_map<int64_t, Track> tracks;
  for (std::size_t i = 0; i < points.size(); ++i) {
    int number = 0;
    for (const int64_t id : points[i].landmark_ids) {
      tracks[id] = {static_cast<int64_t>(i), number++};
    }
  }
  return tracks;
}

// What files take for one.
bool IsPixel(const Vector2d& px) {
  return std::abs(px.x()) <= kMaxPixel && std::abs(px.y()) <= kMaxPixel;
}

// Of landmarks that no keyframe says it saw there is no track.
void NumberTracks(std::vector<MapPointObservation>* observations) {
  int64_t point = -1;
  int landmark = -1, track = -1;
  for (MapPointObservation& seen : *observations) {
    if (seen.point != point) track = -1;
    if (seen.point != point || seen.track != landmark) ++track;
    point = seen.point;
    landmark = std::exchange(seen.track, track);
  }
}

}  // namespace

std::vector<MapPointObservation> ObservationsOf(const std::vector<MapPoint>& points,
                                                const OdometryRun& run, const Rig& rig) {
  const PixelsOfRun pixels(run, rig);
  const std::unordered_map<int64_t, Track> tracks = TracksOf(points);
  std::vector<MapPointObservation> observations;
  for (const Keyframe& keyframe : run.keyframes) {
    for (const KeyframeObservation& seen : keyframe.observations) {
      const auto track = tracks.find(seen.landmark_id);
      if (track == tracks.end()) continue;
      const auto add = [&](int camera, const Vector2d& px) {
        const Vector2d moved_px = pixels.Moved(camera, px);
        if (!IsPixel(moved_px)) return;
        observations.push_back(
            {track->second.point, track->second.number, keyframe.stamp_ns, camera, moved_px});
      };
      add(0, seen.left_px);
      if (seen.right_px) add(1, *seen.right_px);
    }
  }
  std::ranges::sort(observations, {}, [](const MapPointObservation& seen) { return KeyOf(seen); });
  NumberTracks(&observations);
  return observations;
}

}  // namespace slcmap
