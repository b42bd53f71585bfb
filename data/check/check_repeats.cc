// Whether a camera hung for a while and delivered its last image again.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>

#include "data/calibration.h"
#include "data/check/check.h"
#include "data/error.h"
#include "data/file.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxShare = 0.5;  // of repeated images in a sequence that is of use

// By the bytes of the files; those of noisy images differ in size already.
bool SameFile(const std::string& a, const std::string& b) {
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  const auto size = fs::file_size(a, error);
  if (error || size != fs::file_size(b, error) || error) return false;
  try {
    return ReadFile(a) == ReadFile(b);
  } catch (const DataError&) {  // unreadable files are another finding
    return false;
  }
}

struct Repeats {
  int64_t count = 0;
  double longest_s = 0;
  int64_t longest_from_ns = 0;  // stamp of the image that was repeated
};

Repeats FindRepeats(const std::vector<StereoEntry>& images, std::string StereoEntry::*path) {
  Repeats repeats;
  size_t shown = 0;  // the image that those up to i repeat
  for (size_t i = 1; i < images.size(); ++i) {
    if (!SameFile(images[i - 1].*path, images[i].*path)) {
      shown = i;
      continue;
    }
    ++repeats.count;
    const double duration_s = ToSeconds(images[i].stamp_ns - images[shown].stamp_ns);
    if (duration_s <= repeats.longest_s) continue;
    repeats.longest_s = duration_s;
    repeats.longest_from_ns = images[shown].stamp_ns;
  }
  return repeats;
}

}  // namespace

void CheckRepeats(const Sequence& sequence, CheckReport* report) {
  for (int camera = 0; camera < (IsStereo(sequence.rig) ? 2 : 1); ++camera) {
    const Repeats repeats = FindRepeats(
        sequence.images, camera == 0 ? &StereoEntry::left_path : &StereoEntry::right_path);
    if (repeats.count == 0) continue;
    const std::string found = fmt::format(
        "{} of {} images of cam{} repeat the one before, the longest time {:.2f} s from stamp {}",
        repeats.count, sequence.images.size(), camera, repeats.longest_s, repeats.longest_from_ns);
    const std::string remedy =
        "check the driver: a camera that hangs repeats its last image; such images are dropped "
        "while the rig moves";
    if (static_cast<double>(repeats.count) >
        kMaxShare * static_cast<double>(sequence.images.size())) {
      report->Fail("frozen-camera", found, remedy);
    } else {
      report->Warn("frozen-camera", found, remedy);
    }
  }
}

}  // namespace slcmap
