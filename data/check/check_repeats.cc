// Whether a camera hung for a while and delivered its last image again.
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/calibration.h"
#include "data/check/check.h"

namespace slcmap {
namespace {

constexpr double kRepeatMaxShare = 0.5;  // of repeated images in a sequence that is of use

struct Repeats {
  int64_t count = 0;
  double longest_s = 0;
  int64_t longest_from_ns = 0;  // stamp of the image that was repeated
};

Repeats FindRepeats(const SequenceSource& source, int camera, const Progress& progress) {
  const std::vector<int64_t>& stamps_ns = source.info().pair_stamps_ns;
  Repeats repeats;
  size_t shown = 0;  // the image that those up to i repeat
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    if (i % 16 == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(stamps_ns.size()));
    }
    if (!source.IsRepeated(i, camera)) {
      shown = i;
      continue;
    }
    ++repeats.count;
    const double duration_s = ToSeconds(stamps_ns[i] - stamps_ns[shown]);
    if (duration_s <= repeats.longest_s) continue;
    repeats.longest_s = duration_s;
    repeats.longest_from_ns = stamps_ns[shown];
  }
  return repeats;
}

}  // namespace

void CheckRepeats(const SequenceSource& source, const Progress& progress, CheckReport* report) {
  const SourceInfo& info = source.info();
  const int cameras = IsStereo(info.rig) ? 2 : 1;
  for (int camera = 0; camera < cameras; ++camera) {
    const Repeats repeats = FindRepeats(
        source, camera, progress.Part(1.0 * camera / cameras, (camera + 1.0) / cameras));
    if (repeats.count == 0) continue;
    const std::string found = fmt::format(
        "{} of {} images of cam{} repeat the one before, the longest time {:.2f} s from stamp {}",
        repeats.count, info.pair_stamps_ns.size(), camera, repeats.longest_s,
        repeats.longest_from_ns);
    const std::string remedy =
        "check the driver: a camera that hangs repeats its last image; such images are dropped "
        "while the rig moves";
    if (static_cast<double>(repeats.count) >
        kRepeatMaxShare * static_cast<double>(info.pair_stamps_ns.size())) {
      report->Fail("frozen-camera", found, remedy);
    } else {
      report->Warn("frozen-camera", found, remedy);
    }
  }
}

}  // namespace slcmap
