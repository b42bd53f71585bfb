#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "data/core/parallel.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "export/ortho/photos.h"
#include "export/scene/formats.h"
#include "export/sfm/model.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// An orthophoto of a face out of the photos that were chosen.

// An image as it was taken, and its camera: turned against the rectified one, from the same place.
struct RawPhoto {
  cv::Mat image;  // empty: it cannot be read
  Camera camera;
  Eigen::Quaterniond R_raw_rectified;
};

struct Orthophoto {
  cv::Mat grey;            // 8 bit
  cv::Mat alpha;           // 255 where some image saw the face
  double seen_share = 0;   // of the face's pixels
  std::size_t photos = 0;  // that it is made of
};

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

// Brightness is levelled between photos that see the same cells. Where photos meet, low frequencies
// fade over tens of centimetres and high ones over centimetres, so that neither steps nor doubled
// edges are seen (multi-band blending with two bands, after Burt and Adelson 1983). `mask` as
// MakeMask() has it. read(i) is asked for photos of the choice.
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

constexpr char kListFormat[] = "slcmap orthophotos";
constexpr int kListVersion = 1;
constexpr double kLeastShare = 0.01;       // of a face, that is worth a file
constexpr int kMostTextureSide_px = 2048;  // what all graphics cards take

std::string EncodePng(const cv::Mat& grey, const cv::Mat& alpha) {
  cv::Mat image;
  cv::merge(std::vector<cv::Mat>{grey, grey, grey, alpha}, image);
  std::vector<uint8_t> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

// Pixel size, turns and the centre of the upper left pixel, in metres: on the face's canvas, or of
// a level face in the grid that the map lies in.
std::string WorldFile(const OrthoFace& face, const std::optional<Georeference>& place) {
  constexpr double kLevelCosine = 0.99;
  const double pixel_m = face.pixel_m;
  if (place && std::abs(face.plane->normal.z()) > kLevelCosine) {
    const Eigen::Vector3d first = *place * face.At(0, 0);
    const Eigen::Vector3d right = *place * face.At(1, 0) - first,
                          down = *place * face.At(0, 1) - first;
    return fmt::format("{:.9f}\n{:.9f}\n{:.9f}\n{:.9f}\n{:.6f}\n{:.6f}\n", right.x(), right.y(),
                       down.x(), down.y(), first.x(), first.y());
  }
  return fmt::format("{:.6f}\n0\n0\n{:.6f}\n{:.6f}\n{:.6f}\n", pixel_m, -pixel_m,
                     face.box.min().x() + 0.5 * pixel_m, face.box.max().y() - 0.5 * pixel_m);
}

Json FaceJson(const OrthoFace& face, const Orthophoto& ortho) {
  const BuildingPlane& plane = *face.plane;
  const double left = -0.5, right = face.size.width - 0.5, low = face.size.height - 0.5;
  Json json = {{"file", face.name + ".png"}, {"kind", GetName(plane.kind)}};
  if (face.wall_id) json["wall"] = *face.wall_id;
  json.update({{"plane", plane.id},
               {"storey", plane.storey},
               {"room_ids", plane.room_ids},
               {"pixel_m", RoundedForJson(face.pixel_m)},
               {"width_px", face.size.width},
               {"height_px", face.size.height},
               {"normal", {plane.normal.x(), plane.normal.y(), plane.normal.z()}},
               {"offset_m", RoundedForJson(plane.offset_m)},
               {"sigma_m", RoundedForJson(plane.sigma_m)},
               {"corners_m",
                PointsJson(std::vector<Eigen::Vector3d>{face.At(left, left), face.At(right, left),
                                                        face.At(right, low), face.At(left, low)})},
               {"seen_share", RoundedForJson(ortho.seen_share)},
               {"images", ortho.photos}});
  return json;
}

FaceTexture MakeTexture(const OrthoFace& face, const Orthophoto& ortho) {
  FaceTexture texture{face.name, face.plane->id, {}, face.canvas, face.box.sizes()};
  texture.canvas.origin = face.canvas.At(face.box.min());
  cv::Mat grey = ortho.grey, alpha = ortho.alpha;
  const double scale = static_cast<double>(kMostTextureSide_px) / std::max(grey.cols, grey.rows);
  if (scale < 1) {
    cv::resize(grey, grey, {}, scale, scale, cv::INTER_AREA);
    cv::resize(alpha, alpha, grey.size(), 0, 0, cv::INTER_NEAREST);
  }
  texture.png = EncodePng(grey, alpha);
  return texture;
}

// Reads a keyframe's image with the camera that took it.
class PhotoReader {
 public:
  PhotoReader(const MapResult& map, const RecordedImages& images)
      : R_imu_rectified_(map.rectified_rig.T_imu_camera[0].rotation), images_(images) {}

  RawPhoto operator()(const Photo& photo) const {
    const Rig& rig = images_.rig(photo.recording);
    ++tried_;
    RawPhoto raw{images_.Read(photo.recording, photo.stamp_ns, 0), rig.cameras[0],
                 rig.T_imu_camera[0].rotation.conjugate() * R_imu_rectified_};
    if (!raw.image.empty()) ++read_;
    return raw;
  }

  void Check() const {
    if (tried_ > 0 && read_ == 0) images_.Refuse(0, tried_);
    if (read_ < tried_)
      spdlog::warn("ortho: {} of {} images cannot be read", tried_ - read_, tried_.load());
  }

 private:
  const Eigen::Quaterniond R_imu_rectified_;
  const RecordedImages& images_;
  mutable std::atomic<std::size_t> tried_ = 0, read_ = 0;
};

// The files of a face, and what is said of it; nothing where hardly anything of it was seen.
struct WrittenFace {
  std::vector<std::string> paths;
  Json json;
  FaceTexture texture;
};

WrittenFace WriteFace(const std::string& folder, const OrthoFace& face, const MapResult& map,
                      const std::vector<Photo>& photos, const PhotoReader& reader) {
  const PhotoChoice choice = ChoosePhotos(face, photos, map.rectified_rig.cameras[0]);
  if (choice.photos.empty()) return {};
  const Orthophoto ortho =
      Compose(face, MakeMask(face, map.building), choice, photos, std::cref(reader));
  if (ortho.seen_share < kLeastShare) return {};
  const std::string path = folder + "/" + face.name;
  WriteFile(path + ".png", EncodePng(ortho.grey, ortho.alpha));
  WriteFile(path + ".pgw", WorldFile(face, map.source.georeference));
  return {{path + ".png", path + ".pgw"}, FaceJson(face, ortho), MakeTexture(face, ortho)};
}

}  // namespace

