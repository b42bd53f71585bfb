// Views between keyframes, where those are far apart; and where given poses jump.
#pragma once

#include <cstddef>
#include <vector>

#include "data/core/types.h"
#include "data/io/trajectory.h"
#include "mapping/views/options.h"
#include "mapping/views/view.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// The frames (their indices) that are keyframes, by segment and stamp, and those between two
// keyframes of a segment that are apart from the view before and from the next keyframe; without
// those that as many as max_alike before them, of their segment, are like. Frames and keyframes are
// sorted by stamp; keyframes that are no frames are left out.
std::vector<size_t> SelectViews(const Views& frames, const Views& keyframes,
                                const ViewSpacingOptions& options);

// Some of the views of other images.
class SelectedImages : public ViewImages {
 public:
  // `all` must outlive it.
  SelectedImages(const ViewImages& all, std::vector<size_t> selected)
      : all_(all), selected_(std::move(selected)) {}

  const Rig& rig() const override { return all_.rig(); }
  const cv::Mat& mask(int camera) const override { return all_.mask(camera); }
  int left_camera(size_t view) const override { return all_.left_camera(selected_[view]); }
  StereoImage Read(size_t view) const override { return all_.Read(selected_[view]); }

 private:
  const ViewImages& all_;
  const std::vector<size_t> selected_;
};

// Where poses that were given jump, as those of a tracker that was lost or of a loop that was
// closed.

// A step from one pose to the next that neither the motion before it nor the one after explains.
struct PoseJump {
  int64_t from_ns = 0, stamp_ns = 0;  // of the pose that it starts from, and leads to
  double moved_m = 0;                 // besides the motion, where that explains it best
  double turned_rad = 0;
};

// Only steps of at most half a second are told from motion.
std::vector<PoseJump> FindJumps(const Trajectory& trajectory);

}  // namespace slcmap::mapping
