#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "data/io/image.h"
#include "mapping/plan/plan_files.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

constexpr double kMostPixels = 2e8;

// Ink is dark, paper and what is transparent are white.
cv::Mat1b ReadInk(const std::string& path) {
  cv::Mat image = ReadStoredImage(path);
  if (image.empty()) {
    throw DataError(
        fmt::format("{}: found no image that can be read, expected a plan (PNG, JPEG, "
                    "TIFF, DXF, IFC, GeoJSON or a map folder)",
                    path));
  }
  if (static_cast<double>(image.total()) > kMostPixels) {
    throw DataError(fmt::format("{}: found {} x {} pixels, expected at most {:.0f} in all", path,
                                image.cols, image.rows, kMostPixels));
  }
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257);
  std::vector<cv::Mat1b> channels;
  cv::split(image, channels);
  cv::Mat1b grey = channels[0].clone();
  if (channels.size() >= 3)
    cv::cvtColor(image, grey, channels.size() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  if (channels.size() == 2 || channels.size() == 4) grey.setTo(255, channels.back() < 128);
  cv::Mat1b ink;
  cv::compare(grey, 128, ink, cv::CMP_LT);
  return ink;
}

// The line through the points of a border between two of its corners; pixels at the corners belong
// to both sides.
cv::Vec4f FitSide(const std::vector<cv::Point>& border, std::size_t from, std::size_t to) {
  const std::size_t count = border.size(), steps = (to + count - from) % count;
  const std::size_t margin = std::min<std::size_t>(3, steps / 4);
  std::vector<cv::Point> points;
  for (std::size_t i = margin; i + margin <= steps; ++i)
    points.push_back(border[(from + i) % count]);
  cv::Vec4f line;
  cv::fitLine(points, line, cv::DIST_L2, 0, 0.01, 0.01);
  return line;
}

// Where a fitted side is nearest to a corner of the border.
Vector2d OnLine(const cv::Vec4f& line, const cv::Point& corner) {
  const Vector2d along(line[0], line[1]), point(line[2], line[3]);
  return point + along.dot(Vector2d(corner.x, corner.y) - point) * along;
}

std::vector<std::size_t> FindCorners(const std::vector<cv::Point>& border) {
  constexpr double kStraight_px = 1.6;
  std::vector<cv::Point> kept;
  cv::approxPolyDP(border, kept, kStraight_px, true);
  std::vector<std::size_t> corners;
  std::size_t at = 0;
  for (const cv::Point& corner : kept) {  // in the border's order
    while (at < 2 * border.size() && border[at % border.size()] != corner) ++at;
    corners.push_back(at % border.size());
  }
  return corners;
}

class ImagePlan {
 public:
  ImagePlan(const cv::Size& size, double pixel_m) : size_(size), pixel_m_(pixel_m) {}

  // Borders of what is dark, with the dark at their left as the image is looked at (y down).
  void AddBorder(const std::vector<cv::Point>& border) {
    if (border.size() < 4) return;
    const std::vector<std::size_t> corners = FindCorners(border);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      AddSide(border, corners[i], corners[(i + 1) % corners.size()]);
    }
  }

  const BuildingPlan& plan() const { return plan_; }

 private:
  void AddSide(const std::vector<cv::Point>& border, std::size_t from, std::size_t to) {
    constexpr double kLeastSide_px = 3;
    const cv::Point a = border[from], b = border[to];
    if (std::hypot(b.x - a.x, b.y - a.y) < kLeastSide_px) return;
    const cv::Vec4f line = FitSide(border, from, to);
    PlannedFace face{InPlan(OnLine(line, a)), InPlan(OnLine(line, b)), pixel_m_ / std::sqrt(12.0)};
    // The border goes through the middle of pixels.
    const Vector2d beyond = 0.5 * pixel_m_ * face.Normal().cwiseAbs().maxCoeff() * face.Normal();
    face.start += beyond - 0.5 * pixel_m_ * face.Along();
    face.end += beyond + 0.5 * pixel_m_ * face.Along();
    plan_.faces.push_back(face);
  }

  // The middle of the pixel at the lower left is half a pixel right of and above the origin.
  Vector2d InPlan(const Vector2d& px) const {
    return pixel_m_ * Vector2d(px.x() + 0.5, size_.height - 0.5 - px.y());
  }

  const cv::Size size_;
  const double pixel_m_;
  BuildingPlan plan_;
};

}  // namespace

std::vector<BuildingPlan> ReadImagePlan(const std::string& path, double pixel_m) {
  constexpr double kLeastPixel_m = 1e-4, kMostPixel_m = 1;
  const cv::Mat1b ink = ReadInk(path);
  if (pixel_m == 0) {
    throw ConfigError(fmt::format(
        "{}: found an image of {} x {} pixels without a scale, expected --plan-pixel-m: how many "
        "metres a pixel is",
        path, ink.cols, ink.rows));
  }
  if (!(pixel_m >= kLeastPixel_m && pixel_m <= kMostPixel_m)) {
    throw ConfigError(fmt::format("--plan-pixel-m: found {} m, expected {} to {} m", pixel_m,
                                  kLeastPixel_m, kMostPixel_m));
  }
  if (2.0 * cv::countNonZero(ink) > static_cast<double>(ink.total())) {
    throw DataError(
        fmt::format("{}: found {:.0f} % of the image dark, expected dark walls on white", path,
                    100.0 * cv::countNonZero(ink) / static_cast<double>(ink.total())));
  }
  std::vector<std::vector<cv::Point>> borders;
  cv::Mat1b framed;
  cv::copyMakeBorder(ink, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::findContours(framed, borders, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE, {-1, -1});
  ImagePlan plan(ink.size(), pixel_m);
  for (const std::vector<cv::Point>& border : borders) plan.AddBorder(border);
  return {plan.plan()};
}

}  // namespace slcmap::mapping
