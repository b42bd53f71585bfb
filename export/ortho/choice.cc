#include "export/ortho/choice.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <queue>
#include <utility>

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCell_m = 0.05;
constexpr double kMostFaceCells = 60000;  // of a face
constexpr double kMostDistance_m = 8;
constexpr double kLeastCosine = 0.17;    // 80 degrees from straight on
constexpr double kHides_m = 0.08;        // what stands farther before the face hides it
constexpr double kSeenThrough_m = 0.25;  // what is farther behind shows that there is no surface
constexpr double kBorder_px = 12;        // of images, that is not used
constexpr double kExposure_s = 0.005;    // of an image indoors
constexpr double kBetter = 1.25;         // that a photo has to be, to take a cell from another
constexpr double kLeastGain = 0.002;     // of all photos' quality, that is worth another photo
constexpr std::size_t kMostPhotos = 120;

FaceCells MakeCells(const OrthoFace& face) {
  const double area_m2 = face.box.volume();
  const double cell_m = std::max(kCell_m, std::sqrt(area_m2 / kMostFaceCells));
  FaceCells cells;
  cells.step_px = std::max(1, static_cast<int>(std::lround(cell_m / face.pixel_m)));
  cells.size = {(face.size.width + cells.step_px - 1) / cells.step_px,
                (face.size.height + cells.step_px - 1) / cells.step_px};
  return cells;
}

// The part of a face that a photo may see, judged cell by cell.
class PhotoJudge {
 public:
  PhotoJudge(const OrthoFace& face, const Photo& photo, const Camera& rectified)
      : face_(face), photo_(photo), camera_(rectified), centre_(photo.Centre()) {}

  bool IsBefore() const {
    const double height_m = face_.plane->normal.dot(centre_) - face_.plane->offset_m;
    if (height_m < kHides_m || height_m > kMostDistance_m) return false;
    return face_.box.exteriorDistance(face_.canvas.Of(centre_)) < kMostDistance_m;
  }

  float QualityAt(const Vector3d& p) const {
    const Vector3d way = centre_ - p;
    const double distance_m = way.norm();
    const double cosine = way.dot(face_.plane->normal) / distance_m;
    if (distance_m > kMostDistance_m || cosine < kLeastCosine) return 0;
    const auto pixel_px = camera_.Project(photo_.T_camera_world * p);
    if (!pixel_px || !camera_.Contains(*pixel_px, kBorder_px)) return 0;
    const double height_m = HeightBefore(*face_.plane, photo_, camera_, *pixel_px);
    if (height_m > kHides_m || height_m < -kSeenThrough_m) return 0;
    const double fine_px_m = camera_.fx_px / distance_m * cosine;
    const double blur_px =
        camera_.fx_px * kExposure_s * (photo_.speed_m_s / distance_m + photo_.turn_rad_s);
    const double sharp_px_m = fine_px_m / std::sqrt(1 + blur_px * blur_px);
    return static_cast<float>(sharp_px_m / (sharp_px_m + 1 / face_.pixel_m));
  }

 private:
  const OrthoFace& face_;
  const Photo& photo_;
  const Camera& camera_;
  const Vector3d centre_;
};

cv::Mat JudgePhoto(const OrthoFace& face, const FaceCells& cells, const Photo& photo,
                   const Camera& rectified) {
  const PhotoJudge judge(face, photo, rectified);
  if (!judge.IsBefore()) return {};
  cv::Mat quality(cells.size, CV_32FC1);
  const double middle_px = 0.5 * (cells.step_px - 1);
  for (int row = 0; row < quality.rows; ++row) {
    for (int column = 0; column < quality.cols; ++column) {
      quality.at<float>(row, column) = judge.QualityAt(
          face.At(column * cells.step_px + middle_px, row * cells.step_px + middle_px));
    }
  }
  return cv::countNonZero(quality) > 0 ? quality : cv::Mat();
}

// What a photo adds to what is there, over all cells.
double Gain(const cv::Mat& quality, const cv::Mat& best) {
  return cv::sum(cv::max(quality - best, 0))[0];
}

// The photos that add most, one after the other. What one adds never grows, so that only those that
// seemed to add most have to be looked at again.
std::vector<ChosenPhoto> TakeBest(const std::vector<ChosenPhoto>& seen, const cv::Size& size) {
  cv::Mat best(size, CV_32FC1, cv::Scalar(0)), all = best.clone();
  std::priority_queue<std::pair<double, std::ptrdiff_t>> queue;  // of equal ones the first
  for (std::size_t i = 0; i < seen.size(); ++i) {
    cv::max(all, seen[i].quality, all);
    queue.emplace(Gain(seen[i].quality, best), -static_cast<std::ptrdiff_t>(i));
  }
  const double enough = kLeastGain * cv::sum(all)[0];
  std::vector<ChosenPhoto> chosen;
  while (!queue.empty() && chosen.size() < kMostPhotos) {
    const std::ptrdiff_t i = queue.top().second;
    queue.pop();
    const ChosenPhoto& photo = seen[static_cast<std::size_t>(-i)];
    const double gain = Gain(photo.quality, kBetter * best);
    if (!queue.empty() && gain < queue.top().first) {
      if (gain > enough) queue.emplace(gain, i);
      continue;
    }
    if (gain <= enough) break;
    chosen.push_back(photo);
    cv::max(best, photo.quality, best);
  }
  return chosen;
}

cv::Mat LabelCells(const std::vector<ChosenPhoto>& photos, const cv::Size& size) {
  cv::Mat labels(size, CV_32SC1, cv::Scalar(-1)), best(size, CV_32FC1, cv::Scalar(0));
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const cv::Mat is_better = photos[i].quality > kBetter * best;
    labels.setTo(static_cast<int>(i), is_better);
    photos[i].quality.copyTo(best, is_better);
  }
  return labels;
}

}  // namespace

PhotoChoice ChoosePhotos(const OrthoFace& face, const std::vector<Photo>& photos,
                         const Camera& rectified) {
  PhotoChoice choice;
  choice.cells = MakeCells(face);
  std::vector<ChosenPhoto> seen;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const cv::Mat quality = JudgePhoto(face, choice.cells, photos[i], rectified);
    if (!quality.empty()) seen.push_back({i, quality});
  }
  choice.photos = TakeBest(seen, choice.cells.size);
  choice.labels = LabelCells(choice.photos, choice.cells.size);
  return choice;
}

}  // namespace slcmap::exporting
