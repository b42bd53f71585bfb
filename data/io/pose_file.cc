#include "data/io/pose_file.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/csv.h"
#include "data/io/pose_rows.h"

namespace slcmap::inline data {
namespace {

constexpr int64_t kMostPoseStamp_ns = int64_t{1} << 62;  // differences stay within range

struct StampUnit {
  const char* name;
  int shift;  // power of ten to nanoseconds
};
constexpr std::array<StampUnit, 4> kUnits = {{{"s", 9}, {"ms", 6}, {"us", 3}, {"ns", 0}}};

int64_t StampIn(const std::string& path, const RowText& row, int shift) {
  const std::optional<int64_t> stamp_ns = ParseScaledInteger(row.stamp, shift);
  if (stamp_ns && std::abs(*stamp_ns) <= kMostPoseStamp_ns) return *stamp_ns;
  throw DataError(
      fmt::format("{}: row {}: found '{}', expected a stamp", path, row.row, row.stamp));
}

// What tells the unit of stamps.
struct StampFigures {
  double least = INFINITY, most = -INFINITY, step = 0;  // 0 where all are alike
};

StampFigures SelectFigures(const FileText& file) {
  StampFigures figures;
  std::vector<double> steps;
  double before = 0;
  for (const RowText& row : file.rows) {
    const double stamp = ParseNumber(row.stamp).value_or(NAN);
    if (!std::isfinite(stamp)) continue;  // refused once the unit is known
    if (&row != &file.rows[0] && stamp != before) steps.push_back(std::abs(stamp - before));
    figures.least = std::min(figures.least, stamp);
    figures.most = std::max(figures.most, stamp);
    before = stamp;
  }
  figures.step = Quantile(steps, 0.5);
  return figures;
}

// How well stamps are explained by a unit, or by being numbers of images.
struct UnitFit {
  const StampUnit* unit = nullptr;  // none for numbers of images
  int rank = -1;                    // higher by a rate of poses, by times of the clock, by dates
  double share = 0;                 // of the time of stamps and clock, what both have
};

// Where the stamps do not lie on the clock's times they may have another start.
UnitFit ComputeFit(const StampUnit& unit, const StampFigures& stamps, double offset_s,
                   const Clock& clock) {
  constexpr double kLeastStep_s = 4e-4, kMostStep_s = 20, kDate_s = 1e9;
  const double scale = std::pow(10, unit.shift - 9), step_s = scale * stamps.step;
  const double size_s = scale * std::max(std::abs(stamps.least), std::abs(stamps.most));
  if (size_s > 1e-9 * static_cast<double>(kMostPoseStamp_ns)) return {};
  const bool is_rate = step_s == 0 || (kLeastStep_s <= step_s && step_s <= kMostStep_s);
  UnitFit fit{&unit, (is_rate ? 3 : 0) + (size_s >= kDate_s ? 2 : 0), 1};
  const double from_s = scale * stamps.least + offset_s, to_s = scale * stamps.most + offset_s;
  if (clock.empty()) {
    if (size_s >= kDate_s) fit.rank += 2;  // more than a rate, which sparse poses have not
    return fit;
  }
  const double start_s = ToSeconds(clock.front()), end_s = ToSeconds(clock.back());
  const bool is_on = from_s <= end_s && start_s <= to_s;
  if (is_on) fit.rank += 2;
  const double shift_s = is_on ? 0 : start_s - from_s;
  const double shared_s = std::min(to_s + shift_s, end_s) - std::max(from_s + shift_s, start_s);
  const double all_s = std::max(to_s + shift_s, end_s) - std::min(from_s + shift_s, start_s);
  if (all_s > 0) fit.share = shared_s / all_s;
  return fit;
}

// Whole numbers from 0 or 1 on, most of them by one each, that in seconds would be far more than
// the clock has: the share of them that it has.
double ShareOfNumbers(const FileText& file, const StampFigures& stamps, const Clock& clock) {
  if (clock.size() < 2 || stamps.least > 1 || stamps.step != 1 ||
      stamps.most <= 1.5 * ToSeconds(clock.back() - clock.front()) + 1) {
    return 0;
  }
  double before = -1;
  for (const RowText& row : file.rows) {
    const double number = ParseNumber(row.stamp).value_or(-1);
    if (!(number > before) || !ParseScaledInteger(row.stamp, 0) ||
        row.stamp.find_first_of(".eE") != std::string::npos) {
      return 0;
    }
    before = number;
  }
  return std::min(1.0, static_cast<double>(clock.size()) / stamps.most);
}

// EuRoC's form has nanoseconds; others are told.
bool IsNanosecondForm(const FileText& file) {
  return file.form_shift == 0 && file.rows[0].stamp.find('.') == std::string::npos;
}

// The unit of the stamps; none where they are numbers of images. Throws DataError with the remedy
// where two fit.
const StampUnit* FindUnit(const FileText& file, const PoseForm& form, const Clock& clock,
                          const char* remedy) {
  const StampFigures stamps = SelectFigures(file);
  std::vector<UnitFit> fits;
  for (const StampUnit& unit : kUnits) {
    if (form.stamps == unit.name) return &unit;
    fits.push_back(ComputeFit(unit, stamps, form.offset_s, clock));
  }
  const auto is_better = [](const UnitFit& a, const UnitFit& b) {
    return std::pair(a.rank, a.share) > std::pair(b.rank, b.share);
  };
  std::ranges::stable_sort(fits, is_better);
  if (fits[0].rank < 0) return &kUnits.back();  // too large for any
  if (IsNanosecondForm(file) && std::ranges::any_of(fits, [&](const UnitFit& fit) {
        return fit.unit == &kUnits.back() && fit.rank == fits[0].rank;
      })) {
    return &kUnits.back();
  }
  const double numbers = ShareOfNumbers(file, stamps, clock);
  if (numbers > 0) fits.push_back({nullptr, fits[0].rank, numbers});
  std::ranges::stable_sort(fits, is_better);
  const UnitFit &best = fits[0], &second = fits[1];
  if (second.rank == best.rank && best.share < 0.5 && 2 * second.share > best.share) {
    const auto name = [](const UnitFit& fit) {
      return fit.unit == nullptr ? "numbers of images" : fit.unit->name;
    };
    throw DataError(fmt::format(
        "{}: found stamps from {} to {}, which may be {} or {}, expected times that fit the "
        "recording in one unit; {}",
        file.table.path, file.rows.front().stamp, file.rows.back().stamp, name(best), name(second),
        remedy));
  }
  return best.unit;
}

void SetStampsIn(const StampUnit& unit, const PoseForm& form, FileText* file) {
  const bool is_usual = unit.shift == file->form_shift || form.stamps == unit.name ||
                        (unit.shift == 0 && file->form_shift == 9 &&
                         file->rows[0].stamp.find('.') == std::string::npos);
  if (!is_usual) {
    spdlog::warn(
        "{}: stamps are taken to be in {}, by their rate and times, as {} (--poses-stamps says it)",
        file->table.path, unit.name, file->rows[0].stamp);
  }
  for (RowText& row : file->rows) row.pose.stamp_ns = StampIn(file->table.path, row, unit.shift);
}

// A column of another file, in any unit.
std::vector<int64_t> StampsFrom(const PoseForm& form, const Clock& clock) {
  const std::string& path = form.stamps;
  FileText file;
  file.table.path = path;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    if (file.rows.empty() && !ParseNumber(fields[0])) return;
    file.rows.push_back({row, std::string(fields[0]), {}});
  });
  if (file.rows.empty()) throw DataError(path + ": found no stamp, expected one in each row");
  const StampUnit* unit =
      FindUnit(file, form, clock, "write them in whole nanoseconds of the recording's clock");
  if (unit == nullptr) {
    throw DataError(path + ": found numbers of rows, expected the stamp of each row");
  }
  SetStampsIn(*unit, form, &file);
  std::vector<int64_t> stamps_ns;
  for (const RowText& row : file.rows) stamps_ns.push_back(row.pose.stamp_ns);
  return stamps_ns;
}

