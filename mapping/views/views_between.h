// Views between keyframes, where those are far apart.
#pragma once

#include <cstddef>
#include <vector>

#include "data/yaml_options.h"
#include "mapping/views/view.h"

namespace slcmap {

struct ViewSpacingOptions {
  bool between_keyframes = true;  // else keyframes alone
  double min_travel_m = 0.15;     // from the view before and to the next keyframe, or
  double min_turn_rad = 0.2;      // as much as that
  // Of views that look from one place the same way, to alike_m and alike_rad, so many are enough:
  // long recordings pass where they have been again and again.
  int max_alike = 12;
  double alike_m = 0.3, alike_rad = 0.35;
};

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
  StereoImage Read(size_t view) const override { return all_.Read(selected_[view]); }

 private:
  const ViewImages& all_;
  const std::vector<size_t> selected_;
};

}  // namespace slcmap
