#include "odometry/frontend/line_descriptor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/line_descriptor.hpp>

#include "odometry/frontend/line_geometry.h"

namespace slcmap {
namespace {

using cv::line_descriptor::KeyLine;

// Of the image that is described: a fifth of the time that the whole image takes.
constexpr double kScale = 0.5;
constexpr int kBandWidth_px = 4;  // there; nine bands make up the neighbourhood

LineSegment InSmallImage(const LineSegment& s) {
  const auto scaled = [](const Eigen::Vector2d& p) -> Eigen::Vector2d {
    return kScale * (p.array() + 0.5) - 0.5;
  };
  return {scaled(s.start), scaled(s.end)};
}

KeyLine ToKeyLine(const LineSegment& segment, int index, const cv::Size& size) {
  KeyLine line;
  line.class_id = index;
  line.octave = 0;
  line.startPointX = line.sPointInOctaveX = static_cast<float>(segment.start.x());
  line.startPointY = line.sPointInOctaveY = static_cast<float>(segment.start.y());
  line.endPointX = line.ePointInOctaveX = static_cast<float>(segment.end.x());
  line.endPointY = line.ePointInOctaveY = static_cast<float>(segment.end.y());
  line.pt = cv::Point2f(static_cast<float>(segment.Midpoint().x()),
                        static_cast<float>(segment.Midpoint().y()));
  const Eigen::Vector2d d = Direction(segment);
  line.angle = static_cast<float>(std::atan2(d.y(), d.x()));
  line.lineLength = static_cast<float>(segment.Length());
  line.numOfPixels = static_cast<int>(std::lround(segment.Length()));
  line.response = line.lineLength / std::max(size.width, size.height);
  line.size = line.lineLength;
  return line;
}

}  // namespace

cv::Mat DescribeSegments(const cv::Mat& image, const std::vector<LineSegment>& segments) {
  if (segments.empty()) return {};
  cv::Mat small;
  cv::resize(image, small, cv::Size(), kScale, kScale, cv::INTER_AREA);
  std::vector<KeyLine> lines;
  lines.reserve(segments.size());
  for (const auto& s : segments) {
    lines.push_back(ToKeyLine(InSmallImage(s), static_cast<int>(lines.size()), small.size()));
  }
  cv::line_descriptor::BinaryDescriptor::Params params;
  params.widthOfBand_ = kBandWidth_px;
  cv::Mat descriptors;
  cv::line_descriptor::BinaryDescriptor::createBinaryDescriptor(params)->compute(small, lines,
                                                                                 descriptors);
  return descriptors;
}

int DescriptorDistance(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<int>(cv::norm(a, b, cv::NORM_HAMMING));
}

}  // namespace slcmap
