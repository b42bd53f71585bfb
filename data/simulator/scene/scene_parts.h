// The parts of a scene as its file tells them: objects, walls with their doors and windows, and a
// storey made of the drawing of a real floor.
#pragma once

#include <Eigen/Core>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/io/yaml.h"
#include "data/simulator/scene/scene_builder.h"

namespace slcmap::inline data {

using MaterialNames = std::map<std::string, uint32_t>;  // to indices of the builder's materials

// Keys of every object: kind, at (metres), yaw_deg, tilt_deg (about x, then y), wing, and repeat
// with step (metres) for a row of them, each with the next seed. Throws ConfigError.
void ReadObject(YamlSection section, const MaterialNames& materials, int wings,
                SceneBuilder* builder);

// A door or a window in a segment of a wall. Metres, degrees.
struct WallOpening {
  int segment = 0;
  double along = 0;  // from the segment's first point to the opening's near side
  double width = 0.9, height = 2.05;
  double sill = 0;      // above the foot of the wall; a door's is 0
  double open_deg = 0;  // of a door's leaf, to the side away from the wall's front
  double radiance = 0;  // of a window's daylight
  bool is_door = true;
};

// A wall along `points`, whose front is to the left of the way from point to point.
struct WallSpec {
  std::vector<Eigen::Vector2d> points;
  bool closed = false;
  double height = 2.7;
  double thickness = 0.15;            // behind the front
  bool has_back = false;              // the back face, and ends
  double skirting_height = 0;         // 0: none
  bool is_solid = false;              // although it has no back face
  bool is_told = true;                // as faces of walls, in what is true
  bool has_leaf = true;               // in each door
  bool clear_glass = false;           // windows without daylight are seen through, and mirror
  std::vector<WallOpening> openings;  // disjoint along each segment
  uint32_t material = 0, skirting = 0, frame = 0, leaf = 0, metal = 0, glass = 0, daylight = 0;
};

// In the frame of the current placement: the foot of the wall at z = 0.
void AddWall(const WallSpec& spec, const Eigen::Isometry3d& wing_object, int wing,
             SceneBuilder* builder);

// A storey of what is dark in a drawing.

// Of a mask that is 255 where it is dark: corners in pixels from its lower left, y up, with what is
// dark to the right of the way; they run between pixels. Specks are left out.
std::vector<std::vector<Eigen::Vector2d>> TraceOutlines(const cv::Mat& mask, double pixel_m);

// Reads the section `plan` of a scene and builds it; nothing where it is empty:
//
//   plan:
//     image: floor.png            beside the scene's file; at most 200 million pixels
//     pixel_m: 0.01               origin at the bottom left corner, x right, y up
//     height: 2.9                 metres, of walls
//     walls: [white, brick]       materials, in turn, of walls that do not touch
//     floor: carpet
//     ceiling: ceiling
//     door_height: 2.1            gaps in walls of 0.6 to 2 m get a lintel and frame, ...
//     leaf_deg: [85, 0]           ... and leaves that stand open so far, in turn; 0 is closed
//     glazed_m: 0.13              walls up to so thick are glazed above their parapets; 0: none
//     daylight: 6                 radiance of the panes
//     lamps_m: 3                  from ceiling lamp to ceiling lamp
//     lamp_radiance: 16
//     furniture: 0.5              share of the length of walls that something stands before
//     keep_clear: walk.tum        of furniture and closed leaves: within 0.7 m of these poses
//     seed: 1
//
// Throws ConfigError naming file and key.
void BuildPlan(YamlSection section, const MaterialNames& materials, SceneBuilder* builder);

}  // namespace slcmap::data
