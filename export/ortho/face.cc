#include "export/ortho/face.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPixel_m = 0.005;  // what a camera of VGA sees from 2 m
// Of a face: more than viewers open.
constexpr int kMostSide_px = 8192;
constexpr double kMostPixels = 16e6;
constexpr double kLeastFace_m = 0.2;
constexpr double kEdge_m = 0.03;  // of openings that is shown

Eigen::AlignedBox2d ComputeBox(const std::vector<Polygon>& area) {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : area) {
    for (const Vector2d& p : polygon.outline) box.extend(p);
  }
  return box;
}

void SetRaster(const Eigen::AlignedBox2d& box, OrthoFace* face) {
  const Vector2d sides_m = box.sizes();
  double times = 1;
  while (sides_m.maxCoeff() / (times * kPixel_m) > kMostSide_px ||
         sides_m.prod() / std::pow(times * kPixel_m, 2) > kMostPixels) {
    times *= 2;
  }
  face->pixel_m = times * kPixel_m;
  const Vector2d low = (box.min() / face->pixel_m).array().floor() * face->pixel_m;
  const Vector2d high = (box.max() / face->pixel_m).array().ceil() * face->pixel_m;
  face->box = {low, high};
  face->size = {static_cast<int>(std::lround((high - low).x() / face->pixel_m)),
                static_cast<int>(std::lround((high - low).y() / face->pixel_m))};
}

struct WallFace {
  int64_t wall_id = 0;
  std::string letters;
};

// By plane. Letters are those of a wall's planes in their order, those that nobody saw too.
std::map<int64_t, WallFace> FacesOfWalls(const Building& building) {
  std::map<int64_t, WallFace> faces;
  for (const PlanWall& wall : building.walls) {
    for (std::size_t i = 0; i < wall.plane_ids.size(); ++i) {
      const std::string letters = i < 26 ? std::string(1, static_cast<char>('a' + i))
                                         : fmt::format("p{}", wall.plane_ids[i]);
      faces.try_emplace(wall.plane_ids[i], WallFace{wall.id, letters});
    }
  }
  return faces;
}

std::string MakeFaceName(const BuildingPlane& plane, const std::map<int64_t, WallFace>& of_walls) {
  const auto wall = of_walls.find(plane.id);
  if (wall == of_walls.end()) return fmt::format("{}_P{}", GetName(plane.kind), plane.id);
  return fmt::format("wall_W{}_{}", wall->second.wall_id, wall->second.letters);
}

// Towards its middle.
BuildingPlane WithSmallerOpenings(BuildingPlane plane, const Canvas& canvas) {
  for (PlaneOpening& opening : plane.openings) {
    Vector2d middle = Vector2d::Zero();
    for (const Vector3d& p : opening.outline_world) middle += canvas.Of(p);
    middle /= static_cast<double>(opening.outline_world.size());
    for (Vector3d& p : opening.outline_world) {
      const Eigen::Array2d off = (canvas.Of(p) - middle).array();
      const Vector2d smaller = off.sign() * (off.abs() - kEdge_m).max(0);
      p = canvas.At(middle + smaller);
    }
  }
  return plane;
}

std::vector<cv::Point> ToPixels(const PlanPoints& ring, const OrthoFace& face) {
  std::vector<cv::Point> pixels;
  for (const Vector2d& p : ring) {
    pixels.emplace_back(static_cast<int>(std::floor((p.x() - face.box.min().x()) / face.pixel_m)),
                        static_cast<int>(std::floor((face.box.max().y() - p.y()) / face.pixel_m)));
  }
  return pixels;
}

}  // namespace

std::vector<OrthoFace> ListFaces(const Building& building) {
  const std::map<int64_t, WallFace> of_walls = FacesOfWalls(building);
  std::vector<OrthoFace> faces;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.inferred || plane.kind == PlaneKind::kOther) continue;
    OrthoFace face;
    face.plane = &plane;
    face.name = MakeFaceName(plane, of_walls);
    if (const auto wall = of_walls.find(plane.id); wall != of_walls.end()) {
      face.wall_id = wall->second.wall_id;
    }
    face.canvas = MakeFront(plane);
    face.area = AreaOn(face.canvas, plane, building);
    const Eigen::AlignedBox2d box = ComputeBox(face.area);
    if (box.isEmpty() || box.sizes().minCoeff() < kLeastFace_m) continue;
    SetRaster(box, &face);
    faces.push_back(std::move(face));
  }
  return faces;
}

cv::Mat MakeMask(const OrthoFace& face, const Building& building) {
  cv::Mat mask(face.size, CV_8UC1, cv::Scalar(0));
  const BuildingPlane plane = WithSmallerOpenings(*face.plane, face.canvas);
  for (const Polygon& polygon : AreaOn(face.canvas, plane, building)) {
    std::vector<std::vector<cv::Point>> rings = {ToPixels(polygon.outline, face)};
    for (const PlanPoints& hole : polygon.holes) rings.push_back(ToPixels(hole, face));
    cv::fillPoly(mask, rings, cv::Scalar(255));
  }
  return mask;
}

}  // namespace slcmap::exporting
