// A cloud and an occupancy map against true surfaces, as tables to read and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "apps/evaluation/cloud_metrics.h"
#include "apps/evaluation/occupancy_metrics.h"

namespace slcmap {

// What is compared; an empty path: nothing of that kind.
struct SurfaceInputs {
  std::string true_surfaces;  // faces, PLY
  std::string rig;            // true calibration; "": rig.yaml beside the surfaces
  std::string cloud, occupancy;
};

struct SurfaceMetrics {
  std::optional<CloudMetrics> cloud;
  std::optional<OccupancyMetrics> occupancy;
};

// Reads the inputs, finds what the cameras saw from the poses of `truth`, and compares. Throws
// DataError, and StoppedError when progress says so.
SurfaceMetrics EvaluateSurfaces(const SurfaceInputs& inputs, const Trajectory& truth,
                                const Alignment& alignment, const CloudMetricOptions& options,
                                const VisibilityOptions& visibility, const Progress& progress = {});

std::string SurfaceTable(const SurfaceInputs& inputs, const SurfaceMetrics& metrics,
                         const CloudMetricOptions& options);
nlohmann::ordered_json SurfaceJson(const SurfaceInputs& inputs, const SurfaceMetrics& metrics,
                                   const CloudMetricOptions& options);

}  // namespace slcmap
