#include "data/source/dark_half.h"

#include <algorithm>
#include <array>
#include <optional>

#include "data/io/image.h"
#include "data/io/light_dots.h"

namespace slcmap::inline data {
namespace {

constexpr size_t kRun = 6, kRuns = 3;     // of images one after the other, over the recording
constexpr double kLitToDark = 1.5;        // of the level of dots, at least
constexpr double kLeastLitLevel = 0.003;  // of dots in the lit ones

// Which of two is lit, over a run: 0 where even ones are, 1 where odd ones are; nothing where it is
// not every other one.
std::optional<size_t> FindLit(const ImageStore& images, const std::vector<StereoEntry>& pairs,
                              size_t begin) {
  std::array<double, 2> most = {0, 0}, least = {1e9, 1e9};
  for (size_t i = begin; i < begin + kRun; ++i) {
    const cv::Mat image = ReadGrayImage(images, pairs[i].left_path, {}).image;
    if (image.empty()) return std::nullopt;
    const double level = DotLevel(image);
    most[i % 2] = std::max(most[i % 2], level);
    least[i % 2] = std::min(least[i % 2], level);
  }
  for (const size_t lit : {0, 1}) {
    if (least[lit] > std::max(kLeastLitLevel, kLitToDark * most[1 - lit])) return lit;
  }
  return std::nullopt;
}

}  // namespace

void KeepDarkHalf(const ImageStore& images, std::vector<StereoEntry>* pairs, Warnings* warnings) {
  if (pairs->size() < kRuns * kRun) return;
  size_t alternating = 0;  // a lost image may be in one
  for (size_t run = 0; run < kRuns; ++run) {
    alternating += FindLit(images, *pairs, run * (pairs->size() - kRun) / (kRuns - 1)).has_value();
    if (run > alternating) return;
  }
  // A lost image changes which are lit: each is told by itself and its neighbours.
  std::vector<double> levels;
  for (const StereoEntry& pair : *pairs) {
    const cv::Mat image = ReadGrayImage(images, pair.left_path, {}).image;
    levels.push_back(image.empty() ? 0 : DotLevel(image));
  }
  std::vector<StereoEntry> dark;
  for (size_t i = 0; i < pairs->size(); ++i) {
    const double before = levels[i > 0 ? i - 1 : i + 1];
    const double behind = levels[i + 1 < pairs->size() ? i + 1 : i - 1];
    const bool is_lit = levels[i] > std::max(kLeastLitLevel, std::min(before, behind) * kLitToDark);
    if (is_lit) {
      warnings->Add("images_lit_by_an_emitter_left_out", (*pairs)[i].left_path);
    } else {
      dark.push_back((*pairs)[i]);
    }
  }
  *pairs = std::move(dark);
}

}  // namespace slcmap::data
