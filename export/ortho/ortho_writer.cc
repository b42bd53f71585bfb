#include "export/ortho/ortho_writer.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "data/core/parallel.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "export/ortho/compose.h"
#include "export/sfm/model.h"

namespace slcmap::inline exporting {
namespace {

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

// Pixel size, turns and the centre of the upper left pixel, on the face's canvas, in metres.
std::string WorldFile(const OrthoFace& face) {
  const double pixel_m = face.pixel_m;
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
  WriteFile(path + ".pgw", WorldFile(face));
  return {{path + ".png", path + ".pgw"}, FaceJson(face, ortho), MakeTexture(face, ortho)};
}

}  // namespace

std::vector<std::string> OrthoWriter::Write(const std::string& folder, const MapResult& map,
                                            const Progress& progress) const {
  const std::string own = folder + "/ortho";
  MakeFolder(own);
  const std::vector<OrthoFace> faces = ListFaces(map.building);
  if (faces.empty()) spdlog::warn("ortho: no wall or floor was found in this map");
  const RecordedImages images(map, recording_);
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
    if (textures_) textures_->push_back(std::move(face.texture));
  }
  WriteJsonFile(paths[0], json);
  return paths;
}

}  // namespace slcmap::exporting
