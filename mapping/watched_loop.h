// A loop over independent items on several threads that can be stopped.
#pragma once

#include <algorithm>
#include <cstddef>
#include <opencv2/core/utility.hpp>

#include "data/progress.h"

namespace slcmap {

// Calls work(i) for each i in [0, count): what it writes must be of item i alone. Whether all are
// done, which they are not once progress says so; it is asked after each `at_once` of them.
template <typename Work>
bool ForEachWatched(size_t count, const Progress& progress, Work work, size_t at_once = 64) {
  for (size_t begin = 0; begin < count; begin += at_once) {
    if (!progress.Report(static_cast<double>(begin) / static_cast<double>(count))) return false;
    const size_t end = std::min(count, begin + at_once);
    cv::parallel_for_({static_cast<int>(begin), static_cast<int>(end)},
                      [&](const cv::Range& range) {
                        for (int i = range.start; i < range.end; ++i) work(static_cast<size_t>(i));
                      });
  }
  return progress.Report(1);
}

}  // namespace slcmap
