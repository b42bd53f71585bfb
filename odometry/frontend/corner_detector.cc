#include "odometry/frontend/corner_detector.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace slcmap::inline odometry {
namespace {

// The square of the same, at least, over the mean square that the image's noise has there: in
// an image of nothing but noise some place of 10^5 has 2 to 4.
constexpr double kMinOverNoise = 3.5;

// Variance of a block that is constant: cut off at an end of the scale, painted or compressed. It
// shows no noise, whatever there is elsewhere.
constexpr double kLeastDetail = 0.01;
constexpr double kNoiseSobelScale = 0.125;  // to grey values a pixel
constexpr int kBlock_px = 16;
constexpr int kLevels = 16;     // of brightness, evenly from 0 to 256
constexpr int kMinBlocks = 12;  // of a level that are enough to measure it
// Of the blocks of a level, by strength: what share is below the one that is taken for noise, and
// what that one has of the mean where all blocks show noise alone.
constexpr double kQuantile = 0.15, kQuantileOverMean = 0.88;
// Squares of the weights of the second difference in both directions (Immerkaer, "Fast noise
// variance estimation", 1996), which sees little of what a lens images.
constexpr double kDetailOfNoise = 36;
// The gradient has 0.19 of the variance that detail tells where noise differs from pixel to pixel,
// and 0.25 to 0.6 after bilinear resampling at 1.25 to 1 pixels a pixel. More is texture.
constexpr double kMaxGradientOverDetail = 0.7;
// Brightness of blocks without pixels at the ends of the scale, where noise is cut off.
constexpr double kDarkest = 2, kBrightest = 245;

struct NoiseBlock {
  double grey = 0;      // mean brightness
  double gradient = 0;  // variance of its components, mean of both
  double detail = 0;    // variance of the pixels that the finest detail would have as noise
};

// Over an area that has neighbours on all sides.
NoiseBlock Measure(const cv::Mat& image, const cv::Rect& area) {
  long sum = 0, sum_x = 0, sum_y = 0, sum_xx_yy = 0, sum_dd = 0;
  for (int v = area.y; v < area.y + area.height; ++v) {
    const uchar* above = image.ptr<uchar>(v - 1);
    const uchar* here = image.ptr<uchar>(v);
    const uchar* below = image.ptr<uchar>(v + 1);
    int row = 0, row_x = 0, row_y = 0, row_xx_yy = 0, row_dd = 0;
    for (int u = area.x; u < area.x + area.width; ++u) {
      const int a = above[u - 1], b = above[u], c = above[u + 1];
      const int d = here[u - 1], e = here[u], f = here[u + 1];
      const int g = below[u - 1], h = below[u], i = below[u + 1];
      const int x = c + 2 * f + i - a - 2 * d - g, y = g + 2 * h + i - a - 2 * b - c;
      const int detail = a + c + g + i - 2 * (b + d + f + h) + 4 * e;
      row += e;
      row_x += x;
      row_y += y;
      row_xx_yy += x * x + y * y;
      row_dd += detail * detail;
    }
    sum += row;
    sum_x += row_x;
    sum_y += row_y;
    sum_xx_yy += row_xx_yy;
    sum_dd += row_dd;
  }
  const auto n = static_cast<double>(area.area());
  const double x = static_cast<double>(sum_x) / n, y = static_cast<double>(sum_y) / n;
  const double gradient = static_cast<double>(sum_xx_yy) / n - x * x - y * y;
  return {static_cast<double>(sum) / n, 0.5 * kNoiseSobelScale * kNoiseSobelScale * gradient,
          static_cast<double>(sum_dd) / n / kDetailOfNoise};
}

}  // namespace

GradientNoise::GradientNoise(const cv::Mat& image, const cv::Mat& mask) {
  std::array<std::vector<NoiseBlock>, kLevels> blocks;
  for (int v = 1; v + kBlock_px < image.rows; v += kBlock_px) {
    for (int u = 1; u + kBlock_px < image.cols; u += kBlock_px) {
      const cv::Rect area(u, v, kBlock_px, kBlock_px);
      if (cv::countNonZero(mask(area)) < area.area()) continue;
      const NoiseBlock block = Measure(image, area);
      if (block.grey < kDarkest || block.grey > kBrightest) continue;
      if (block.detail < kLeastDetail) continue;
      if (block.gradient > kMaxGradientOverDetail * block.detail) continue;
      blocks[static_cast<int>(block.grey * kLevels / 256)].push_back(block);
    }
  }
  for (std::vector<NoiseBlock>& level : blocks) {
    if (std::ssize(level) < kMinBlocks) continue;
    const auto weak =
        level.begin() + static_cast<long>(kQuantile * static_cast<double>(level.size()));
    std::nth_element(
        level.begin(), weak, level.end(),
        [](const NoiseBlock& a, const NoiseBlock& b) { return a.gradient < b.gradient; });
    double grey = 0;
    for (auto block = level.begin(); block <= weak; ++block) grey += block->grey;
    levels_.push_back(
        {grey / static_cast<double>(weak - level.begin() + 1), weak->gradient / kQuantileOverMean});
  }
}

