#include "data/asl_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

#include "data/error.h"
#include "data/imu_stamps.h"
#include "data/imu_streams.h"
#include "data/input_fault.h"
#include "data/table_text.h"
#include "data/text_row.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr double kImuGapSteps = 4;  // median steps without a sample that make a gap
// Beyond the highest rates, stamps are in another unit than nanoseconds.
constexpr double kMaxImageRate_hz = 2000, kUsualImageRate_hz = 20;
constexpr double kMaxImuRate_hz = 20000, kUsualImuRate_hz = 200;

// The elements of a table as its rows hold them.
template <typename Element>
struct Rows {
  std::string path;
  TableText text;
  std::vector<Element> elements;
  std::vector<int> numbers;            // of the rows, for messages
  std::vector<double> written_stamps;  // before they are rounded to nanoseconds

  std::string Place(size_t index) const { return fmt::format("{}: row {}", path, numbers[index]); }
};

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
std::vector<Element> Rising(const Rows<Element>& rows, Warnings* warnings) {
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

std::vector<ImageFile> ReadAslImages(const std::string& camera_folder, Warnings* warnings,
                                     std::vector<ClockJump>* jumps) {
  const fs::path folder(camera_folder);
  const std::string path = (folder / "data.csv").string();
  Rows<ImageFile> rows{path, TableText(path, "stamp_ns, file"), {}, {}, {}};
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
    rows.written_stamps.push_back(ParseNumber(fields[0]).value_or(0));
    rows.text.AddRead(fields);
  });
  rows.text.RequireReadable();
  rows.text.RequireDigits();
  RequireNanoseconds(path, rows.written_stamps, rows.text, kMaxImageRate_hz, kUsualImageRate_hz);
  const auto same = [](const ImageFile& a, const ImageFile& b) { return a.path == b.path; };
  const auto place = [&](size_t row) { return rows.Place(row); };
  if (jumps != nullptr) *jumps = RestoreClock(same, place, &rows.elements);
  return Rising(rows, warnings);
}

std::vector<ImuSample> ReadAslImu(const std::string& path, Warnings* warnings,
                                  std::vector<ClockJump>* jumps) {
  RequireGyroFirst(path);
  Rows<ImuSample> rows{path, TableText(path, "stamp_ns, wx, wy, wz, ax, ay, az"), {}, {}, {}};
  std::vector<ImuRow> read;
  ForEachRow(path, [&](int number, const std::vector<std::string_view>& fields) {
    const std::optional<ImuRow> row = ParseImuRow(number, fields);
    if (!row) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, number));
      rows.text.AddUnreadable(number, fields);
      return;
    }
    read.push_back(*row);
    rows.written_stamps.push_back(ParseNumber(fields[0]).value_or(0));
    rows.text.AddRead(fields);
  });
  rows.text.RequireReadable();
  rows.text.RequireDigits();
  RequireNanoseconds(path, rows.written_stamps, rows.text, kMaxImuRate_hz, kUsualImuRate_hz);
  for (const ImuRow& row : JoinImuStreams(path, std::move(read), warnings, jumps)) {
    if (row.angular_velocity_rad_s.allFinite() && row.specific_force_m_s2.allFinite()) {
      rows.elements.push_back({row.stamp_ns, row.angular_velocity_rad_s, row.specific_force_m_s2});
      rows.numbers.push_back(row.number);
    } else {
      warnings->Add(row.is_whole ? kRowNotFinite : kRowUnreadable,
                    fmt::format("{}: row {}", path, row.number));
    }
  }
  const auto same = [](const ImuSample& a, const ImuSample& b) {
    return a.angular_velocity_rad_s == b.angular_velocity_rad_s &&
           a.specific_force_m_s2 == b.specific_force_m_s2;
  };
  const auto place = [&](size_t row) { return rows.Place(row); };
  if (jumps != nullptr && jumps->empty()) *jumps = RestoreClock(same, place, &rows.elements);
  const std::vector<ImuSample> samples = Rising(rows, warnings);
  CountGaps(path, samples, warnings);
  return samples;
}

}  // namespace slcmap
