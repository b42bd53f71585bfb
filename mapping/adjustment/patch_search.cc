#include "mapping/adjustment/patch_search.h"

#include <Eigen/LU>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

using Eigen::Matrix2f;
using Eigen::Vector2f;

constexpr int kAlignIterations = 10;
constexpr float kMinStep_px = 0.02f;
constexpr float kMaxAligned_px = 2;  // from the pixel of best correlation

// The patch as it is expected to look, about its middle pixel; empty beyond the border.
cv::Mat Expected(const cv::Mat& from, const Vector2f& from_px, const Matrix2f& affine,
                 int patch_px) {
  const Matrix2f inverse = affine.inverse();
  const float reach = static_cast<float>(patch_px) * inverse.cwiseAbs().rowwise().sum().maxCoeff();
  if (from_px.minCoeff() < reach || from_px.x() > static_cast<float>(from.cols) - 1 - reach ||
      from_px.y() > static_cast<float>(from.rows) - 1 - reach) {
    return {};
  }
  const float middle = 0.5f * static_cast<float>(patch_px - 1);
  const Vector2f first = from_px - inverse * Vector2f(middle, middle);
  const cv::Matx23f map(inverse(0, 0), inverse(0, 1), first.x(), inverse(1, 0), inverse(1, 1),
                        first.y());
  cv::Mat patch;
  cv::warpAffine(from, patch, map, {patch_px, patch_px}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  return patch;
}

// The best pixels of a map of correlations, each the only one near it.
std::vector<cv::Point> Peaks(cv::Mat correlations, const PatchSearchOptions& options) {
  std::vector<cv::Point> peaks;
  while (std::ssize(peaks) < options.max_places) {
    double best = 0;
    cv::Point at;
    cv::minMaxLoc(correlations, nullptr, &best, nullptr, &at);
    if (!(best >= options.min_correlation)) break;
    peaks.push_back(at);
    cv::circle(correlations, at, static_cast<int>(std::ceil(options.min_apart_px)), -1, cv::FILLED);
  }
  return peaks;
}

}  // namespace

std::vector<Vector2f> SearchPatch(const cv::Mat& from, const Vector2f& from_px, const cv::Mat& to,
                                  const PatchWarp& warp, double within_px,
                                  const PatchSearchOptions& options) {
  const cv::Mat expected = Expected(from, from_px, warp.affine, options.patch_px);
  const int half = options.patch_px / 2, reach = static_cast<int>(std::ceil(within_px)) + half;
  const cv::Point centre(static_cast<int>(std::lround(warp.center_px.x())),
                         static_cast<int>(std::lround(warp.center_px.y())));
  const cv::Rect region(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1);
  if (expected.empty() || (region & cv::Rect({}, to.size())) != region) return {};
  const PatchPattern pattern(options.patch_px);
  Patch patch;
  if (!patch.Extract(pattern, from, from_px, false)) return {};
  cv::Mat correlations;
  cv::matchTemplate(to(region), expected, correlations, cv::TM_CCOEFF_NORMED);
  std::vector<Vector2f> places;
  for (const cv::Point& peak : Peaks(correlations, options)) {
    const Vector2f coarse(static_cast<float>(region.x + peak.x + half),
                          static_cast<float>(region.y + peak.y + half));
    PatchWarp aligned{coarse, warp.affine};
    const float correlation = patch.Align(pattern, to, kAlignIterations, kMinStep_px, &aligned);
    if (correlation < options.min_correlation) continue;
    if ((aligned.center_px - coarse).norm() > kMaxAligned_px) continue;
    places.push_back(aligned.center_px);
  }
  return places;
}

}  // namespace slcmap
