// How the rows of a table of stamps are written, to say what is wrong with all of them at once.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/warnings.h"

namespace slcmap {

class TableText {
 public:
  // `columns`: what a row should hold, for messages.
  TableText(std::string path, std::string columns)
      : path_(std::move(path)), columns_(std::move(columns)) {}

  void AddRead(const std::vector<std::string_view>& fields);
  void AddUnreadable(int row, const std::vector<std::string_view>& fields);

  // Throws InputFault where most rows cannot be read, with one of them, and where numbers have
  // decimal commas, or have lost their points.
  void RequireReadable() const;

  // Stamps as powers of ten, as spreadsheets and C++ streams print large numbers, may have lost
  // digits: throws InputFault where those that are left are more than 1 ms apart.
  void RequireDigits() const;

  // Counts it in warnings where they are coarse, but of use.
  void WarnOfDigits(Warnings* warnings) const;

  // Throws InputFault where most of the rows share their stamps with others: `kept` have their own.
  void RequireStamps(size_t rows, size_t kept) const;

 private:
  std::string path_, columns_;
  int64_t read_ = 0, unreadable_ = 0, decimal_commas_ = 0, pointless_ = 0;
  std::string first_unreadable_, first_decimal_comma_, first_pointless_;  // "row 12: 'text'"
  std::string stamp_;                                   // one as a power of ten
  double resolution_ns_ = 0;  // the finest of those; 0 where stamps are plain
};

inline constexpr const char* kStampDigits = "stamps_with_lost_digits";

}  // namespace slcmap
