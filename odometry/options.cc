#include "odometry/options.h"

#include <sstream>

#include "data/error.h"

namespace slcmap {
namespace {

// Throws unless low <= value <= high.
template <typename T>
void CheckRange(const std::string& key, T value, T low, T high) {
  if (value >= low && value <= high) return;
  std::ostringstream message;
  message << key << ": found " << value << ", expected " << low << " to " << high;
  throw ConfigError(message.str());
}

}  // namespace

void RectifierOptions::Check() const {
  CheckRange("rectifier.max_field_of_view_rad", max_field_of_view_rad, 0.2, 2.8);
}

void RectifierOptions::Read(YamlSection section) {
  section.Read("max_field_of_view_rad", &max_field_of_view_rad);
  section.Finish();
}

void PointTrackerOptions::Check() const {
  CheckRange("points.max_points", max_points, 1, 10000);
  CheckRange("points.min_distance_px", min_distance_px, 3.0, 1000.0);
  CheckRange("points.pyramid_levels", pyramid_levels, 1, 8);
  CheckRange("points.patch_px", patch_px, 5, 63);
  CheckRange("points.max_forward_backward_px", max_forward_backward_px, 0.01, 100.0);
  CheckRange("points.max_epipolar_px", max_epipolar_px, 0.01, 100.0);
  CheckRange("points.min_corner_quality", min_corner_quality, 0.0, 1.0);
}

void PointTrackerOptions::Read(YamlSection section) {
  section.Read("max_points", &max_points);
  section.Read("min_distance_px", &min_distance_px);
  section.Read("pyramid_levels", &pyramid_levels);
  section.Read("patch_px", &patch_px);
  section.Read("max_forward_backward_px", &max_forward_backward_px);
  section.Read("max_epipolar_px", &max_epipolar_px);
  section.Read("min_corner_quality", &min_corner_quality);
  section.Finish();
}

}  // namespace slcmap
