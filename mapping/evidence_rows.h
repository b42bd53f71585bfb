// What tables of a map that tell which image shows what have in common.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "data/csv_table.h"
#include "mapping/map.h"

namespace slcmap {

// The stamps of a map's poses, which images are named by.
class PoseStamps {
 public:
  explicit PoseStamps(const MapResult& map) {
    for (const Trajectory* poses : {&map.trajectory, &map.keyframes}) {
      for (const StampedPose& pose : *poses) stamps_ns_.push_back(pose.stamp_ns);
    }
    std::sort(stamps_ns_.begin(), stamps_ns_.end());
  }

  // That of a table of one row.
  int64_t At(const CsvTable& row, std::size_t column) const {
    const int64_t stamp_ns = row.Integer(0, column);
    if (!std::binary_search(stamps_ns_.begin(), stamps_ns_.end(), stamp_ns)) {
      row.Fail(0, column, "the stamp of a pose in trajectory.tum or keyframes.tum");
    }
    return stamp_ns;
  }

 private:
  std::vector<int64_t> stamps_ns_;
};

// Adds what follows the last one by its key (KeyOf), which the columns of `order` are.
template <typename Item>
void AddNext(const Item& item, const CsvTable& row, const char* order, std::vector<Item>* items) {
  if (!items->empty() && !(KeyOf(items->back()) < KeyOf(item))) {
    row.Fail(0, 0, fmt::format("rows in the order of {}, each once", order));
  }
  items->push_back(item);
}

}  // namespace slcmap
