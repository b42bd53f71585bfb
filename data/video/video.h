// A video and what was logged beside it, written as an EuRoC (ASL) folder: its frames (of mp4, mkv,
// mov, avi: what libavformat opens), grey, by their true times, and samples of an IMU.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/progress.h"

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

struct VideoRecording {
  std::string left, right;        // files; "" of the right where there is one camera
  bool side_by_side = false;      // the left one holds both images of a pair, left and right
  std::vector<std::string> logs;  // of the IMU, one or, of its sensors apart, several
  std::string frame_times;        // a table of the frames' times; "" where the video's are used
};

// What belongs together, for a video or the folder of one: data.mkv, data2.mkv and data.jsonl as
// Spectacular AI writes them; else a .jsonl or .csv called as the video is. What `said` has stays.
// Throws InputFault, with what is there and what to say.
VideoRecording FindVideoRecording(const std::string& path, const VideoRecording& said);

// Whether FindVideoRecording may be asked for it: a file called as videos are, or a folder with a
// data.mkv or data.mp4 and without images.
bool IsVideoRecording(const std::string& path);

struct VideoCounts {
  int64_t left = 0, right = 0, imu = 0;
  Warnings warnings;
};

// Writes cam0, cam1 and imu0 into a folder. Frames have the times of the log or of the table, in
// their order, else those of the video, which have to be on the IMU's clock: an InputFault where
// the video starts at another time. Throws OutputError, and StoppedError where progress ends it.
VideoCounts UnpackVideo(const VideoRecording& recording, const std::string& folder,
                        const Progress& progress);

}  // namespace slcmap::data
