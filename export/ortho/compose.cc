#include "export/ortho/compose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFade_m = 0.15;     // sigma of the fade of low frequencies
constexpr double kSharpFade_px = 2;  // sigma of that of high ones, in pixels of the face
constexpr double kLowBand_m = 0.04;  // sigma that parts them
constexpr double kLeastWeight = 1e-3;
constexpr double kLeastIsland_m2 = 0.02;
constexpr double kFlatSigma = 0.02;  // of log brightness in cells that two photos see
constexpr double kGainSigma = 0.3;   // of log exposures

// A photo on its way to a face.
struct UsedPhoto {
  const Photo* photo = nullptr;
  RawPhoto raw;
  cv::Mat quality, label;  // by cell; the label is 1 where the photo is to be seen (CV_32FC1)
  double log_gain = 0;

  std::optional<Vector2d> ProjectToRaw(const Vector3d& p_world) const {
    return raw.camera.Project(raw.R_raw_rectified * (photo->T_camera_world * p_world));
  }
};

// Where photos are finer than the face, details that it cannot hold would alias.
void Soften(const OrthoFace& face, UsedPhoto* used) {
  const cv::Rect cells = cv::boundingRect(used->label > 0.5f);
  const Vector3d middle = face.canvas.At(face.box.center());
  const double distance_m =
      cells.empty()
          ? 1
          : std::max(0.3, std::abs(face.plane->normal.dot(used->photo->Centre() - middle)));
  const double times = used->raw.camera.MiddleFocal_px() / distance_m * face.pixel_m;
  if (times < 1.5) return;
  const double sigma_px = 0.5 * std::sqrt(times * times - 1);
  cv::GaussianBlur(used->raw.image, used->raw.image, {}, sigma_px);
}

std::vector<UsedPhoto> ReadPhotos(const OrthoFace& face, const PhotoChoice& choice,
                                  const std::vector<Photo>& photos,
                                  const std::function<RawPhoto(const Photo&)>& read) {
  std::vector<UsedPhoto> used;
  for (std::size_t i = 0; i < choice.photos.size(); ++i) {
    const cv::Mat is_shown = choice.labels == static_cast<int>(i);
    if (cv::countNonZero(is_shown) == 0) continue;
    UsedPhoto next;
    next.photo = &photos[choice.photos[i].photo];
    next.raw = read(*next.photo);
    if (next.raw.image.empty()) continue;
    next.quality = choice.photos[i].quality;
    is_shown.convertTo(next.label, CV_32FC1, 1 / 255.0);
    Soften(face, &next);
    used.push_back(std::move(next));
  }
  return used;
}

// The logarithm of brightness in each cell that a photo sees; NaN in others.
cv::Mat LogBrightness(const OrthoFace& face, const FaceCells& cells, const UsedPhoto& used) {
  constexpr double kDark = 8;  // grey values below are noise
  cv::Mat smooth, values(cells.size, CV_32FC1, cv::Scalar(NAN));
  cv::blur(used.raw.image, smooth, {9, 9});
  const double middle_px = 0.5 * (cells.step_px - 1);
  for (int row = 0; row < values.rows; ++row) {
    for (int column = 0; column < values.cols; ++column) {
      if (used.quality.at<float>(row, column) <= 0) continue;
      const auto px = used.ProjectToRaw(
          face.At(column * cells.step_px + middle_px, row * cells.step_px + middle_px));
      if (!px || !used.raw.camera.Contains(*px, 1)) continue;
      const double grey = smooth.at<uint8_t>(static_cast<int>(std::lround(px->y())),
                                             static_cast<int>(std::lround(px->x())));
      if (grey > kDark) values.at<float>(row, column) = static_cast<float>(std::log(grey));
    }
  }
  return values;
}

// Sum of differences, and number, over cells that both saw.
std::pair<double, int> Compare(const cv::Mat& a, const cv::Mat& b) {
  const cv::Mat difference = a - b;
  const cv::Mat is_known = difference == difference;
  return {cv::mean(difference, is_known)[0] * cv::countNonZero(is_known),
          cv::countNonZero(is_known)};
}

// Least squares over all pairs of photos, each gain held near 1.
void LevelBrightness(const OrthoFace& face, const FaceCells& cells, std::vector<UsedPhoto>* used) {
  const auto count = static_cast<Eigen::Index>(used->size());
  std::vector<cv::Mat> values;
  for (const UsedPhoto& each : *used) values.push_back(LogBrightness(face, cells, each));
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(count, count) / (kGainSigma * kGainSigma);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const auto [sum, cells_of_both] =
          Compare(values[static_cast<std::size_t>(i)], values[static_cast<std::size_t>(j)]);
      const double weight = 1 / (kFlatSigma * kFlatSigma);
      A(i, i) += weight * cells_of_both;
      A(j, j) += weight * cells_of_both;
      A(i, j) -= weight * cells_of_both;
      A(j, i) -= weight * cells_of_both;
      b(i) -= weight * sum;
      b(j) += weight * sum;
    }
  }
  const Eigen::VectorXd log_gains = A.ldlt().solve(b);
  for (Eigen::Index i = 0; i < count; ++i)
    (*used)[static_cast<std::size_t>(i)].log_gain = log_gains(i);
}

// The pixels that a photo may add to: about its cells, as far as it fades.
cv::Rect FindPart(const OrthoFace& face, const FaceCells& cells, const UsedPhoto& used) {
  const cv::Rect shown = cv::boundingRect(used.label > 0.5f);
  const int step = cells.step_px;
  const int pad = static_cast<int>(3 * kFade_m / face.pixel_m);
  const cv::Rect part(shown.x * step - pad, shown.y * step - pad, shown.width * step + 2 * pad,
                      shown.height * step + 2 * pad);
  return part & cv::Rect({0, 0}, face.size);
}

