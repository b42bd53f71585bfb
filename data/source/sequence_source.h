// A recorded sequence, wherever it is kept, as odometry is fed from it and the check looks at it:
// how it is opened (by a map again), and how it is played at its own pace.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"
#include "data/io/image.h"
#include "data/io/trajectory.h"

namespace slcmap::inline data {

// The images of a pair, by the paths that the recording's ImageStore has them under.
struct StereoEntry {
  int64_t stamp_ns = 0;  // of the left image
  std::string left_path;
  std::string right_path;  // "" where there is one camera, or a knock has turned the right one
  std::vector<std::string> other_paths = {};  // of the third camera on; "" where one has no image

  // Of a camera; "" where it has none.
  const std::string& path(int camera) const {
    static const std::string kNone;
    if (camera < 2) return camera == 0 ? left_path : right_path;
    const auto other = static_cast<size_t>(camera) - 2;
    return other < other_paths.size() ? other_paths[other] : kNone;
  }
};

// Images that were paired otherwise than their stamps have it, as a check mended them.
struct PairPiece {
  int64_t from_ns = 0, to_ns = 0;  // of the first and the last left image, as PairImages has them
  int later = 0;                   // the right images are those of the pairs so many later
  int late = 0;                    // the left ones have the stamps of the pairs so many later
  bool has_right = true;           // false: the right images are not used
};

struct SequenceOptions {
  Mirrored mirrored = Mirrored::kRefused;  // rotations of the calibration
  std::string calibration;                 // file or folder; "" takes the sequence's own
  double max_stereo_offset_s = 0.003;      // between the stamps of a pair, once those are made up
  double right_offset_s = 0;               // right stamps are late by this
  std::vector<std::string> masks;          // image files, one a camera (data/calibration/mask.h)
  std::vector<int> cameras;                // of a chain of them; empty: all
  bool needs_imu = true;  // false: a recording without imu0 will do, and its samples stay unread
  std::vector<PairPiece> pieces = {};  // of the images that are used; none: all, as paired
  std::string topics = {};  // of a bag, as data/bag/topics.h parses them; "": by types and names
  // Found, not asked for: what right stamps tell of Rig::right_time_offset_s.
  double right_stamped_later_s = 0;
  std::vector<double> others_stamped_later_s = {};  // the same of the third camera on
};

// The rig as a calibration of its own tells it: who opens the recording with that adds what the
// stamps tell.
inline Rig WithoutStamps(Rig rig, const SequenceOptions& opened) {
  rig.right_time_offset_s -= opened.right_stamped_later_s;
  for (size_t i = 0; i < opened.others_stamped_later_s.size(); ++i) {
    rig.other_time_offsets_s.at(i) -= opened.others_stamped_later_s[i];
  }
  return rig;
}

// A pair of which all but the left image are still encoded: decoding takes longer than tracking,
// and odometry looks at right images on keyframes only.
struct ReadPair : StereoImage {  // `right` and `others` stay empty
  DeferredImages decode;
};

// What is known of a sequence before any image is read.
struct SourceInfo {
  std::string name;           // for messages, such as the folder
  std::string form;           // how it is kept, such as "ASL folder"
  Rig rig;                    // as calibrated; of one camera where IsStereo is false
  std::string calibration;    // where the rig was read from
  bool finds_carried = true;  // whether what moves with the rig is to be looked for
  // Of all pairs that the recording names, on the camera's clock, rising; some may prove
  // unreadable.
  std::vector<int64_t> pair_stamps_ns;
  SequenceOptions opened = {};                          // see Sequence
  std::vector<std::string> cameras = {"cam0", "cam1"};  // as the recording names them
};

class SequenceSource {
 public:
  virtual ~SequenceSource() = default;

  virtual const SourceInfo& info() const = 0;

  // Leaves out of the images what moves with the rig; masks as Rig::masks has them.
  virtual void SetMasks(const std::vector<cv::Mat>& masks) = 0;

  // The next pair that can be read, in the order of the stamps; nothing at the end. Pairs with an
  // image that cannot be used are left out and counted. Those with stamps before from_ns are passed
  // over, perhaps without being read (nor counted).
  virtual std::optional<ReadPair> NextPair(
      int64_t from_ns = std::numeric_limits<int64_t>::min()) = 0;

  // The next IMU sample, in the order of the stamps; nothing at the end. Independent of NextPair.
  virtual std::optional<ImuSample> NextImu() = 0;

  // What was left out so far, while the sequence was opened and by NextPair.
  virtual Warnings warnings() const = 0;

  // The true poses of the IMU; empty where there are none. Throws DataError where they cannot be
  // read.
  virtual Trajectory ReadTruth() const = 0;

  // The following look at single images, whatever is next. `pair` is an index into pair_stamps_ns.

  // Decodes the image.
  virtual ImageRead ReadImage(size_t pair, int camera) const = 0;

  // What can be told to be wrong with the image without decoding it: a kind of data/core/error.h,
  // or nullptr. Cheap enough to be asked for every image.
  virtual const char* FindProblem(size_t pair, int camera) const = 0;

  // Whether the image is that of the pair before, to the byte. pair > 0.
  virtual bool IsRepeated(size_t pair, int camera) const = 0;

  // Where the image is, for messages.
  virtual std::string ImagePlace(size_t pair, int camera) const = 0;
};

// The IMU samples that are left, in the order of their stamps.
inline std::vector<ImuSample> AllSamples(SequenceSource* source) {
  std::vector<ImuSample> samples;
  while (const auto sample = source->NextImu()) samples.push_back(*sample);
  return samples;
}

// How a recording was kept up with.
struct RealTimeReport {
  int64_t skipped_images = 0;                     // because newer ones were due already
  double latency_median_s = 0, latency_95_s = 0;  // from when an image was due until it was done
};

// An image is due when as much time has passed since the first was asked for as between their
// stamps. Where several are due, the newest is next and the others are skipped, but never the
// first.
class RealTimePace {
 public:
  // Of any monotonic clock, in nanoseconds.
  struct Clock {
    std::function<int64_t()> now_ns;
    std::function<void(int64_t)> sleep_until_ns;  // may return early, as on Ctrl-C
  };

  // stamps_ns: of all images, ascending; at least one.
  RealTimePace(std::vector<int64_t> stamps_ns, Clock clock);

  // Whether the next image is due, if there is one.
  bool IsDue() const;

  // Waits until the next image is due, and gives the stamp of the newest one that is. There must be
  // one.
  int64_t Next();

  // The image that is processed: that of Next(), or, where it could not be read, a later one until
  // whose time this waits.
  void Take(int64_t stamp_ns);

  // The image with this stamp is done.
  void Done(int64_t stamp_ns);

  bool AtEnd() const { return next_ == stamps_ns_.size(); }
  RealTimeReport Report() const;

 private:
  int64_t DueAt_ns(int64_t stamp_ns) const;

  std::vector<int64_t> stamps_ns_;
  Clock clock_;
  int64_t start_ns_ = 0;
  size_t next_ = 0;  // index of the first image that was neither taken nor skipped
  int64_t skipped_ = 0;
  std::vector<int64_t> latencies_ns_;
};

// The steady clock, whose sleep looks after at most 50 ms whether it is to end early.
RealTimePace::Clock SteadyClock(std::function<bool()> ends_early);

}  // namespace slcmap::data
