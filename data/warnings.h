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

  // Adds the counts of another, without logging again.
  void Merge(const Warnings& other);

  int64_t Count(const std::string& kind) const;
  const std::map<std::string, Entry>& entries() const { return entries_; }

 private:
  std::map<std::string, Entry> entries_;
};

// The kinds that the readers count.
inline constexpr const char* kRowUnreadable = "rows that cannot be read";
inline constexpr const char* kRowNotFinite = "rows with NaN or infinity";
inline constexpr const char* kStampUnsorted = "rows with an unsorted or repeated stamp";
inline constexpr const char* kImuGap = "gaps in the IMU samples";
inline constexpr const char* kImageUnpaired = "images without a partner in time";
inline constexpr const char* kImageMissing = "image files missing";
inline constexpr const char* kImageTruncated = "image files truncated";
inline constexpr const char* kImageUndecodable = "image files that cannot be decoded";
inline constexpr const char* kImageWrongSize = "images of another size than calibrated";
inline constexpr const char* kImuNoiseAssumed = "IMU noise not given, a typical one assumed";

}  // namespace slcmap
