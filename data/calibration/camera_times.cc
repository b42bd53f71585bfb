#include "data/calibration/camera_times.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "data/calibration/imu_calibration.h"

namespace slcmap::inline data {
namespace {

constexpr char kTimeShift[] = "timeshift_cam_imu";
constexpr double kSameShift_s = 1e-6;  // of the two cameras

}  // namespace

double ReadReadout(YamlSection& camera) {
  constexpr double kMaxReadout_s = 0.1;
  double readout_s = 0;
  camera.Read(kReadoutKey, &readout_s);
  if (std::abs(readout_s) <= kMaxReadout_s) return readout_s;
  throw CalibrationFault(
      camera, kReadoutKey,
      fmt::format("found {} s, expected at most {} s either way", readout_s, kMaxReadout_s),
      fmt::format("write {} in seconds from the first row to the last",
                  KeyInFile(camera.place(), kReadoutKey)));
}

void ReadTimes(YamlSection* section, ChainCamera* camera) {
  if (section->Has(kTimeShift)) {
    section->Read(kTimeShift, &camera->time_shift_s.emplace());
  }
  camera->readout_s = ReadReadout(*section);
}

void TakeTimes(const std::vector<const ChainCamera*>& used, Rig* rig, Warnings* warnings) {
  for (size_t i = 0; i < used.size(); ++i) rig->readout_s[i] = used[i]->readout_s;
  const double first_s = rig->camera_time_offset_s = used[0]->time_shift_s.value_or(0);
  for (size_t i = 1; i < used.size(); ++i) {
    const double later_s = used[i]->time_shift_s.value_or(first_s) - first_s;
    if (!(std::abs(later_s) <= kMaxRightOffset_s)) {
      throw InputFault(
          "calibration",
          fmt::format("{}: {}: found {} s, expected that of cam{}, {} s, to {} s", used[i]->place,
                      kTimeShift, first_s + later_s, used[0]->index, first_s, kMaxRightOffset_s),
          fmt::format("trigger the cameras together, or bring the stamps of cam{} to the clock of "
                      "cam{}, and write the latter's shift as {}",
                      used[i]->index, used[0]->index, KeyInFile(used[i]->place, kTimeShift)));
    }
    const bool is_apart = std::abs(later_s) > kMinRightOffset_s;
    if (i == 1) rig->right_time_offset_s = is_apart ? later_s : 0;
    if (i > 1) rig->other_time_offsets_s.push_back(is_apart ? later_s : 0);
    if (!is_apart && std::abs(later_s) > kSameShift_s) {
      warnings->Add(kTimeShiftsDiffer, used[i]->place);
    }
  }
}

}  // namespace slcmap::data