bool NamesUnit(const std::string& stamps) {
  return stamps.empty() || std::any_of(kUnits.begin(), kUnits.end(),
                                       [&](const StampUnit& unit) { return stamps == unit.name; });
}

void SetStampsOfOthers(const std::string& of, const std::vector<int64_t>& stamps_ns,
                       FileText* file) {
  if (stamps_ns.size() != file->rows.size()) {
    throw DataError(fmt::format(
        "{}: found {} rows {} and {} stamps in {}, expected as many; give --poses-stamps FILE, "
        "with the stamp of each row in FILE (KITTI's times.txt)",
        file->table.path, file->rows.size(),
        file->has_stamps ? "of poses" : "of matrices without stamps (KITTI's form)",
        stamps_ns.size(), of));
  }
  for (size_t i = 0; i < stamps_ns.size(); ++i) file->rows[i].pose.stamp_ns = stamps_ns[i];
}

// A truth has rows at other times than images, unless it has as many.
void SetStampsOfImages(const Clock& clock, bool is_of_images, FileText* file) {
  const auto number = [](const RowText& row) { return *ParseScaledInteger(row.stamp, 0); };
  const auto count = static_cast<int64_t>(clock.size());
  const int64_t last = number(file->rows.back());
  const int64_t from = last == count && number(file->rows.front()) == 1 ? 1 : 0;
  if (last - from >= count || (!is_of_images && last - from + 1 < count)) {
    throw DataError(fmt::format(
        "{}: found stamps from {} to {} one by one, which are numbers of rows and no times, and {} "
        "stamps of {}; give --poses-stamps FILE, with the stamp of each row in FILE, or s where "
        "they are seconds",
        file->table.path, file->rows.front().stamp, last, count,
        is_of_images ? "images" : "the truth, which need not be those of the images"));
  }
  spdlog::warn(
      "{}: stamps from {} to {} one by one are taken to be the numbers of the {} stamps of images "
      "or truth (--poses-stamps s takes them as seconds)",
      file->table.path, file->rows.front().stamp, last, count);
  for (RowText& row : file->rows)
    row.pose.stamp_ns = clock[static_cast<size_t>(number(row) - from)];
}

