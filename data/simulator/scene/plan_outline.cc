#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/simulator/scene/scene_parts.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;

constexpr double kSpeck_m2 = 0.005;    // of what is dark: smaller ones are dirt
constexpr double kStraight_m = 0.025;  // how far pixels of a straight side are off it

// Sides that nearly run along the picture's rows or columns do so.
void Square(std::vector<Vector2d>* corners) {
  const size_t n = corners->size();
  for (int k : {0, 1}) {
    for (size_t i = 0; i < n; ++i) {
      Vector2d &a = (*corners)[i], &b = (*corners)[(i + 1) % n];
      if (std::abs(a[k] - b[k]) > 2 || std::abs(a[1 - k] - b[1 - k]) < 8) continue;
      a[k] = b[k] = 0.5 * (a[k] + b[k]);
    }
  }
}

// The corners, y down, of the outline that begins with the upper side of a dark pixel; it runs
// between pixels, with what is dark to its right. Marks the upper sides that are on it.
std::vector<cv::Point> FollowOutline(const cv::Mat& mask, const cv::Point& start, cv::Mat* passed) {
  const auto is_dark = [&](const cv::Point& pixel) {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < mask.cols && pixel.y < mask.rows &&
           mask.at<uint8_t>(pixel) > 0;
  };
  std::vector<cv::Point> corners = {start};
  cv::Point at = start, way(1, 0);
  do {
    if (way.x > 0) passed->at<uint8_t>(at) = 255;
    at += way;
    const cv::Point right(-way.y, way.x);
    // The pixels before the corner, right and left of the way, by their upper left corners.
    const cv::Point ahead(std::min(0, way.x + right.x), std::min(0, way.y + right.y));
    const cv::Point aside(std::min(0, way.x - right.x), std::min(0, way.y - right.y));
    const cv::Point before = way;
    if (is_dark(at + aside)) {
      way = -right;
    } else if (!is_dark(at + ahead)) {
      way = right;
    }
    if (way != before) corners.push_back(at);
  } while (at != start || way != cv::Point(1, 0));
  corners.pop_back();  // the start again
  return corners;
}

}  // namespace

std::vector<std::vector<Vector2d>> TraceOutlines(const cv::Mat& mask, double pixel_m) {
  cv::Mat passed = cv::Mat::zeros(mask.size(), CV_8U);
  std::vector<std::vector<Vector2d>> outlines;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const bool is_upper_side =
          mask.at<uint8_t>(y, x) > 0 && (y == 0 || mask.at<uint8_t>(y - 1, x) == 0);
      if (!is_upper_side || passed.at<uint8_t>(y, x) > 0) continue;
      const std::vector<cv::Point> traced = FollowOutline(mask, {x, y}, &passed);
      if (cv::contourArea(traced) * pixel_m * pixel_m < kSpeck_m2) continue;
      std::vector<cv::Point> polygon;
      cv::approxPolyDP(traced, polygon, std::max(1.2, kStraight_m / pixel_m), true);
      if (polygon.size() < 3) continue;
      std::vector<Vector2d> corners;
      for (const cv::Point& p : polygon) corners.emplace_back(p.x, mask.rows - p.y);
      Square(&corners);
      outlines.push_back(corners);
    }
  }
  return outlines;
}

}  // namespace slcmap::data
