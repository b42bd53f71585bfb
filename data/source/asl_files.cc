#include "data/source/asl_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/source/imu_streams.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

constexpr double kImuGapSteps = 4;  // median steps without a sample that make a gap
// Beyond the highest rates, stamps are in another unit than nanoseconds.
constexpr double kMaxImageRate_hz = 2000, kUsualImageRate_hz = 20;
constexpr double kMaxImuRate_hz = 20000, kUsualImuRate_hz = 200;

// A stamp in nanoseconds; nothing where there is none, or where differences would leave the range.
std::optional<int64_t> ParseStamp(std::string_view text) {
  constexpr int64_t kMax_ns = int64_t{1} << 62;
  const std::optional<int64_t> stamp_ns = ParseScaledInteger(text, 0);
  return stamp_ns && std::abs(*stamp_ns) <= kMax_ns ? stamp_ns : std::nullopt;
}

// The median step between a table's stamps as they are written, without repeated ones; of those
// that come in packets, between packets' samples.
double WrittenStep(std::vector<double> stamps) {
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  return SamplingPeriod(stamps);
}

// Throws where stamps in nanoseconds would mean more than max_rate_hz, but not in another unit: the
// one that brings the rate nearest to usual_rate_hz.
void RequireNanoseconds(const std::string& path, const std::vector<double>& stamps,
                        const TableText& text, double max_rate_hz, double usual_rate_hz) {
  constexpr size_t kMinRows = 4;
  const double step = WrittenStep(stamps);
  if (stamps.size() < kMinRows || step <= 0 || step > 1e9 / max_rate_hz) return;
  text.RequireStamps(stamps.size(), std::set<double>(stamps.begin(), stamps.end()).size());
  struct Unit {
    const char* name;
    double ns;
  };
  const auto error = [&](const Unit& unit) {
    return std::abs(std::log(1e9 / (step * unit.ns) / usual_rate_hz));
  };
  constexpr Unit kUnits[] = {{"seconds", 1e9}, {"milliseconds", 1e6}, {"microseconds", 1e3}};
  const Unit unit =
      *std::min_element(std::begin(kUnits), std::end(kUnits),
                        [&](const Unit& a, const Unit& b) { return error(a) < error(b); });
  throw InputFault(
      "stamp-units",
      fmt::format("{}: found stamps that seem to be in {} (their median step is {:.6g}), expected "
                  "nanoseconds",
                  path, unit.name, step),
      fmt::format("multiply the first column of {} by {:.0e} and write it without a point", path,
                  unit.ns));
}

// Indices of the rows by stamp, of equal stamps the first only.
template <typename Element>
std::vector<size_t> SortedOnce(const std::vector<Element>& elements) {
  std::vector<size_t> order(elements.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return elements[a].stamp_ns < elements[b].stamp_ns; });
  const auto same = [&](size_t a, size_t b) {
    return elements[a].stamp_ns == elements[b].stamp_ns;
  };
  order.erase(std::unique(order.begin(), order.end(), same), order.end());
  return order;
}

// The elements with rising stamps. Few rows out of place are damaged, and dropped; many are those
// of a table that nobody sorted. Both are counted.
template <typename Element>
std::vector<Element> Rising(const TableRows<Element>& rows, Warnings* warnings) {
  constexpr double kMaxDamagedShare = 0.2;
  constexpr size_t kMinUnsorted = 3;
  std::vector<int64_t> stamps_ns;
  for (const Element& element : rows.elements) stamps_ns.push_back(element.stamp_ns);
  const std::vector<size_t> rising = LongestRising(stamps_ns), sorted = SortedOnce(rows.elements);
  const size_t displaced = sorted.size() - rising.size();
  const bool sort =
      displaced >= kMinUnsorted &&
      static_cast<double>(displaced) > kMaxDamagedShare * static_cast<double>(sorted.size());
  std::vector<bool> is_kept(rows.elements.size(), false), is_in_place(rows.elements.size(), false);
  std::vector<Element> kept;
  for (const size_t index : sort ? sorted : rising) {
    is_kept[index] = true;
    kept.push_back(rows.elements[index]);
  }
  for (const size_t index : rising) is_in_place[index] = true;
  for (size_t i = 0; i < is_kept.size(); ++i) {
    if (!is_kept[i]) warnings->Add(kStampUnsorted, rows.Place(i));
    if (is_kept[i] && !is_in_place[i]) warnings->Add(kRowSorted, rows.Place(i));
  }
  rows.text.RequireStamps(rows.elements.size(), kept.size());
  if (kept.empty()) {
    throw InputFault("rows", rows.path + ": found no row of data, expected at least one",
                     "write a row a sample or image into " + rows.path);
  }
  rows.text.WarnOfDigits(warnings);
  return kept;
}

// The file of a row, if it is where `base` says.
std::string ImagePath(const fs::path& base, const std::vector<std::string_view>& fields,
                      int64_t stamp_ns) {
  if (fields.size() < 2 || fields[1].empty())
    return (base / fmt::format("{}.png", stamp_ns)).string();
  return (base / fields[1]).string();
}

