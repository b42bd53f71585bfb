#include "data/asl_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "data/error.h"
#include "data/text_row.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr double kImuGapSteps = 4;  // median steps without a sample that make a gap

// A row's elements with the row they came from, for messages.
template <typename Element>
struct Rows {
  std::vector<Element> elements;
  std::vector<int> numbers;
};

// Keeps the elements whose stamps rise; the others are counted.
template <typename Element>
std::vector<Element> DropUnsorted(const std::string& path, const Rows<Element>& rows,
                                  Warnings* warnings) {
  std::vector<int64_t> stamps_ns;
  for (const Element& element : rows.elements) stamps_ns.push_back(element.stamp_ns);
  std::vector<Element> kept;
  size_t next = 0;
  for (const size_t index : LongestRising(stamps_ns)) {
    for (; next < index; ++next) {
      warnings->Add(kStampUnsorted, fmt::format("{}: row {}", path, rows.numbers[next]));
    }
    next = index + 1;
    kept.push_back(rows.elements[index]);
  }
  for (; next < rows.numbers.size(); ++next) {
    warnings->Add(kStampUnsorted, fmt::format("{}: row {}", path, rows.numbers[next]));
  }
  if (kept.empty()) throw DataError(path + ": found no row of data, expected at least one");
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

// Six numbers after the stamp; nothing where one is not a number.
std::optional<Eigen::Matrix<double, 6, 1>> ParseSix(const std::vector<std::string_view>& fields) {
  Eigen::Matrix<double, 6, 1> values;
  if (fields.size() < 7) return std::nullopt;
  for (int i = 0; i < 6; ++i) {
    const std::optional<double> value = ParseNumber(fields[i + 1]);
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  return values;
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

std::vector<ImageFile> ReadAslImages(const std::string& camera_folder, Warnings* warnings) {
  const fs::path folder(camera_folder);
  const std::string path = (folder / "data.csv").string();
  Rows<ImageFile> rows;
  std::optional<fs::path> base;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    const std::optional<int64_t> stamp_ns = ParseScaledInteger(fields[0], 0);
    if (!stamp_ns) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, row));
      return;
    }
    if (!base) base = FindBase(folder, fields, *stamp_ns);
    rows.elements.push_back({*stamp_ns, ImagePath(*base, fields, *stamp_ns)});
    rows.numbers.push_back(row);
  });
  return DropUnsorted(path, rows, warnings);
}

std::vector<ImuSample> ReadAslImu(const std::string& path, Warnings* warnings) {
  Rows<ImuSample> rows;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    const std::optional<int64_t> stamp_ns = ParseScaledInteger(fields[0], 0);
    const auto values = ParseSix(fields);
    if (!stamp_ns || !values) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, row));
    } else if (!values->allFinite()) {
      warnings->Add(kRowNotFinite, fmt::format("{}: row {}", path, row));
    } else {
      rows.elements.push_back({*stamp_ns, values->head<3>(), values->tail<3>()});
      rows.numbers.push_back(row);
    }
  });
  const std::vector<ImuSample> samples = DropUnsorted(path, rows, warnings);
  CountGaps(path, samples, warnings);
  return samples;
}

}  // namespace slcmap
