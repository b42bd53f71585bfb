// The faces of a building that orthophotos are made of, as rasters.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "export/scene/plane_canvas.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// A plane and the pixels on it, from the upper left one, seen from its front.
struct OrthoFace {
  const BuildingPlane* plane = nullptr;
  std::string name;                     // of its files
  std::optional<int64_t> wall_id = {};  // that it is a face of
  Canvas canvas;
  Eigen::AlignedBox2d box;  // of the image, on the canvas
  std::vector<Polygon> area;
  double pixel_m = 0;
  cv::Size size;

  // The place of a pixel, whose centre is a whole number, in world.
  Eigen::Vector3d At(double column, double row) const {
    return canvas.At(
        {box.min().x() + (column + 0.5) * pixel_m, box.max().y() - (row + 0.5) * pixel_m});
  }
};

// The faces of walls by wall and letter (wall_W3_a is that which its plan is drawn by, others are
// behind it), other walls, floors and ceilings by plane (floor_P0); without those that nobody saw.
// A pixel is 5 mm, of faces that take too many a multiple of that.
std::vector<OrthoFace> ListFaces(const Building& building);

// 255 where a pixel is on the face. Openings are a little smaller, so that their edges are seen.
cv::Mat MakeMask(const OrthoFace& face, const Building& building);

}  // namespace slcmap::exporting
