// Reads the images of a sequence ahead of their use, in a thread.
#pragma once

#include <memory>
#include <optional>

#include "data/sequence.h"

namespace slcmap {

struct StereoReaderOptions {
  bool read_right = true;  // false leaves the right images empty and unread
  int read_ahead = 8;      // pairs decoded and waiting, at most
};

class StereoReader {
 public:
  // `sequence` must outlive the reader.
  explicit StereoReader(const Sequence& sequence, const StereoReaderOptions& options = {});
  ~StereoReader();

  // The next pair that can be read, in the order of the stamps; nothing at the end. Pairs with an
  // image that is missing, truncated, undecodable or of another size than calibrated are left out
  // and counted.
  std::optional<StereoImage> Next();

  // What was left out before the pair given last; the same whatever the threads' timing.
  const Warnings& warnings() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap
