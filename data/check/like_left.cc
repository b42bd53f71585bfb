#include "data/check/like_left.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

constexpr float kSameFocal = 0.05F;

cv::Mat FilledUp(const cv::Mat& image, const cv::Size& size) {
  if (image.empty() || image.size() == size) return image;
  cv::Mat filled;
  cv::copyMakeBorder(image, filled, 0, size.height - image.rows, 0, size.width - image.cols,
                     cv::BORDER_REPLICATE);
  return filled;
}

}  // namespace

LikeLeft::LikeLeft(const Rig& rig) {
  const Camera &left = rig.cameras[0], &right = rig.cameras[1];
  if (right.width_px <= 0) return;
  const auto focal = static_cast<float>(left.MiddleFocal_px() / right.MiddleFocal_px());
  if (std::abs(focal - 1) > kSameFocal) scale_ = focal;
  const auto scaled = [&](int px) {
    return static_cast<int>(std::ceil(scale_ * static_cast<float>(px)));
  };
  scaled_ = cv::Size(scaled(right.width_px), scaled(right.height_px));
  filled_ =
      cv::Size(std::max(scaled_.width, left.width_px), std::max(scaled_.height, left.height_px));
}

cv::Mat LikeLeft::Left(const cv::Mat& left) const { return FilledUp(left, filled_); }

cv::Mat LikeLeft::Right(const cv::Mat& right) const {
  if (scale_ == 1 || right.empty()) return FilledUp(right, filled_);
  const cv::Matx23f map(scale_, 0, 0.5F * (scale_ - 1), 0, scale_, 0.5F * (scale_ - 1));
  cv::Mat blurred = right, scaled;
  if (scale_ < 1) cv::GaussianBlur(right, blurred, cv::Size(), 0.5 / scale_);
  cv::warpAffine(blurred, scaled, map, scaled_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return FilledUp(scaled, filled_);
}

cv::Point2f LikeLeft::FromRight(const cv::Point2f& px) const {
  if (scale_ == 1) return px;
  return scale_ * (px + cv::Point2f(0.5F, 0.5F)) - cv::Point2f(0.5F, 0.5F);
}

cv::Point2f LikeLeft::ToRight(const cv::Point2f& px) const {
  if (scale_ == 1) return px;
  return (px + cv::Point2f(0.5F, 0.5F)) / scale_ - cv::Point2f(0.5F, 0.5F);
}

}  // namespace slcmap