// Values of cells at the pixels of a part of the face.
cv::Mat AtPixels(const cv::Mat& of_cells, const FaceCells& cells, const cv::Rect& part) {
  const double scale = 1.0 / cells.step_px;
  const cv::Matx23d to_cells(scale, 0, (part.x + 0.5) * scale - 0.5, 0, scale,
                             (part.y + 0.5) * scale - 0.5);
  cv::Mat values;
  cv::warpAffine(of_cells, values, to_cells, part.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return values;
}

// A photo as seen straight on, and 1 where it sees the face.
struct FlatPhoto {
  cv::Mat grey, seen;  // CV_32FC1
};

FlatPhoto Flatten(const OrthoFace& face, const FaceCells& cells, const UsedPhoto& used,
                  const cv::Rect& part) {
  cv::Mat places(part.size(), CV_32FC2, cv::Scalar(-1, -1));
  FlatPhoto flat;
  flat.seen = cv::Mat(part.size(), CV_32FC1, cv::Scalar(0));
  const cv::Mat quality = AtPixels(used.quality, cells, part);
  for (int row = 0; row < part.height; ++row) {
    for (int column = 0; column < part.width; ++column) {
      if (quality.at<float>(row, column) <= 0) continue;
      const auto px = used.ProjectToRaw(face.At(part.x + column, part.y + row));
      if (!px || !used.raw.camera.Contains(*px, 1)) continue;
      places.at<cv::Vec2f>(row, column) = {static_cast<float>(px->x()),
                                           static_cast<float>(px->y())};
      flat.seen.at<float>(row, column) = 1;
    }
  }
  cv::Mat grey;
  cv::remap(used.raw.image, grey, places, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  grey.convertTo(flat.grey, CV_32FC1, std::exp(used.log_gain));
  return flat;
}

// What is smooth of a photo, of that which it sees alone.
cv::Mat LowBand(const FlatPhoto& flat, double sigma_px) {
  cv::Mat sum, weight;
  cv::GaussianBlur(flat.grey.mul(flat.seen), sum, {}, sigma_px);
  cv::GaussianBlur(flat.seen, weight, {}, sigma_px);
  return sum / cv::max(weight, kLeastWeight);
}

// Weighted means of two bands.
class Bands {
 public:
  explicit Bands(const cv::Size& size) {
    for (cv::Mat& sum : sums_) sum = cv::Mat(size, CV_32FC1, cv::Scalar(0));
  }

  void Add(const OrthoFace& face, const FaceCells& cells, const UsedPhoto& used) {
    const cv::Rect part = FindPart(face, cells, used);
    const FlatPhoto flat = Flatten(face, cells, used, part);
    const cv::Mat low = LowBand(flat, kLowBand_m / face.pixel_m);
    cv::Mat wide, narrow;
    cv::GaussianBlur(used.label, wide, {}, kFade_m / (cells.step_px * face.pixel_m));
    wide = AtPixels(wide, cells, part).mul(flat.seen);
    cv::Mat(AtPixels(used.label, cells, part) > 0.5f).convertTo(narrow, CV_32FC1, 1 / 255.0);
    cv::GaussianBlur(narrow, narrow, {}, kSharpFade_px);
    narrow = narrow.mul(flat.seen);
    sums_[0](part) += wide.mul(low);
    sums_[1](part) += wide;
    sums_[2](part) += narrow.mul(flat.grey - low);
    sums_[3](part) += narrow;
  }

  cv::Mat Grey() const {
    cv::Mat grey;
    cv::Mat(sums_[0] / cv::max(sums_[1], kLeastWeight) + sums_[2] / cv::max(sums_[3], kLeastWeight))
        .convertTo(grey, CV_8UC1);
    return grey;
  }
  cv::Mat Seen() const { return sums_[3] > 0.2f; }

 private:
  std::array<cv::Mat, 4> sums_;
};

// Small islands of what was seen are gaps between things that hide the face.
void RemoveIslands(double least_px, cv::Mat* alpha) {
  cv::Mat islands, stats, middles;
  const int count = cv::connectedComponentsWithStats(*alpha, islands, stats, middles);
  for (int i = 1; i < count; ++i) {
    const int* of_island = stats.ptr<int>(i);
    if (of_island[cv::CC_STAT_AREA] >= least_px) continue;
    const cv::Rect box(of_island[cv::CC_STAT_LEFT], of_island[cv::CC_STAT_TOP],
                       of_island[cv::CC_STAT_WIDTH], of_island[cv::CC_STAT_HEIGHT]);
    (*alpha)(box).setTo(0, islands(box) == i);
  }
}

}  // namespace

Orthophoto Compose(const OrthoFace& face, const cv::Mat& mask, const PhotoChoice& choice,
                   const std::vector<Photo>& photos,
                   const std::function<RawPhoto(const Photo&)>& read) {
  std::vector<UsedPhoto> used = ReadPhotos(face, choice, photos, read);
  LevelBrightness(face, choice.cells, &used);
  Bands bands(face.size);
  for (const UsedPhoto& each : used) bands.Add(face, choice.cells, each);
  Orthophoto ortho;
  ortho.photos = used.size();
  ortho.alpha = bands.Seen() & mask;
  RemoveIslands(kLeastIsland_m2 / (face.pixel_m * face.pixel_m), &ortho.alpha);
  ortho.grey = bands.Grey();
  ortho.grey.setTo(0, ~ortho.alpha);
  ortho.seen_share = cv::countNonZero(ortho.alpha) / std::max(1.0, 1.0 * cv::countNonZero(mask));
  return ortho;
}

}  // namespace slcmap::exporting
