#include "data/sequence_part.h"

#include <spdlog/fmt/fmt.h>

#include "data/error.h"

namespace slcmap {
namespace {

constexpr double kMaxTime_s = 1e8;         // three years
constexpr double kImuMargin_s = 1;         // beyond the camera's time offset
constexpr double kImageRounding_s = 1e-6;  // of times given on a command line

void CheckTime(const char* name, double found_s) {
  if (found_s >= 0 && found_s <= kMaxTime_s) return;
  throw ConfigError(
      fmt::format("{}: found {}, expected seconds from 0 to {}", name, found_s, kMaxTime_s));
}

}  // namespace

void SequencePart::Check() const {
  CheckTime("--from", from_s);
  CheckTime("--duration", duration_s);
}

void KeepPart(const SequencePart& part, Sequence* sequence) {
  part.Check();
  if (part.from_s == 0 && part.duration_s == 0) return;
  const int64_t start_ns = sequence->images.front().stamp_ns;
  const int64_t from_ns = start_ns + ToNanoseconds(part.from_s - kImageRounding_s);
  const double to_s = part.duration_s == 0 ? 2 * kMaxTime_s : part.from_s + part.duration_s;
  const int64_t to_ns = start_ns + ToNanoseconds(to_s + kImageRounding_s);
  const double length_s = ToSeconds(sequence->images.back().stamp_ns - start_ns);
  std::erase_if(sequence->images, [&](const StereoEntry& image) {
    return image.stamp_ns < from_ns || image.stamp_ns > to_ns;
  });
  if (sequence->images.empty()) {
    throw ConfigError(
        fmt::format("--from {} --duration {}: found no image in it, expected a part of the "
                    "recording's {:.3f} s",
                    part.from_s, part.duration_s, length_s));
  }
  const int64_t margin_ns = ToNanoseconds(kImuMargin_s);
  const int64_t offset_ns = ToNanoseconds(sequence->rig.camera_time_offset_s);
  const int64_t first_ns = sequence->images.front().stamp_ns + offset_ns - margin_ns;
  const int64_t last_ns = sequence->images.back().stamp_ns + offset_ns + margin_ns;
  std::erase_if(sequence->imu, [&](const ImuSample& sample) {
    return sample.stamp_ns < first_ns || sample.stamp_ns > last_ns;
  });
}

}  // namespace slcmap