double GradientNoise::VarianceAt(double grey) const {
  if (levels_.empty()) return 0;
  double variance = std::numeric_limits<double>::infinity();
  for (const Level& level : levels_) {
    variance = std::min(variance, level.variance * std::max(1.0, grey / level.grey));
  }
  return variance;
}

namespace {

constexpr int kReach_px = 3;  // of the square over which gradients are summed up
constexpr int kCornerSide_px = 2 * kReach_px + 1;
constexpr int kBorder_px = 8;                       // in which no corners are looked for
constexpr float kSobelScale = 0.125f;               // to grey values a pixel
constexpr float kCornerMinEigenvalueRatio = 0.15f;  // an edge slides along itself
constexpr int kPerCell = 6;

// What is computed on the way to the responses of one row: Sobel gradients of the last rows, and
// the sums of their products over them, by column.
class GradientSums {
 public:
  explicit GradientSums(int width) : width_(width) {
    for (auto& row : x_) row.assign(width, 0);
    for (auto& row : y_) row.assign(width, 0);
    for (auto& sum : sums_) sum.assign(width, 0);
  }

  // Lets the next row in, and the oldest out. `px` is the row's leftmost pixel.
  void Add(const uchar* px, size_t stride) {
    int16_t* x = x_[next_].data();
    int16_t* y = y_[next_].data();
    int *xx = sums_[0].data(), *xy = sums_[1].data(), *yy = sums_[2].data();
    for (int u = 0; u < width_; ++u) {
      xx[u] -= x[u] * x[u];
      xy[u] -= x[u] * y[u];
      yy[u] -= y[u] * y[u];
    }
    const uchar *above = px - stride, *below = px + stride;
    for (int u = 0; u < width_; ++u) {
      const int right = above[u + 1] + 2 * px[u + 1] + below[u + 1];
      const int left = above[u - 1] + 2 * px[u - 1] + below[u - 1];
      x[u] = static_cast<int16_t>(right - left);
      y[u] = static_cast<int16_t>(below[u - 1] + 2 * below[u] + below[u + 1] - above[u - 1] -
                                  2 * above[u] - above[u + 1]);
    }
    for (int u = 0; u < width_; ++u) {
      xx[u] += x[u] * x[u];
      xy[u] += x[u] * y[u];
      yy[u] += y[u] * y[u];
    }
    next_ = (next_ + 1) % kCornerSide_px;
  }

  // The smaller eigenvalue of the mean product of the gradients (Shi and Tomasi, 1994) over the
  // square that begins in each column; 0 at edges, which have no second direction, and where it is
  // below `least`.
  void Respond(float least, int count, float* response) const {
    constexpr float kMean = kSobelScale * kSobelScale / (kCornerSide_px * kCornerSide_px);
    for (int u = 0; u < count; ++u) {
      int xx = 0, xy = 0, yy = 0;
      for (int i = u; i < u + kCornerSide_px; ++i) {
        xx += sums_[0][i];
        xy += sums_[1][i];
        yy += sums_[2][i];
      }
      const float a = kMean * static_cast<float>(xx), b = kMean * static_cast<float>(xy),
                  c = kMean * static_cast<float>(yy);
      response[u] = 0;
      // At most twice the determinant over the trace.
      if (2 * (a * c - b * b) < least * (a + c)) continue;
      const float half_trace = 0.5f * (a + c), difference = 0.5f * (a - c);
      const float root = std::sqrt(difference * difference + b * b);
      const float smaller = half_trace - root, larger = half_trace + root;
      if (smaller >= least && smaller > kCornerMinEigenvalueRatio * larger) response[u] = smaller;
    }
  }

