// A recording in memory as a source: nothing of it was ever a file.
#pragma once

#include <opencv2/core.hpp>
#include <utility>

#include "data/source/sequence_source.h"

namespace slcmap::testing {

class MemorySource : public SequenceSource {
 public:
  MemorySource(const Rig& rig, std::vector<StereoImage> pairs, std::vector<ImuSample> samples)
      : info_{"memory", "recording in memory", rig, "given", true, {}},
        pairs_(std::move(pairs)),
        samples_(std::move(samples)) {
    for (const StereoImage& pair : pairs_) info_.pair_stamps_ns.push_back(pair.stamp_ns);
  }

  const SourceInfo& info() const override { return info_; }
  void SetMasks(const std::vector<cv::Mat>& masks) override { info_.rig.masks = masks; }

  std::optional<ReadPair> NextPair(int64_t from_ns) override {
    while (next_pair_ < pairs_.size()) {
      const size_t i = next_pair_++;
      if (pairs_[i].stamp_ns < from_ns) continue;
      if (FindProblem(i, 0) != nullptr || FindProblem(i, 1) != nullptr) {
        warnings_.Add(kImageMissing, ImagePlace(i, 0));
        continue;
      }
      ReadPair pair;
      pair.stamp_ns = pairs_[i].stamp_ns;
      pair.left = pairs_[i].left;
      pair.decode = {[right = pairs_[i].right] { return right; }};
      return pair;
    }
    return std::nullopt;
  }

  std::optional<ImuSample> NextImu() override {
    if (next_sample_ == samples_.size()) return std::nullopt;
    return samples_[next_sample_++];
  }

  Warnings warnings() const override { return warnings_; }
  Trajectory ReadTruth() const override { return {}; }

  ImageRead ReadImage(size_t pair, int camera) const override {
    return {Image(pair, camera), FindProblem(pair, camera)};
  }
  const char* FindProblem(size_t pair, int camera) const override {
    return Image(pair, camera).empty() ? kImageMissing : nullptr;
  }
  bool IsRepeated(size_t pair, int camera) const override {
    const cv::Mat &before = Image(pair - 1, camera), &image = Image(pair, camera);
    return !image.empty() && before.size() == image.size() &&
           cv::norm(before, image, cv::NORM_INF) == 0;
  }
  std::string ImagePlace(size_t pair, int camera) const override {
    return "image " + std::to_string(pair) + " of cam" + std::to_string(camera);
  }

 private:
  const cv::Mat& Image(size_t pair, int camera) const {
    return camera == 0 ? pairs_[pair].left : pairs_[pair].right;
  }

  SourceInfo info_;
  std::vector<StereoImage> pairs_;
  std::vector<ImuSample> samples_;
  Warnings warnings_;
  size_t next_pair_ = 0, next_sample_ = 0;
};

}  // namespace slcmap::testing