void SetStamps(const PoseForm& form, const Clock& clock, bool is_of_images, FileText* file) {
  if (!NamesUnit(form.stamps)) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(form.stamps, error)) {
      throw ConfigError(fmt::format(
          "--poses-stamps: found '{}', expected ns, us, ms, s, or a file with a stamp in each row",
          form.stamps));
    }
    return SetStampsOfOthers(form.stamps, StampsFrom(form, clock), file);
  }
  if (!file->has_stamps) {
    SetStampsOfOthers("the recording's images or the truth", clock, file);
    spdlog::warn(
        "{}: rows of matrices without stamps (KITTI's form) are taken to be those of the {} stamps "
        "of images or truth, one after the other",
        file->table.path, clock.size());
    return;
  }
  const StampUnit* unit = FindUnit(*file, form, clock, "give --poses-stamps with ns, us, ms or s");
  if (unit == nullptr) return SetStampsOfImages(clock, is_of_images, file);
  SetStampsIn(*unit, form, file);
}

bool IsSamePose(const PoseRow& a, const PoseRow& b) {
  constexpr double kSame = 1e-6;
  return (a.p - b.p).norm() < kSame;
}

void RefuseLostDigits(const PoseTable& table, size_t repeated) {
  if (2 * repeated < table.rows.size() + repeated) return;
  throw DataError(fmt::format(
      "{}: found {} stamps of {} that are those of another row, expected one a row: the stamps "
      "lost digits; write them with all of them, as '%.9f'",
      table.path, repeated, table.rows.size() + repeated));
}