 private:
  int width_;
  int next_ = 0;
  std::array<std::vector<int16_t>, kCornerSide_px> x_, y_;  // 8 grey values a pixel
  std::array<std::vector<int>, 3> sums_;                    // xx, xy, yy
};

// The responses in an area of the image, which has its border about it; 0 below `least`.
cv::Mat_<float> Response(const cv::Mat& image, const cv::Rect& area, float least) {
  cv::Mat_<float> response(area.size());
  GradientSums sums(area.width + 2 * kReach_px);
  for (int v = -kReach_px; v < area.height + kReach_px; ++v) {
    sums.Add(image.ptr<uchar>(area.y + v) + area.x - kReach_px, image.step);
    if (v < kReach_px) continue;
    sums.Respond(least, area.width, response.ptr<float>(v - kReach_px));
  }
  return response;
}

bool IsHighest(const cv::Mat_<float>& response, int u, int v) {
  const float here = response(v, u);
  for (int y = v - 1; y <= v + 1; ++y) {
    const float* row = response.ptr<float>(y);
    if (row[u - 1] > here || row[u] > here || row[u + 1] > here) return false;
  }
  return true;
}

int MeanAround(const cv::Mat& image, const cv::Point& px) {
  int sum = 0;
  for (int v = px.y - kReach_px; v <= px.y + kReach_px; ++v) {
    const uchar* row = image.ptr<uchar>(v) + px.x - kReach_px;
    for (int i = 0; i < kCornerSide_px; ++i) sum += row[i];
  }
  return sum / (kCornerSide_px * kCornerSide_px);
}

bool Crowded(const std::vector<Eigen::Vector2d>& others, const Eigen::Vector2d& px,
             double min_distance_px) {
  return std::any_of(others.begin(), others.end(), [&](const auto& other) {
    return (other - px).squaredNorm() < min_distance_px * min_distance_px;
  });
}

}  // namespace

CornerDetector::CornerDetector(const cv::Mat& image, const cv::Mat& mask, double cell_px,
                               const GradientNoise& noise, double min_response)
    : image_(image),
      mask_(mask),
      inner_(kBorder_px, kBorder_px, image.cols - 2 * kBorder_px, image.rows - 2 * kBorder_px),
      columns_(std::max(1, static_cast<int>(inner_.width / cell_px))),
      rows_(std::max(1, static_cast<int>(inner_.height / cell_px))),
      searched_(columns_ * rows_),
      corners_(columns_ * rows_) {
  for (int grey = 0; grey < 256; ++grey) {
    least_by_grey_.push_back(static_cast<float>(
        std::max(min_response * min_response, kMinOverNoise * noise.VarianceAt(grey))));
  }
}

std::vector<Eigen::Vector2d> CornerDetector::Find(const std::vector<Eigen::Vector2d>& occupied,
                                                  int max_count, double min_distance_px) {
  std::vector<int> in_cell(corners_.size(), 0);
  for (const auto& p : occupied) ++in_cell[CellAt(p)];
  // Cells are looked at only as far as they are needed: those with the fewest points first.
  std::vector<Eigen::Vector2d> chosen;
  std::vector<Corner> candidates;
  std::vector<bool> asked(corners_.size(), false);
  for (int most = 0; most < kPerCell && std::ssize(chosen) < max_count; ++most) {
    for (int cell = 0; cell < std::ssize(corners_); ++cell) {
      if (asked[cell] || in_cell[cell] > most) continue;
      asked[cell] = true;
      int room = kPerCell;
      for (const Corner& corner : FindCorners(cell)) {
        if (Crowded(occupied, corner.px, min_distance_px)) continue;
        candidates.push_back(corner);
        if (--room == 0) break;
      }
    }
    std::stable_sort(candidates.begin(), candidates.end(), Stronger);
    for (const Corner& corner : candidates) {
      if (std::ssize(chosen) >= max_count) break;
      if (in_cell[corner.cell] > most || Crowded(chosen, corner.px, min_distance_px)) continue;
      chosen.push_back(corner.px);
      ++in_cell[corner.cell];
    }
  }
  return chosen;
}

bool CornerDetector::Stronger(const Corner& a, const Corner& b) { return a.response > b.response; }

int CornerDetector::CellAt(const Eigen::Vector2d& px) const {
  const double c = (px.x() - inner_.x) * columns_ / inner_.width;
  const double r = (px.y() - inner_.y) * rows_ / inner_.height;
  return std::clamp(static_cast<int>(r), 0, rows_ - 1) * columns_ +
         std::clamp(static_cast<int>(c), 0, columns_ - 1);
}