std::vector<std::string> WriteOrtho(const RecordingOptions& recording,
                                    const std::shared_ptr<std::vector<FaceTexture>>& textures,
                                    const std::string& folder, const MapResult& map,
                                    const Progress& progress) {
  const std::string own = folder + "/ortho";
  MakeFolder(own);
  const std::vector<OrthoFace> faces = ListFaces(map.building);
  if (faces.empty()) spdlog::warn("ortho: no wall or floor was found in this map");
  const RecordedImages images(map, recording);
  const std::vector<Photo> photos = TakePhotos(map, images, progress.Part(0, 0.2));
  const PhotoReader reader(map, images);
  std::vector<WrittenFace> written(faces.size());
  const auto write = [&](std::size_t i) {
    written[i] = WriteFace(own, faces[i], map, photos, reader);
  };
  if (!ForEachWatched(faces.size(), progress.Part(0.2, 1), write, 4)) {
    throw StoppedError("interrupted");
  }
  reader.Check();
  Json json = {{"format", kListFormat}, {"version", kListVersion}, {"map", map.id}};
  json["faces"] = Json::array();
  std::vector<std::string> paths = {own + "/orthophotos.json"};
  for (WrittenFace& face : written) {
    if (face.paths.empty()) continue;
    paths.insert(paths.end(), face.paths.begin(), face.paths.end());
    json["faces"].push_back(face.json);
    if (textures) textures->push_back(std::move(face.texture));
  }
  WriteJsonFile(paths[0], json);
  return paths;
}

}  // namespace slcmap::exporting