void Sort(PoseTable* table) {
  const auto is_before = [](const PoseRow& a, const PoseRow& b) { return a.stamp_ns < b.stamp_ns; };
  std::vector<PoseRow>& rows = table->rows;
  size_t unsorted = 0, repeated = 0, different = 0;
  for (size_t i = 1; i < rows.size(); ++i) unsorted += is_before(rows[i], rows[i - 1]);
  std::stable_sort(rows.begin(), rows.end(), is_before);
  std::vector<PoseRow> kept;
  for (const PoseRow& row : rows) {
    if (!kept.empty() && kept.back().stamp_ns == row.stamp_ns) {
      ++repeated;
      different += !IsSamePose(kept.back(), row);
      continue;
    }
    kept.push_back(row);
  }
  rows = std::move(kept);
  RefuseLostDigits(*table, repeated);
  if (unsorted > 0) {
    spdlog::warn("{}: found rows out of order at {} places; they are sorted by their stamps",
                 table->path, unsorted);
  }
  if (repeated > 0) {
    spdlog::warn(
        "{}: found {} rows with the stamp of another ({} of them with another pose); the "
        "first of each is taken",
        table->path, repeated, different);
  }
}

Eigen::Quaterniond MakeRotation(const PoseRow& row, bool is_scalar_first, bool is_conjugated) {
  const auto& v = row.quaternion;
  const Eigen::Quaterniond q = is_scalar_first ? Eigen::Quaterniond(v[0], v[1], v[2], v[3])
                                               : Eigen::Quaterniond(v[3], v[0], v[1], v[2]);
  return is_conjugated ? q.normalized().conjugate() : q.normalized();
}

}  // namespace

PoseTable ReadPoseTable(const std::string& path, const PoseForm& form, const Clock& clock,
                        bool is_of_images) {
  form.Check();
  FileText file = ReadPoseRows(path);
  SetStamps(form, clock, is_of_images, &file);
  for (const RowText& row : file.rows) {
    if (!row.is_lost) file.table.rows.push_back(row.pose);
  }
  Sort(&file.table);
  return file.table;
}

Trajectory CollectPoses(const PoseTable& table, const PoseForm& form,
                        const std::optional<RigidTransform>& T_imu_camera) {
  if (form.IsOfCamera() && !T_imu_camera) {
    throw ConfigError(
        "--poses-of camera: found no calibration, expected one that says where the camera is on "
        "the IMU: --calibration names it");
  }
  const bool is_scalar_first =
      form.quaternion.empty() ? table.is_scalar_first : form.quaternion.starts_with("wxyz");
  // What is upright stays as it is, to the last bit.
  const bool is_upright = form.Up() == Eigen::Vector3d::UnitZ();
  const RigidTransform turn{TurnUp(form.Up()), Eigen::Vector3d::Zero()};
  const int64_t offset_ns = std::llround(form.offset_s * 1e9);
  Trajectory trajectory;
  for (const PoseRow& row : table.rows) {
    RigidTransform T{MakeRotation(row, is_scalar_first && !table.is_matrix, form.IsConjugated()),
                     form.scale * row.p};
    if (form.IsInverse()) T = T.Inverse();
    if (form.IsOfCamera()) T = T * T_imu_camera->Inverse();
    trajectory.push_back({row.stamp_ns + offset_ns, is_upright ? T : turn * T});
  }
  return trajectory;
}

Eigen::Quaterniond TurnUp(const Eigen::Vector3d& up) {
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
}

Eigen::Vector3d MoveNearOrigin(Trajectory* trajectory) {
  constexpr double kFar_m = 1e4;
  if (trajectory->empty()) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d& first = trajectory->front().T_world_imu.translation;
  if (first.norm() < kFar_m) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d offset_m = first.array().round();
  for (StampedPose& pose : *trajectory) pose.T_world_imu.translation -= offset_m;
  return offset_m;
}

}  // namespace slcmap::data
