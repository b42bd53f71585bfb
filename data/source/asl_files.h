// The tables of an ASL folder (EuRoC, TUM VI): image lists and IMU samples; and where the clock of
// a recorder is set to another time while it records.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"
#include "data/io/csv.h"

namespace slcmap::inline data {

inline constexpr const char* kClockJump = "clock_set_to_another_time";

struct ClockJump {
  size_t row = 0;         // index of the first one on the clock as it is set
  int64_t back_ns = 0;    // how far it is set back; forward, or a pause, where negative
  int64_t stamp_ns = 0;   // of that row, as it is taken
  bool put_back = false;  // whether the rows from there on are on the clock before
  std::string place;      // file and row
};

// The jumps of a table's stamps, in the order of its rows. A clock that is set back shows in rows
// that rise steadily before and behind a drop; not in a few that are out of place, in blocks that
// were put together in the wrong order, nor in rows written twice (`same` tells of two indices
// whether they hold the same). Long steps are given as forward jumps.
std::vector<ClockJump> FindClockJumps(const std::vector<int64_t>& stamps_ns,
                                      const std::function<bool(size_t, size_t)>& same);

// Puts what is behind a clock that was set back on the clock before; `stamp_ns` of the jumps are
// set, and `place` by the index of a row.
template <typename Element, typename Same, typename Place>
std::vector<ClockJump> RestoreClock(const Same& same, const Place& place,
                                    std::vector<Element>* elements) {
  std::vector<int64_t> stamps_ns;
  for (const Element& element : *elements) stamps_ns.push_back(element.stamp_ns);
  std::vector<ClockJump> jumps = FindClockJumps(
      stamps_ns, [&](size_t a, size_t b) { return same((*elements)[a], (*elements)[b]); });
  for (ClockJump& jump : jumps) {
    jump.place = place(jump.row);
    jump.put_back = jump.back_ns > 0;
    if (!jump.put_back) continue;
    for (size_t i = jump.row; i < elements->size(); ++i) (*elements)[i].stamp_ns += jump.back_ns;
  }
  for (ClockJump& jump : jumps) jump.stamp_ns = (*elements)[jump.row].stamp_ns;
  return jumps;
}

// Counts them, with words.
void CountJumps(const std::vector<ClockJump>& jumps, Warnings* warnings);

// Takes out the samples behind a jump for as long as makes odometry start anew.
void BreakImu(const ClockJump& jump, std::vector<ImuSample>* samples);

// A table, with its jumps.
template <typename Element>
struct ClockTable {
  std::vector<Element>* elements;
  std::vector<ClockJump>* jumps;

  // Moves all from a jump on.
  void Shift(size_t jump, int64_t by_ns) {
    const int64_t from_ns = (*jumps)[jump].stamp_ns;
    for (Element& element : *elements) element.stamp_ns += element.stamp_ns >= from_ns ? by_ns : 0;
    for (size_t i = jump; i < jumps->size(); ++i) (*jumps)[i].stamp_ns += by_ns;
  }
};

inline constexpr int64_t kSameJump_ns = 500'000'000;  // of two tables, at most
inline constexpr int64_t kSameEnd_ns = 60'000'000;    // by which they end apart, about an image

// The jump of a table that is that of another, as an index; their number where there is none.
inline size_t SameJump(const ClockJump& jump, const std::vector<ClockJump>& others) {
  size_t i = 0;
  while (i < others.size() && (std::abs(others[i].stamp_ns - jump.stamp_ns) > kSameJump_ns ||
                               std::abs(others[i].back_ns - jump.back_ns) > kSameJump_ns)) {
    ++i;
  }
  return i;
}

// Where both were set back at once, by as much as `finer` says, which has the shorter steps.
template <typename Finer, typename Element>
void AgreeOnJumps(const ClockTable<Finer>& finer, ClockTable<Element>* table) {
  for (size_t i = 0; i < table->jumps->size(); ++i) {
    ClockJump& jump = (*table->jumps)[i];
    if (jump.back_ns < 0) continue;
    const size_t same = SameJump(jump, *finer.jumps);
    if (same == finer.jumps->size()) continue;
    const int64_t by_ns = (*finer.jumps)[same].back_ns - jump.back_ns;
    table->Shift(i, by_ns);
    jump.back_ns += by_ns;
  }
}

// A table that leaps forward by itself, and ends later than `other` by as much, has had its clock
// set forward; what follows is put back. Without a later end, it has lost what is missing.
template <typename Other, typename Element>
void UndoForward(const ClockTable<Other>& other, ClockTable<Element>* table) {
  if (other.elements->empty() || table->elements->empty()) return;
  for (size_t i = 0; i < table->jumps->size(); ++i) {
    ClockJump& jump = (*table->jumps)[i];
    if (jump.back_ns >= 0 || SameJump(jump, *other.jumps) < other.jumps->size()) continue;
    const int64_t late_ns = table->elements->back().stamp_ns - other.elements->back().stamp_ns;
    if (std::abs(late_ns + jump.back_ns) > std::max(kSameEnd_ns, std::abs(late_ns) / 10)) continue;
    table->Shift(i, jump.back_ns);
    jump.put_back = true;
  }
}

// Leaves out what is a pause of one table: forward jumps that were not put back and that `other`
// does not share.
void LeaveOutPauses(const std::vector<ClockJump>& other, std::vector<ClockJump>* jumps);

// The heads of the tables, as they are written.
inline constexpr const char* kAslImagesHead = "#timestamp [ns],filename\n";
inline constexpr const char* kAslImuHead =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

struct ImageFile {
  int64_t stamp_ns = 0;
  std::string path;
};

// What the rows of a table hold, in their order.
template <typename Element>
struct TableRows {
  std::string path;  // of the table, for messages
  TableText text;
  std::vector<Element> elements = {};
  std::vector<int> numbers = {};  // of the rows, for messages