cv::Rect CornerDetector::Area(int cell) const {
  const auto edge = [this](int c, int r) {
    return cv::Point(inner_.x + c * inner_.width / columns_, inner_.y + r * inner_.height / rows_);
  };
  const int c = cell % columns_, r = cell / columns_;
  return {edge(c, r), edge(c + 1, r + 1)};
}

// The local maxima of the corner response in one cell.
const std::vector<CornerDetector::Corner>& CornerDetector::FindCorners(int cell) {
  std::vector<Corner>& corners = corners_[cell];
  if (searched_[cell]) return corners;
  searched_[cell] = true;
  const cv::Rect area = Area(cell);
  const cv::Rect padded(area.x - 1, area.y - 1, area.width + 2, area.height + 2);
  const cv::Mat_<float> response = Response(image_, padded, least_by_grey_.front());
  for (int v = 1; v + 1 < padded.height; ++v) {
    for (int u = 1; u + 1 < padded.width; ++u) {
      if (response(v, u) <= 0 || !IsHighest(response, u, v)) continue;
      const cv::Point px(padded.x + u, padded.y + v);
      if (!mask_.at<uchar>(px)) continue;
      if (response(v, u) < least_by_grey_[MeanAround(image_, px)]) continue;
      corners.push_back({Eigen::Vector2d(px.x, px.y), response(v, u), cell});
    }
  }
  std::stable_sort(corners.begin(), corners.end(), Stronger);
  return corners;
}

namespace {

constexpr int kCrossingRadius_px = 5;
constexpr int kCrossingSide_px = 2 * kCrossingRadius_px + 1;
constexpr double kWeightSigma_px = 2.5;
constexpr int kMaxSteps = 6;
constexpr double kMinStep_px = 0.05;
constexpr double kCrossingMaxShift_px = 5;  // from where the corner was detected

using Eigen::Vector2d;

const std::array<double, kCrossingSide_px>& Weights() {
  static const auto weights = [] {
    std::array<double, kCrossingSide_px> w{};
    for (int i = 0; i < kCrossingSide_px; ++i) {
      const double x = (i - kCrossingRadius_px) / kWeightSigma_px;
      w[static_cast<size_t>(i)] = std::exp(-0.5 * x * x);
    }
    return w;
  }();
  return weights;
}

// From the pixel (u, v), which is as far from the border as the sums reach.
Vector2d CrossingAbout(const cv::Mat& image, int u, int v) {
  double xx = 0, xy = 0, yy = 0;
  Vector2d sum = Vector2d::Zero();
  for (int y = -kCrossingRadius_px; y <= kCrossingRadius_px; ++y) {
    const uchar* row = image.ptr<uchar>(v + y) + u;
    const uchar *above = image.ptr<uchar>(v + y - 1) + u, *below = image.ptr<uchar>(v + y + 1) + u;
    const double weight_y = Weights()[static_cast<size_t>(y + kCrossingRadius_px)];
    for (int x = -kCrossingRadius_px; x <= kCrossingRadius_px; ++x) {
      const double weight = weight_y * Weights()[static_cast<size_t>(x + kCrossingRadius_px)];
      const double gx = row[x + 1] - row[x - 1], gy = below[x] - above[x];
      const double along = weight * (gx * x + gy * y);
      xx += weight * gx * gx;
      xy += weight * gx * gy;
      yy += weight * gy * gy;
      sum += along * Vector2d(gx, gy);
    }
  }
  Eigen::Matrix2d normal;
  normal << xx, xy, xy, yy;
  return Vector2d(u, v) + normal.inverse() * sum;
}

}  // namespace

Eigen::Vector2d EdgeCrossing(const cv::Mat& image, const Vector2d& px) {
  constexpr int kMargin_px = kCrossingRadius_px + 1;
  Vector2d at = px;
  for (int i = 0; i < kMaxSteps; ++i) {
    const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
    if (u < kMargin_px || v < kMargin_px || u + kMargin_px >= image.cols ||
        v + kMargin_px >= image.rows) {
      return px;
    }
    const Vector2d next = CrossingAbout(image, u, v);
    if (!((next - px).norm() <= kCrossingMaxShift_px)) return px;  // nor where no edges cross: NaN
    const double step_px = (next - at).norm();
    at = next;
    if (step_px < kMinStep_px) break;
  }
  return at;
}

}  // namespace slcmap::odometry
