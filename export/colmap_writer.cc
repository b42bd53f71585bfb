#include "export/colmap_writer.h"

#include <spdlog/fmt/fmt.h>

#include "data/file.h"
#include "export/model_images.h"

namespace slcmap {
namespace {

std::string CamerasOf(const Rig& rig) {
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

// Two rows an image: its pose, world to camera, and its points, none.
std::string ImagesOf(const MapResult& map) {
  std::string text = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n";
  for (const ModelImage& image : ModelImages(map)) {
    const Eigen::Quaterniond& q = image.T_camera_world.rotation;
    const Eigen::Vector3d& t = image.T_camera_world.translation;
    text +=
        fmt::format("{} {:.12f} {:.12f} {:.12f} {:.12f} {:.9f} {:.9f} {:.9f} {} {}\n\n", image.id,
                    q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), image.camera + 1, image.name);
  }
  return text;
}

std::string PointsOf(const std::vector<MapPoint>& points) {
  std::string text = "# POINT3D_ID X Y Z R G B ERROR\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& p = points[i].p_world;
    text += fmt::format("{} {:.6f} {:.6f} {:.6f} 128 128 128 -1\n", i + 1, p.x(), p.y(), p.z());
  }
  return text;
}

}  // namespace

std::vector<std::string> ColmapWriter::Write(const std::string& folder, const MapResult& map,
                                             const Progress& progress) const {
  const std::string model = folder + "/colmap";
  MakeFolder(model);
  WriteFile(model + "/cameras.txt", CamerasOf(map.rectified_rig));
  WriteFile(model + "/images.txt", ImagesOf(map));
  progress.ReportOrStop(0.3);
  WriteFile(model + "/points3D.txt", PointsOf(map.points));
  progress.ReportOrStop(1);
  return {model + "/cameras.txt", model + "/images.txt", model + "/points3D.txt"};
}

}  // namespace slcmap
