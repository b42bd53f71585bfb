// The frames of a video file (mp4, mkv, mov, avi: what libavformat opens), grey, by their true
// times.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "data/core/error.h"

namespace slcmap::inline data {

struct VideoFrame {
  int64_t time_ns = 0;  // as the file has it: frames may be any time apart
  cv::Mat grey;         // 8 bit, one channel, as stored: not turned
};

class VideoFile {
 public:
  // Throws DataError where it cannot be opened, has no video or none that can be decoded.
  explicit VideoFile(const std::string& path);
  ~VideoFile();

  // The next frame that is whole; nothing at the end. Others are counted. Throws DataError where
  // the size of frames changes.
  std::optional<VideoFrame> Next();

  // The share of the file that was read, in [0, 1].
  double Done() const;

  const Warnings& warnings() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// Whether a file is called as videos are.
bool IsVideoName(const std::string& path);

}  // namespace slcmap::data