// The folder that the first row's file lies in; data/ if it is in none.
fs::path FindBase(const fs::path& camera_folder, const std::vector<std::string_view>& fields,
                  int64_t stamp_ns) {
  std::error_code error;
  for (const fs::path& base :
       {camera_folder / "data", camera_folder, camera_folder.parent_path()}) {
    if (fs::exists(ImagePath(base, fields, stamp_ns), error)) return base;
  }
  return camera_folder / "data";
}

void CountGaps(const std::string& path, const std::vector<ImuSample>& samples, Warnings* warnings) {
  const double longest_s = kImuGapSteps * MedianStep_s(samples);
  for (size_t i = 1; i < samples.size(); ++i) {
    const double step_s = ToSeconds(samples[i].stamp_ns - samples[i - 1].stamp_ns);
    if (step_s <= longest_s) continue;
    warnings->Add(
        kImuGap, fmt::format("{}: {:.3f} s after stamp {}", path, step_s, samples[i - 1].stamp_ns));
  }
}

// No file's name holds one; a path would end there.
bool HasZeroByte(const std::vector<std::string_view>& fields) {
  return fields.size() > 1 && fields[1].find('\0') != std::string_view::npos;
}

// Throws where the comment that heads a table of IMU samples says that accelerations stand before
// angular velocities.
void RequireGyroFirst(const std::string& path) {
  std::string head;
  std::getline(std::ifstream(path), head);
  const size_t mark = head.find('#');
  if (mark > 3) return;  // no comment, after a byte order mark at most
  const std::vector<std::string_view> names = SplitRow(std::string_view(head).substr(mark + 1));
  const auto starts_with = [&](size_t column, std::string_view word) {
    return names.size() >= 7 && names[column].substr(0, word.size()) == word;
  };
  const bool accel_first = starts_with(1, "a") && !starts_with(1, "ang");
  const bool gyro_last = starts_with(4, "w") || starts_with(4, "g") || starts_with(4, "ang");
  if (!accel_first || !gyro_last) return;
  throw InputFault("columns",
                   fmt::format("{}: row 1: found the columns '{}', ..., '{}', expected the angular "
                               "velocity before the specific force",
                               path, names[1], names[4]),
                   "write the columns of " + path + " as stamp_ns, wx, wy, wz, ax, ay, az");
}

// The stamp and six numbers after it, NaN for those that are blank; nothing where one is other
// text, or where less than one sensor's are there.
std::optional<ImuRow> ParseImuRow(int number, const std::vector<std::string_view>& fields) {
  const std::optional<int64_t> stamp_ns = ParseStamp(fields[0]);
  if (!stamp_ns || fields.size() < 4) return std::nullopt;
  ImuRow row{*stamp_ns, number, fields.size() >= 7, {}, {}};
  for (size_t i = 0; i < 6; ++i) {
    double& reading = i < 3 ? row.angular_velocity_rad_s[i] : row.specific_force_m_s2[i - 3];
    reading = std::numeric_limits<double>::quiet_NaN();
    if (i + 1 >= fields.size() || fields[i + 1].empty()) {
      row.is_whole = false;
    } else if (const std::optional<double> value = ParseNumber(fields[i + 1])) {
      reading = *value;
    } else {
      return std::nullopt;
    }
  }
  return row;
}

}  // namespace

double MedianStep_s(const std::vector<int64_t>& stamps_ns) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    steps_s.push_back(ToSeconds(stamps_ns[i] - stamps_ns[i - 1]));
  }
  return Median(std::move(steps_s));
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<size_t> LongestRising(const std::vector<int64_t>& stamps_ns) {
  std::vector<size_t> tails;  // tails[k]: the lowest end of a rising subsequence of k + 1 elements
  std::vector<std::ptrdiff_t> previous(stamps_ns.size(), -1);
  for (size_t i = 0; i < stamps_ns.size(); ++i) {
    const auto place =
        std::lower_bound(tails.begin(), tails.end(), stamps_ns[i],
                         [&](size_t tail, int64_t stamp_ns) { return stamps_ns[tail] < stamp_ns; });
    if (place != tails.begin()) previous[i] = static_cast<std::ptrdiff_t>(*(place - 1));
    if (place == tails.end()) {
      tails.push_back(i);
    } else if (stamps_ns[*place] != stamps_ns[i]) {  // of equal stamps the first is kept
      *place = i;
    }
  }
  std::vector<size_t> kept;
  std::ptrdiff_t at = tails.empty() ? -1 : static_cast<std::ptrdiff_t>(tails.back());
  for (; at >= 0; at = previous[at]) kept.push_back(static_cast<size_t>(at));
  std::reverse(kept.begin(), kept.end());
  return kept;
}

TableRows<ImageFile> ReadImageRows(const std::string& camera_folder, Warnings* warnings) {
  const fs::path folder(camera_folder);
  const std::string path = (folder / "data.csv").string();
  TableRows<ImageFile> rows{path, TableText(path, "stamp_ns, file")};
  std::vector<double> written_stamps;  // before they are rounded to nanoseconds
  std::optional<fs::path> base;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    const std::optional<int64_t> stamp_ns = ParseStamp(fields[0]);
    if (!stamp_ns || HasZeroByte(fields)) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, row));
      rows.text.AddUnreadable(row, fields);
      return;
    }
    if (!base) base = FindBase(folder, fields, *stamp_ns);
    rows.elements.push_back({*stamp_ns, ImagePath(*base, fields, *stamp_ns)});
    rows.numbers.push_back(row);
    written_stamps.push_back(ParseNumber(fields[0]).value_or(0));
    rows.text.AddRead(fields);
  });
  rows.text.RequireReadable();
  rows.text.RequireDigits();
  RequireNanoseconds(path, written_stamps, rows.text, kMaxImageRate_hz, kUsualImageRate_hz);
  return rows;
}

std::vector<ImageFile> TakeImages(TableRows<ImageFile> rows, Warnings* warnings,
                                  std::vector<ClockJump>* jumps) {
  const auto same = [](const ImageFile& a, const ImageFile& b) { return a.path == b.path; };
  const auto place = [&](size_t row) { return rows.Place(row); };
  if (jumps != nullptr) *jumps = RestoreClock(same, place, &rows.elements);
  return Rising(rows, warnings);
}

TableRows<ImuRow> ReadImuRows(const std::string& path, Warnings* warnings) {
  RequireGyroFirst(path);
  TableRows<ImuRow> rows{path, TableText(path, "stamp_ns, wx, wy, wz, ax, ay, az")};
  std::vector<double> written_stamps;
  ForEachRow(path, [&](int number, const std::vector<std::string_view>& fields) {
    const std::optional<ImuRow> row = ParseImuRow(number, fields);
    if (!row) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, number));
      rows.text.AddUnreadable(number, fields);
      return;
    }
    rows.elements.push_back(*row);
    rows.numbers.push_back(number);
    written_stamps.push_back(ParseNumber(fields[0]).value_or(0));
    rows.text.AddRead(fields);
  });
  rows.text.RequireReadable();
  rows.text.RequireDigits();
  RequireNanoseconds(path, written_stamps, rows.text, kMaxImuRate_hz, kUsualImuRate_hz);
  return rows;
}

std::vector<ImuSample> TakeSamples(TableRows<ImuRow> rows, Warnings* warnings,
                                   std::vector<ClockJump>* jumps) {
  TableRows<ImuSample> whole{rows.path, rows.text};
  for (const ImuRow& row : JoinImuStreams(rows.path, std::move(rows.elements), warnings, jumps)) {
    if (row.angular_velocity_rad_s.allFinite() && row.specific_force_m_s2.allFinite()) {
      whole.elements.push_back({row.stamp_ns, row.angular_velocity_rad_s, row.specific_force_m_s2});
      whole.numbers.push_back(row.number);
    } else {
      warnings->Add(row.is_whole ? kRowNotFinite : kRowUnreadable,
                    fmt::format("{}: row {}", rows.path, row.number));
    }
  }
  const auto same = [](const ImuSample& a, const ImuSample& b) {
    return a.angular_velocity_rad_s == b.angular_velocity_rad_s &&
           a.specific_force_m_s2 == b.specific_force_m_s2;
  };
  const auto place = [&](size_t row) { return whole.Place(row); };
  if (jumps != nullptr && jumps->empty()) *jumps = RestoreClock(same, place, &whole.elements);
  const std::vector<ImuSample> samples = Rising(whole, warnings);
  CountGaps(rows.path, samples, warnings);
  return samples;
}

std::vector<ImageFile> ReadAslImages(const std::string& camera_folder, Warnings* warnings,
                                     std::vector<ClockJump>* jumps) {
  return TakeImages(ReadImageRows(camera_folder, warnings), warnings, jumps);
}

std::vector<ImuSample> ReadAslImu(const std::string& path, Warnings* warnings,
                                  std::vector<ClockJump>* jumps) {
  return TakeSamples(ReadImuRows(path, warnings), warnings, jumps);
}

namespace {

constexpr size_t kSteadyRows = 5;
constexpr int64_t kSteadySteps = 4;        // median steps, at most between rows that rise steadily
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
    return gap_ns > 0 && gap_ns <= kSteadySteps * step_ns_;
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
    return Step_ns(row) > 0 && Step_ns(row) <= kSteadySteps * step_ns_;
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
  const double forward_ns =
      std::max(kClockForward_s * 1e9, kClockForwardSteps * static_cast<double>(step_ns));
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

std::string AslImuText(const ImuRow& row) {
  std::string text = std::to_string(row.stamp_ns);
  for (const Eigen::Vector3d& half : {row.angular_velocity_rad_s, row.specific_force_m_s2}) {
    for (const double value : half) {
      text += std::isnan(value) && !row.is_whole ? "," : fmt::format(",{}", value);
    }
  }
  return text + '\n';
}

}  // namespace slcmap::data
