// A recorded sequence, wherever it is kept: what odometry is fed from and what the check looks at.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "data/image_file.h"
#include "data/sequence_options.h"
#include "data/trajectory.h"
#include "data/types.h"
#include "data/warnings.h"

namespace slcmap {

// A pair whose right image is still encoded: decoding takes longer than tracking, and odometry
// looks at the right image on keyframes only.
struct ReadPair : StereoImage {           // `right` stays empty
  std::function<cv::Mat()> decode_right;  // gives an empty image where the pixels are damaged
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
  SequenceOptions opened = {};  // see Sequence
  std::array<std::string, 2> cameras = {"cam0", "cam1"};  // as the recording names them
};

class SequenceSource {
 public:
  virtual ~SequenceSource() = default;

  virtual const SourceInfo& info() const = 0;

  // Leaves out of the images what moves with the rig; masks as Rig::masks has them.
  virtual void SetMasks(const std::array<cv::Mat, 2>& masks) = 0;

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

  // The following look at single images, whatever is next. `pair` is an index into pair_stamps_ns,
  // `camera` 0 or 1.

  // Decodes the image.
  virtual ImageRead ReadImage(size_t pair, int camera) const = 0;

  // What can be told to be wrong with the image without decoding it: a kind of data/warnings.h, or
  // nullptr. Cheap enough to be asked for every image.
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

}  // namespace slcmap
