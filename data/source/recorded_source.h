// A recording in a folder or a bag as a source, whose images a thread reads ahead of their use.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "data/source/sequence.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

struct RecordedSourceOptions {
  bool read_right = true;  // false leaves all images but the left ones unread
  int read_ahead = 8;      // pairs decoded and waiting, at most
};

class RecordedSource : public SequenceSource {
 public:
  explicit RecordedSource(Sequence sequence, const RecordedSourceOptions& options = {});
  ~RecordedSource() override;

  const SourceInfo& info() const override { return info_; }
  void SetMasks(const std::vector<cv::Mat>& masks) override { info_.rig.masks = masks; }
  // Pairs with an image that is missing, truncated, undecodable or of another size than calibrated
  // are left out and counted; of a right PNG, only its header is decoded to tell. Those before
  // from_ns are not decoded (nor counted) where they were not read ahead yet.
  std::optional<ReadPair> NextPair(int64_t from_ns = std::numeric_limits<int64_t>::min()) override;
  std::optional<ImuSample> NextImu() override;
  // Of the pairs before the one given last; where none were passed over, the same whatever the
  // threads' timing.
  Warnings warnings() const override;
  Trajectory ReadTruth() const override;

  ImageRead ReadImage(size_t pair, int camera) const override;
  const char* FindProblem(size_t pair, int camera) const override;
  bool IsRepeated(size_t pair, int camera) const override;
  std::string ImagePlace(size_t pair, int camera) const override;

 private:
  class Reader;

  cv::Size GetSize(int camera) const;

  const Sequence sequence_;
  const RecordedSourceOptions options_;
  SourceInfo info_;
  std::unique_ptr<Reader> reader_;  // once a pair was asked for
  size_t next_imu_ = 0;
};

// Opens what a user names as a sequence; throws as OpenSequence does. `read_right` false leaves the
// right images unread.
std::unique_ptr<SequenceSource> OpenSource(const std::string& path,
                                           const SequenceOptions& options = {},
                                           bool read_right = true);

// Opens a recording again as it was opened for a map, with what that knows of the calibration of
// its cameras: a file as WriteKalibrCalibration writes it, where there is one. Masks and the IMU
// stay unread. Throws DataError as OpenSequence does, and for a recording of more than two cameras
// where `opened` does not tell which were used, as those of earlier versions do not.
std::unique_ptr<SequenceSource> OpenAgain(const std::string& path, SequenceOptions opened,
                                          const std::string& calibration, bool read_right = true);

}  // namespace slcmap::data