  std::string Place(size_t index) const { return path + ": row " + std::to_string(numbers[index]); }
};

// A row of the IMU. What it does not hold, or not as a finite number, is NaN.
struct ImuRow {
  int64_t stamp_ns = 0;
  int number = 0;         // in the file, from 1
  bool is_whole = false;  // holds six numbers, some perhaps not finite
  Eigen::Vector3d angular_velocity_rad_s;
  Eigen::Vector3d specific_force_m_s2;
};

// The line of an ASL table for it. Numbers that are not finite are a half that it does not have,
// which is blank, unless it is whole.
std::string AslImuText(const ImuRow& row);

// Reads <camera_folder>/data.csv: "stamp_ns, file". The file is taken relative to data/, to the
// camera's folder or to the folder above, whichever holds the first one; without that column it is
// data/<stamp_ns>.png. Rows that cannot be read are counted. Throws DataError when the file is
// missing, InputFault when the stamps seem to be in another unit than nanoseconds or have lost
// digits, and when most rows cannot be read.
TableRows<ImageFile> ReadImageRows(const std::string& camera_folder, Warnings* warnings);

// Reads an ASL imu0/data.csv: "stamp_ns, wx, wy, wz, ax, ay, az" in rad/s and m/s^2; more columns
// are ignored. Bad rows and InputFault as above, that also where the comment that heads the table
// says another order.
TableRows<ImuRow> ReadImuRows(const std::string& path, Warnings* warnings);

// Rows outside the longest rising sequence of stamps are counted and dropped; a table with more
// than a fifth of its rows out of place is sorted instead, and only its repeated stamps are
// dropped. Where the clock was set back, what follows is put on the clock before, and added to
// `jumps`, as are long gaps; without `jumps` stamps stay as they are. Throws InputFault where no
// row is left, or most have no stamp of their own.
std::vector<ImageFile> TakeImages(TableRows<ImageFile> rows, Warnings* warnings,
                                  std::vector<ClockJump>* jumps = nullptr);

// The same of the IMU. Rows that hold one sensor only are joined, and packets stamped on arrival
// evened out (JoinImuStreams). Those that are not finite are dropped, gaps are counted.
std::vector<ImuSample> TakeSamples(TableRows<ImuRow> rows, Warnings* warnings,
                                   std::vector<ClockJump>* jumps = nullptr);

// Both in one.
std::vector<ImageFile> ReadAslImages(const std::string& camera_folder, Warnings* warnings,
                                     std::vector<ClockJump>* jumps = nullptr);
std::vector<ImuSample> ReadAslImu(const std::string& path, Warnings* warnings,
                                  std::vector<ClockJump>* jumps = nullptr);

// The median step between sorted stamps in seconds, 0 with fewer than two.
double MedianStep_s(const std::vector<int64_t>& stamps_ns);

// The same of elements that have stamp_ns.
template <typename Stamped>
double MedianStep_s(const std::vector<Stamped>& elements) {
  std::vector<int64_t> stamps_ns;
  for (const Stamped& element : elements) stamps_ns.push_back(element.stamp_ns);
  return MedianStep_s(stamps_ns);
}

// Indices of the longest strictly rising subsequence, so that one absurd stamp costs one row.
std::vector<size_t> LongestRising(const std::vector<int64_t>& stamps_ns);

double Median(std::vector<double> values);  // 0 when empty

}  // namespace slcmap::data
