#include "data/clock_jumps.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/asl_files.h"

namespace slcmap {
namespace {

constexpr size_t kSteadyRows = 5;
constexpr double kSteadySteps = 4;         // median steps, at most between rows that rise steadily
constexpr double kClockForwardSteps = 10;  // median steps; a longer one may be a jump
constexpr double kClockForward_s = 0.5;    // and longer than this: shorter ones are losses
constexpr double kBreak_s = 0.35;          // without samples: more than odometry bridges

class StampRows {
 public:
  explicit StampRows(const std::vector<int64_t>& stamps_ns) : stamps_ns_(stamps_ns) {
    std::vector<double> steps_ns;
    for (size_t i = 1; i < stamps_ns.size(); ++i) {
      if (Step_ns(i) > 0) steps_ns.push_back(static_cast<double>(Step_ns(i)));
    }
    step_ns_ = static_cast<int64_t>(Median(std::move(steps_ns)));
  }

  int64_t usual_step_ns() const { return step_ns_; }
  int64_t Step_ns(size_t row) const { return stamps_ns_[row] - stamps_ns_[row - 1]; }

  // Whether the rows before and from `row` on rise steadily.
  bool IsSteadyAround(size_t row) const {
    if (row < kSteadyRows || row + kSteadyRows > stamps_ns_.size()) return false;
    for (size_t i = row - kSteadyRows + 1; i < row + kSteadyRows; ++i) {
      if (i != row && !IsSteady(i)) return false;
    }
    return true;
  }

  // Whether the rows behind are late against those before by at least half of `jump_ns`: two rows
  // in the wrong order leave those behind them as they were.
  bool StaysBehind(size_t row, int64_t jump_ns) const {
    const int64_t across_ns = stamps_ns_[row + kSteadyRows - 1] - stamps_ns_[row - kSteadyRows];
    return across_ns < static_cast<int64_t>(2 * kSteadyRows - 1) * step_ns_ - jump_ns / 2;
  }

  // Whether what begins with `row` belongs, as a whole, before or between earlier rows.
  bool BelongsBefore(size_t row) const {
    size_t last = row;
    while (last + 1 < stamps_ns_.size() && Step_ns(last + 1) > 0) ++last;
    int64_t gap_ns = std::numeric_limits<int64_t>::max();  // to the next of the earlier rows
    for (size_t i = 0; i < row; ++i) {
      if (stamps_ns_[i] >= stamps_ns_[row])
        gap_ns = std::min(gap_ns, stamps_ns_[i] - stamps_ns_[last]);
    }
    return gap_ns > 0 && static_cast<double>(gap_ns) <= kSteadySteps * step_ns_;
  }

  // Whether rows up to `end` fill the step to `row`.
  bool IsFilledLater(size_t row, size_t end) const {
    const auto begin = stamps_ns_.begin();
    const auto at = static_cast<std::ptrdiff_t>(row), until = static_cast<std::ptrdiff_t>(end);
    return std::any_of(begin + at, begin + until, [&](int64_t stamp_ns) {
      return stamp_ns > stamps_ns_[row - 1] && stamp_ns < stamps_ns_[row];
    });
  }

 private:
  bool IsSteady(size_t row) const {
    return Step_ns(row) > 0 && static_cast<double>(Step_ns(row)) <= kSteadySteps * step_ns_;
  }

  const std::vector<int64_t>& stamps_ns_;
  int64_t step_ns_ = 0;
};

// Whether what stands at `row` stands in an earlier row too.
bool IsWrittenTwice(const std::vector<int64_t>& stamps_ns, size_t row,
                    const std::function<bool(size_t, size_t)>& same) {
  for (size_t i = 0; i < row; ++i) {
    if (stamps_ns[i] == stamps_ns[row]) return same(i, row);
  }
  return false;
}

}  // namespace

std::vector<ClockJump> FindClockJumps(const std::vector<int64_t>& stamps_ns,
                                      const std::function<bool(size_t, size_t)>& same) {
  const StampRows rows(stamps_ns);
  const int64_t step_ns = rows.usual_step_ns();
  const double forward_ns = std::max(kClockForward_s * 1e9, kClockForwardSteps * step_ns);
  std::vector<ClockJump> jumps;
  size_t end = stamps_ns.size();  // of the clock of a row: what is behind a jump fills no step
  for (size_t i = stamps_ns.size(); i-- > 1;) {
    const int64_t found_ns = rows.Step_ns(i);
    const bool is_back = found_ns < -step_ns / 2;
    const bool is_forward = static_cast<double>(found_ns) > forward_ns;
    if ((!is_back && !is_forward) || !rows.IsSteadyAround(i)) continue;
    if (is_back && (!rows.StaysBehind(i, step_ns - found_ns) || rows.BelongsBefore(i) ||
                    IsWrittenTwice(stamps_ns, i, same)))
      continue;
    if (is_forward && rows.IsFilledLater(i, end)) continue;
    if (is_back) end = i;
    jumps.push_back({i, step_ns - found_ns, 0, false, ""});
  }
  std::reverse(jumps.begin(), jumps.end());
  return jumps;
}

void CountJumps(const std::vector<ClockJump>& jumps, Warnings* warnings) {
  for (const ClockJump& jump : jumps) {
    const double back_s = ToSeconds(jump.back_ns);
    const std::string words = back_s > 0 ? fmt::format("clock set back by {:.3f} s", back_s)
                                         : fmt::format("clock set forward by {:.3f} s{}", -back_s,
                                                       jump.put_back ? "" : ", or a pause");
    warnings->Add(kClockJump,
                  fmt::format("{}: {}, t = {:.3f} s", jump.place, words, ToSeconds(jump.stamp_ns)));
  }
}

void LeaveOutPauses(const std::vector<ClockJump>& other, std::vector<ClockJump>* jumps) {
  std::erase_if(*jumps, [&](const ClockJump& jump) {
    return !jump.put_back && SameJump(jump, other) == other.size();
  });
}

void BreakImu(const ClockJump& jump, std::vector<ImuSample>* samples) {
  const auto after = std::ranges::find_if(
      *samples, [&](const ImuSample& sample) { return sample.stamp_ns >= jump.stamp_ns; });
  if (after == samples->begin() || after == samples->end()) return;
  if (ToSeconds(after->stamp_ns - std::prev(after)->stamp_ns) > kBreak_s) return;  // is one already
  std::erase_if(*samples, [&](const ImuSample& sample) {
    const double since_s = ToSeconds(sample.stamp_ns - jump.stamp_ns);
    return since_s >= 0 && since_s < kBreak_s;
  });
}

}  // namespace slcmap
