#include "odometry/verdict/verdict_options.h"

#include <utility>

#include "data/config_file.h"
#include "data/option_table.h"

namespace slcmap {

constexpr OptionTable kVerdictLimits{Option{"doubtful", &VerdictLimits::doubtful, 0.0, 1e12},
                                     Option{"failed", &VerdictLimits::failed, 0.0, 1e12}};

void VerdictLimits::Check(const std::string& key) const {
  kVerdictLimits.Check("verdict." + key, *this);
  CheckOrder("verdict." + key, "doubtful", doubtful, "failed", failed);
}
void VerdictLimits::Read(YamlSection section) { kVerdictLimits.Read(section, this); }

namespace {

constexpr std::pair<const char*, VerdictLimits VerdictOptions::*> kVerdictSections[] = {
    {"points_rejected", &VerdictOptions::points_rejected},
    {"observations_rejected", &VerdictOptions::observations_rejected},
    {"reprojection_chi2", &VerdictOptions::reprojection_chi2},
    {"imu_chi2", &VerdictOptions::imu_chi2},
    {"turn_rate_rad_s", &VerdictOptions::turn_rate_rad_s},
    {"acceleration_m_s2", &VerdictOptions::acceleration_m_s2},
    {"speed_m_s", &VerdictOptions::speed_m_s},
    {"gyro_bias_rad_s", &VerdictOptions::gyro_bias_rad_s},
    {"accel_bias_m_s2", &VerdictOptions::accel_bias_m_s2},
    {"jump_m", &VerdictOptions::jump_m},
    {"keyframe_rate_hz", &VerdictOptions::keyframe_rate_hz}};

}  // namespace

constexpr OptionTable kVerdict{
    Option{"failed_restarts_a_minute", &VerdictOptions::failed_restarts_a_minute, 0.0, 1e6},
    Option{"min_seen_right", &VerdictOptions::min_seen_right, 0.0, 1.0},
    Option{"min_posed_share", &VerdictOptions::min_posed_share, 0.0, 1.0},
    Option{"failed_posed_share", &VerdictOptions::failed_posed_share, 0.0, 1.0},
    Option{"max_start_s", &VerdictOptions::max_start_s, 0.0, 1e9}};

void VerdictOptions::Check() const {
  kVerdict.Check("verdict", *this);
  for (const auto& [key, limits] : kVerdictSections) (this->*limits).Check(key);
  CheckOrder("verdict", "failed_posed_share", failed_posed_share, "min_posed_share",
             min_posed_share);
}
void VerdictOptions::Read(YamlSection section) {
  for (const auto& [key, limits] : kVerdictSections) (this->*limits).Read(section.Section(key));
  kVerdict.Read(section, this);
}

VerdictOptions VerdictOptions::FromYaml(const std::string& path) {
  return ReadConfigFile(path, [](YamlSection& root) {
    VerdictOptions options;
    options.Read(root.Section("verdict"));
    options.Check();
    return options;
  });
}

std::string VerdictOptions::ToYaml() const {
  VerdictOptions options = *this;
  return YamlSection::Dump([&](YamlSection* root) { options.Read(root->Section("verdict")); });
}

}  // namespace slcmap
