// A flight through a bare room as mapping gets it: views with true poses and rendered images.
#pragma once

#include <memory>

#include "mapping/views/view.h"
#include "tests/testing/box_room_renderer.h"

namespace slcmap {

class RoomViews : public ViewImages {
 public:
  // Views interval_s apart on the example's flight.
  RoomViews(double duration_s, double interval_s, double wall_distance_m)
      : task_{SmallRig(), ExampleFlight(SmallRig(), duration_s, 0.2), {}} {
    for (double t_s = 0.1; t_s < duration_s - 0.1; t_s += interval_s) task_.times_s.push_back(t_s);
    renderer_ = std::make_unique<BoxRoomRenderer>(task_, wall_distance_m);
    for (const double t_s : task_.times_s) {
      views_.push_back({ToNanoseconds(t_s), 0, task_.motion.PoseAt(t_s)});
    }
    mask_ = cv::Mat(task_.rig.cameras[0].height_px, task_.rig.cameras[0].width_px, CV_8UC1,
                    cv::Scalar(255));
  }

  const Views& views() const { return views_; }
  // The room's walls, in world.
  const Eigen::AlignedBox3d& room() const { return renderer_->room(); }
  // How far a point is from the nearest wall, floor or ceiling.
  double DistanceFromWalls_m(const Eigen::Vector3d& p) const {
    return std::min((p - room().min()).cwiseAbs().minCoeff(),
                    (p - room().max()).cwiseAbs().minCoeff());
  }
  cv::Mat TrueDepth_m(size_t view) const {
    return renderer_->Render(static_cast<int>(view), true).depth_m;
  }

  // From now on there is nothing to read of a view.
  void Lose(size_t view) { lost_ = static_cast<int64_t>(view); }

  const Rig& rig() const override { return task_.rig; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    if (static_cast<int64_t>(view) == lost_) return {};
    const RenderedPair pair = renderer_->Render(static_cast<int>(view), false);
    return {views_[view].stamp_ns, pair.left, pair.right};
  }

 private:
  RenderTask task_;
  std::unique_ptr<BoxRoomRenderer> renderer_;
  Views views_;
  cv::Mat mask_;
  int64_t lost_ = -1;
};

}  // namespace slcmap
