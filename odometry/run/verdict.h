// Whether a run can be believed, by what it knows about itself, and the limits of that.
#pragma once

#include <string>

#include "data/io/yaml.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

// Above them a run is doubtful, and has failed.
struct VerdictLimits {
  double doubtful = 0;
  double failed = 0;
  void Check(const std::string& key) const;
  void Read(YamlSection section);
};

// Section `verdict` of a configuration. Figures of RunFigures are judged by their mean over the
// worst two seconds; points that were rejected fail a run only where their mean over all of it is
// doubtful, too.
struct VerdictOptions {
  VerdictLimits points_rejected{0.2, 0.3};
  VerdictLimits observations_rejected{0.05, 0.15};
  VerdictLimits reprojection_chi2{1.1, 4};
  VerdictLimits imu_chi2{4, 20};
  VerdictLimits turn_rate_rad_s{0.01, 0.1};
  VerdictLimits acceleration_m_s2{0.1, 1};
  VerdictLimits speed_m_s{6, 12};
  VerdictLimits gyro_bias_rad_s{0.2, 0.4};
  VerdictLimits accel_bias_m_s2{1, 2.4};
  VerdictLimits jump_m{0.2, 1};  // of an image's pose, besides its speed
  VerdictLimits keyframe_rate_hz{12, 100};
  double max_start_s = 15;  // until the first pose
  void Check() const;
  void Read(YamlSection section);

  // Overrides the defaults with those of a file; throws ConfigError naming file and key.
  static VerdictOptions FromYaml(const std::string& path);
  // All options as such a file.
  std::string ToYaml() const;
};

// Pure: of the run's figures, states, warnings and source. Of a run without figures, as one of an
// earlier version, what the states say.
Verdict JudgeRun(const OdometryRun& run, const VerdictOptions& options);

}  // namespace slcmap::odometry
