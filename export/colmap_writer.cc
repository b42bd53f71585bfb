#include "export/colmap_writer.h"

#include <spdlog/fmt/fmt.h>

#include <iterator>
#include <utility>

#include "data/error.h"
#include "data/file.h"
#include "export/model_images.h"
#include "export/model_points.h"
#include "export/rectified_images.h"
#include "export/world_offset.h"

namespace slcmap {
namespace {

std::string CamerasText(const Rig& rig) {
  std::string text = "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy, of rectified images\n";
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    if (!IsCalibrated(camera)) continue;
    text += fmt::format("{} PINHOLE {} {} {:.9f} {:.9f} {:.9f} {:.9f}\n", i + 1, camera.width_px,
                        camera.height_px, camera.fx_px, camera.fy_px,
                        camera.cx_px + kCornerOrigin_px, camera.cy_px + kCornerOrigin_px);
  }
  return text;
}

// A point in an image, and in a point's track: which image, and which of the points there.
struct PointInImage {
  Eigen::Vector2d px;
  std::size_t point;
};

std::vector<std::vector<PointInImage>> PointsInImages(const std::vector<ModelPoint>& points,
                                                      std::size_t images) {
  std::vector<std::vector<PointInImage>> seen(images);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const ModelSight& sight : points[i].track) seen[sight.image].push_back({sight.px, i});
  }
  return seen;
}

// Two rows an image: its pose, world to camera, and the points that it shows.
std::string ImagesText(const std::vector<ModelImage>& images, const std::vector<ModelPoint>& points) {
  const auto seen = PointsInImages(points, images.size());
  std::string text = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# X Y POINT3D_ID ...\n";
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ModelImage& image = images[i];
    const Eigen::Quaterniond& q = image.T_camera_world.rotation;
    const Eigen::Vector3d& t = image.T_camera_world.translation;
    fmt::format_to(out, "{} {:.12f} {:.12f} {:.12f} {:.12f} {:.9f} {:.9f} {:.9f} {} {}\n", image.id,
                   q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), image.camera + 1, image.name);
    const char* blank = "";
    for (const auto& [px, point] : seen[i]) {
      fmt::format_to(out, "{}{:.3f} {:.3f} {}", std::exchange(blank, " "),
                     px.x() + kCornerOrigin_px, px.y() + kCornerOrigin_px, point + 1);
    }
    text += "\n";
  }
  return text;
}

// Sights come in the order of points, as the points of each image do.
std::string PointsText(const std::vector<ModelPoint>& points, const std::vector<ModelImage>& images) {
  std::vector<int> counts(images.size(), 0);  // of the points in each image so far
  std::string text = "# POINT3D_ID X Y Z R G B ERROR TRACK (IMAGE_ID POINT2D_IDX ...)\n";
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& p = points[i].p_world;
    fmt::format_to(out, "{} {:.6f} {:.6f} {:.6f} 128 128 128 ", i + 1, p.x(), p.y(), p.z());
    if (points[i].track.empty()) {
      text += "-1\n";
      continue;
    }
    fmt::format_to(out, "{:.4f}", points[i].error_px);
    for (const ModelSight& sight : points[i].track) {
      fmt::format_to(out, " {} {}", images[sight.image].id, counts[sight.image]++);
    }
    text += "\n";
  }
  return text;
}

}  // namespace

void ColmapOptions::Check() const {
  if (images.empty() || images == "rectified") return;
  throw ConfigError(fmt::format("colmap images: found '{}', expected 'rectified'", images));
}

std::vector<std::string> ColmapWriter::Write(const std::string& folder, const MapResult& map,
                                             const Progress& progress) const {
  const std::string model = folder + "/colmap";
  MakeFolder(model);
  WriteFile(model + "/cameras.txt", CamerasText(map.rectified_rig));
  const std::vector<ModelImage> images = ModelImages(map);
  const std::vector<ModelPoint> points = ModelPoints(map, images);
  progress.ReportOrStop(0.5);
  const std::string offset = WorldOffsetNote(map.source.world_offset_m);
  WriteFile(model + "/images.txt",
            (offset.empty() ? "" : "# " + offset + "\n") + ImagesText(images, points));
  WriteFile(model + "/points3D.txt", PointsText(points, images));
  std::vector<std::string> paths = {model + "/cameras.txt", model + "/images.txt",
                                    model + "/points3D.txt"};
  if (!options_.images.empty()) {
    const std::vector<std::string> written =
        WriteRectifiedImages(model + "/images", map, images, options_, progress.Part(0.6, 1));
    paths.insert(paths.end(), written.begin(), written.end());
  }
  progress.ReportOrStop(1);
  return paths;
}

}  // namespace slcmap
