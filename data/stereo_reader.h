// Reads the images of a sequence ahead of their use, in a thread.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "data/sequence.h"
#include "data/source/sequence_source.h"

namespace slcmap {

struct StereoReaderOptions {
  bool read_right = true;  // false leaves the right images unread
  int read_ahead = 8;      // pairs decoded and waiting, at most
};

class StereoReader {
 public:
  // `sequence` must outlive the reader.
  explicit StereoReader(const Sequence& sequence, const StereoReaderOptions& options = {});
  ~StereoReader();

  // The next pair that can be read, in the order of the stamps; nothing at the end. Pairs with an
  // image that is missing, truncated, undecodable or of another size than calibrated are left out
  // and counted; of a right PNG, only its header is decoded to tell. Pairs with stamps before
  // from_ns are passed over, without decoding (nor counting) those that were not read ahead yet.
  std::optional<ReadPair> Next(int64_t from_ns = std::numeric_limits<int64_t>::min());

  // What was left out before the pair given last; where none were passed over, the same whatever
  // the threads' timing.
  const Warnings& warnings() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap
