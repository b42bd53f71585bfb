// The errors that a user can cause, and that a program prints in one line; and what was wrong with
// data and survived.
#pragma once

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace slcmap::inline data {

// The base of every error that slcmap throws on purpose. The message is one line and names the
// place (file, key or row), what was found there and what was expected.
class Error : public std::runtime_error {
 public:
  explicit Error(std::string message) : std::runtime_error(InOneLine(std::move(message))) {}

 private:
  // What was found may hold line breaks and other control characters.
  static std::string InOneLine(std::string message) {
    for (char& c : message) {
      if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = ' ';
    }
    return message;
  }
};

// A wrong option, configuration key or command line.
class ConfigError : public Error {
 public:
  using Error::Error;
};

// Input that cannot be used at all: a missing folder, an absurd calibration, an empty sequence.
class DataError : public Error {
 public:
  using Error::Error;
};

// Output that could not be written: a full disk, a missing permission.
class OutputError : public Error {
 public:
  using Error::Error;
};

// A DataError with a word for scripts (a finding's name, see data/check/report.h) and a remedy, for
// the check of a recording to show.
class InputFault : public DataError {
 public:
  InputFault(const std::string& name, const std::string& message, const std::string& remedy)
      : DataError(message), name_(name), remedy_(remedy) {}

  const std::string& name() const { return name_; }
  const std::string& remedy() const { return remedy_; }

 private:
  std::string name_, remedy_;
};

// A rotation of the calibration that is a mirror image of one.
class MirroredFault : public InputFault {
 public:
  using InputFault::InputFault;
};

// What was wrong with data and survived: counted by kind, said once.

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

}  // namespace slcmap::data
