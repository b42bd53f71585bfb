// Whether a gap of one table is a clock that was set forward.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/check/check.h"
#include "data/check/image_motion.h"
#include "data/check/turn_alignment.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

constexpr double kClockGap_s = 0.08;    // beyond a usual step, at least
constexpr double kClockBeside_s = 0.2;  // of a gap in the other table that may be the same
constexpr double kClockLook_s = 4;      // on either side of a gap
constexpr size_t kClockGaps = 2;        // that are looked at, the longest

// Between two stamps, on the IMU's clock.
struct TableGap {
  int64_t from_ns, to_ns;
  double beyond_s;  // a usual step
};

std::vector<TableGap> FindGaps(const std::vector<int64_t>& stamps_ns) {
  const double usual_s = MedianStep_s(stamps_ns);
  std::vector<TableGap> gaps;
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    const double beyond_s = ToSeconds(stamps_ns[i] - stamps_ns[i - 1]) - usual_s;
    if (beyond_s < std::max(kClockGap_s, usual_s)) continue;
    gaps.push_back({stamps_ns[i - 1], stamps_ns[i], beyond_s});
  }
  return gaps;
}

// The longest of the gaps that others do not share.
std::vector<TableGap> GapsAlone(std::vector<TableGap> gaps, const std::vector<TableGap>& others) {
  const int64_t beside_ns = ToNanoseconds(kClockBeside_s);
  std::erase_if(gaps, [&](const TableGap& gap) {
    return std::ranges::any_of(others, [&](const TableGap& other) {
      return other.from_ns < gap.to_ns + beside_ns && other.to_ns > gap.from_ns - beside_ns;
    });
  });
  std::ranges::stable_sort(gaps, std::ranges::greater(), &TableGap::beyond_s);
  gaps.resize(std::min(gaps.size(), kClockGaps));
  return gaps;
}

class ClockJudge {
 public:
  ClockJudge(const SequenceSource& source, const Rig& rig, const std::vector<ImuSample>& samples,
             const Progress& progress)
      : source_(source), rig_(rig), samples_(samples), progress_(progress) {
    const int64_t offset_ns = ToNanoseconds(rig.camera_time_offset_s);
    for (const int64_t stamp_ns : source.info().pair_stamps_ns) {
      image_stamps_ns_.push_back(stamp_ns + offset_ns);
    }
  }

  void Judge(CheckReport* report) const {
    std::vector<int64_t> sample_stamps_ns;
    for (const ImuSample& sample : samples_) sample_stamps_ns.push_back(sample.stamp_ns);
    const std::vector<TableGap> images = FindGaps(image_stamps_ns_),
                                imu = FindGaps(sample_stamps_ns);
    for (const TableGap& gap : GapsAlone(images, imu)) JudgeGap(gap, true, report);
    for (const TableGap& gap : GapsAlone(imu, images)) JudgeGap(gap, false, report);
  }

 private:
  // About the offset that is expected.
  TurnAlignment Align(const std::vector<ImageTurn>& turns, double offset_s) const {
    return AlignTurns(turns, samples_, rig_.T_imu_camera[0].rotation, offset_s);
  }

  // Of the images in [from_ns, to_ns).
  std::vector<ImageTurn> TurnsBetween(int64_t from_ns, int64_t to_ns) const {
    const auto index = [&](int64_t stamp_ns) {
      return static_cast<size_t>(std::ranges::lower_bound(image_stamps_ns_, stamp_ns) -
                                 image_stamps_ns_.begin());
    };
    return FollowImages(source_, rig_, {{index(from_ns), index(to_ns)}}, progress_).turns;
  }

  // Where the clock was set the offset of what is behind is another, by the gap; else it stays.
  void JudgeGap(const TableGap& gap, bool of_images, CheckReport* report) const {
    const int64_t look_ns = ToNanoseconds(kClockLook_s);
    const TurnAlignment before =
        Align(TurnsBetween(gap.from_ns - look_ns, gap.from_ns + 1), rig_.camera_time_offset_s);
    if (!before.enough_motion || before.claimed.unexplained >= kExplained) return;
    const auto behind = TurnsBetween(gap.to_ns, gap.to_ns + look_ns);
    const auto fits = [&](const TurnAlignment& turns, double offset_s) {
      return turns.enough_motion && turns.claimed.unexplained < kExplained &&
             std::abs(turns.time_offset_s - offset_s) < 0.25 * gap.beyond_s;
    };
    const double before_s = before.time_offset_s;
    const double set_s = before_s + (of_images ? -gap.beyond_s : gap.beyond_s);
    if (fits(Align(behind, before_s), before_s)) return;
    const TurnAlignment set = Align(behind, set_s);
    if (!fits(set, set_s)) return;
    // A row that was lost there makes the gap longer.
    const double turned_s = std::abs(set.time_offset_s - before_s);
    const double by_s = std::abs(turned_s - gap.beyond_s) < 0.01 ? gap.beyond_s : turned_s;
    const int64_t by_ns = 100'000 * std::llround(1e4 * by_s);  // steps are not that even
    const int64_t offset_ns = of_images ? ToNanoseconds(rig_.camera_time_offset_s) : 0;
    const int64_t last_ns = gap.from_ns - offset_ns;
    const int64_t within_ns =
        last_ns + (gap.to_ns - gap.from_ns) / 2;  // stamps of a pair may differ
    const char* of_cameras = IsStereo(rig_) ? "cam0/data.csv and cam1/data.csv" : "cam0/data.csv";
    const char* tables = of_images ? of_cameras : "imu0/data.csv";
    report->Fail(
        "clock",
        report->Named(fmt::format(
            "the clock of {} was set forward by {:.3f} s: there is a gap of {:.3f} s after stamp "
            "{} that the {} have not, and behind it images turn {:.3f} s {} against the gyroscope "
            "than before",
            tables, by_s, ToSeconds(gap.to_ns - gap.from_ns), last_ns,
            of_images ? "IMU samples" : "images", turned_s, of_images ? "later" : "earlier")),
        fmt::format("let nothing set the recorder's clock while it records (NTP); of this "
                    "recording, take {} from the stamps of {} after {}",
                    by_ns, tables, within_ns));
  }

  const SequenceSource& source_;
  const Rig& rig_;
  const std::vector<ImuSample>& samples_;
  const Progress progress_;
  std::vector<int64_t> image_stamps_ns_;
};

}  // namespace

void CheckClock(const SequenceSource& source, const Rig& rig, const std::vector<ImuSample>& samples,
                const Progress& progress, CheckReport* report) {
  ClockJudge(source, rig, samples, progress).Judge(report);
}

}  // namespace slcmap::data
