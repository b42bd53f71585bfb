#include "odometry/frontend/corner_detector.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

constexpr int kBlock_px = 7;
constexpr double kSobelScale = 0.125;         // to grey values a pixel
constexpr float kMinEigenvalueRatio = 0.15f;  // an edge slides along itself
constexpr int kPerCell = 6;

struct Corner {
  Eigen::Vector2d px;
  float response = 0;
  int cell = 0;
};

// What a corner at a pixel must have.
class Threshold {
 public:
  Threshold(const cv::Mat& image, const GradientNoise& noise, const CornerDetectorOptions& options)
      : image_(image),
        noise_(noise),
        min_over_noise_(options.min_over_noise),
        least_(static_cast<float>(options.min_response * options.min_response)) {}

  float least() const { return least_; }

  bool Passes(float response, const cv::Point& px) const {
    constexpr int kReach = kBlock_px / 2;
    const cv::Rect block(px.x - kReach, px.y - kReach, kBlock_px, kBlock_px);
    return response > min_over_noise_ * noise_.VarianceAt(cv::mean(image_(block))[0]);
  }

 private:
  const cv::Mat& image_;
  const GradientNoise& noise_;
  double min_over_noise_;
  float least_;
};

bool Stronger(const Corner& a, const Corner& b) { return a.response > b.response; }

// The smaller eigenvalue of the mean product of the gradients (Shi and Tomasi, 1994); 0 at edges,
// which have no second direction. Pixels of `image` beyond its view count where there are any.
cv::Mat Response(const cv::Mat& image) {
  cv::Mat x, y, xx, xy, yy;
  cv::Sobel(image, x, CV_32F, 1, 0, 3, kSobelScale);
  cv::Sobel(image, y, CV_32F, 0, 1, 3, kSobelScale);
  const cv::Size block(kBlock_px, kBlock_px);
  cv::boxFilter(x.mul(x), xx, -1, block);
  cv::boxFilter(x.mul(y), xy, -1, block);
  cv::boxFilter(y.mul(y), yy, -1, block);
  cv::Mat response(image.size(), CV_32F);
  for (int v = 0; v < image.rows; ++v) {
    const float *a = xx.ptr<float>(v), *b = xy.ptr<float>(v), *c = yy.ptr<float>(v);
    float* r = response.ptr<float>(v);
    for (int u = 0; u < image.cols; ++u) {
      const float half_trace = 0.5f * (a[u] + c[u]);
      const float difference = 0.5f * (a[u] - c[u]);
      const float root = std::sqrt(difference * difference + b[u] * b[u]);
      const float smaller = half_trace - root, larger = half_trace + root;
      r[u] = smaller > kMinEigenvalueRatio * larger ? smaller : 0;
    }
  }
  return response;
}

// The local maxima of the corner response in one cell, the strongest first.
void AppendCorners(const cv::Mat& image, const cv::Mat& free, const cv::Rect& area, int cell,
                   const Threshold& threshold, std::vector<Corner>* corners) {
  const cv::Rect padded(area.x - 1, area.y - 1, area.width + 2, area.height + 2);
  cv::Mat highest;
  const cv::Mat response = Response(image(padded));
  cv::dilate(response, highest, cv::Mat());
  const size_t first = corners->size();
  for (int v = 1; v + 1 < response.rows; ++v) {
    const float* r = response.ptr<float>(v);
    const float* h = highest.ptr<float>(v);
    const uchar* f = free.ptr<uchar>(padded.y + v) + padded.x;
    for (int u = 1; u + 1 < response.cols; ++u) {
      if (r[u] < threshold.least() || r[u] < h[u] || !f[u]) continue;
      const cv::Point px(padded.x + u, padded.y + v);
      if (threshold.Passes(r[u], px)) corners->push_back({Eigen::Vector2d(px.x, px.y), r[u], cell});
    }
  }
  std::stable_sort(corners->begin() + first, corners->end(), Stronger);
  if (corners->size() > first + kPerCell) corners->resize(first + kPerCell);
}

// Divides the image into cells of about cell_px.
class Grid {
 public:
  Grid(cv::Size size, double cell_px, int border_px)
      : inner_(border_px, border_px, size.width - 2 * border_px, size.height - 2 * border_px),
        columns_(std::max(1, static_cast<int>(inner_.width / cell_px))),
        rows_(std::max(1, static_cast<int>(inner_.height / cell_px))) {}

  int count() const { return columns_ * rows_; }

  int CellAt(const Eigen::Vector2d& px) const {
    const double c = (px.x() - inner_.x) * columns_ / inner_.width;
    const double r = (px.y() - inner_.y) * rows_ / inner_.height;
    return std::clamp(static_cast<int>(r), 0, rows_ - 1) * columns_ +
           std::clamp(static_cast<int>(c), 0, columns_ - 1);
  }

  cv::Rect Area(int cell) const {
    const int c = cell % columns_, r = cell / columns_;
    return {Edge(c, r), Edge(c + 1, r + 1)};
  }

 private:
  cv::Point Edge(int c, int r) const {
    return {inner_.x + c * inner_.width / columns_, inner_.y + r * inner_.height / rows_};
  }

  cv::Rect inner_;
  int columns_, rows_;
};

bool Crowded(const std::vector<Eigen::Vector2d>& chosen, const Eigen::Vector2d& px,
             double min_distance_px) {
  return std::any_of(chosen.begin(), chosen.end(), [&](const auto& other) {
    return (other - px).squaredNorm() < min_distance_px * min_distance_px;
  });
}

}  // namespace

std::vector<Eigen::Vector2d> DetectCorners(const cv::Mat& image, const cv::Mat& mask,
                                           const std::vector<Eigen::Vector2d>& occupied,
                                           int max_count, double cell_px,
                                           const GradientNoise& noise,
                                           const CornerDetectorOptions& options) {
  const Grid grid(image.size(), cell_px, options.border_px);
  const Threshold threshold(image, noise, options);
  cv::Mat free = mask.clone();
  std::vector<int> in_cell(grid.count(), 0);
  for (const auto& p : occupied) {
    cv::circle(free, cv::Point(static_cast<int>(p.x()), static_cast<int>(p.y())),
               static_cast<int>(options.min_distance_px), 0, cv::FILLED);
    ++in_cell[grid.CellAt(p)];
  }
  // Cells are looked at only as far as they are needed: those with the fewest points first.
  std::vector<Eigen::Vector2d> chosen;
  std::vector<Corner> corners;
  std::vector<bool> searched(grid.count(), false);
  for (int most = 0; most < kPerCell && static_cast<int>(chosen.size()) < max_count; ++most) {
    for (int cell = 0; cell < grid.count(); ++cell) {
      if (searched[cell] || in_cell[cell] > most) continue;
      AppendCorners(image, free, grid.Area(cell), cell, threshold, &corners);
      searched[cell] = true;
    }
    std::stable_sort(corners.begin(), corners.end(), Stronger);
    for (const auto& corner : corners) {
      if (static_cast<int>(chosen.size()) >= max_count) break;
      if (in_cell[corner.cell] > most || Crowded(chosen, corner.px, options.min_distance_px)) {
        continue;
      }
      chosen.push_back(corner.px);
      ++in_cell[corner.cell];
    }
  }
  return chosen;
}

}  // namespace slcmap
