// What was wrong with data and survived: counted by kind, said once.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace slcmap {

class Warnings {
 public:
  struct Entry {
    int64_t count = 0;
    std::string first_place;
  };

  // Counts one; the first of its kind is logged with its place ("file: row 12").
  void Add(const std::string& kind, const std::string& place);

  // What a kind is called in reports: its words with blanks.
  static std::string InWords(const std::string& kind);

  // Adds the counts of another, without logging again.
  void Merge(const Warnings& other);

  int64_t Count(const std::string& kind) const;
  const std::map<std::string, Entry>& entries() const { return entries_; }

 private:
  std::map<std::string, Entry> entries_;
};

// The kinds that the readers count.
inline constexpr const char* kRowUnreadable = "rows_unreadable";
inline constexpr const char* kRowNotFinite = "rows_not_finite";
inline constexpr const char* kStampUnsorted = "rows_unsorted_or_repeated";
inline constexpr const char* kRowSorted = "rows_sorted_by_stamp";
inline constexpr const char* kImuGap = "imu_gaps";
inline constexpr const char* kImageUnpaired = "images_unpaired";
inline constexpr const char* kImageMissing = "images_missing";
inline constexpr const char* kImageTruncated = "images_truncated";
inline constexpr const char* kImageUndecodable = "images_undecodable";
inline constexpr const char* kImageWrongSize = "images_of_wrong_size";
inline constexpr const char* kImuNoiseAssumed = "imu_noise_assumed";
inline constexpr const char* kTimeShiftsDiffer = "camera_time_shifts_differ";

}  // namespace slcmap
