// A map as what its building is made of.
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/line_sights.h"
#include "mapping/map.h"

namespace slcmap {

// All points of the dense cloud, the lines, and the places of the trajectory, with the sights and
// what the lines add to them.
inline BuildingInput BuildingInputOf(const MapResult& map, std::vector<Sights> sights) {
  BuildingInput input;
  for (const DensePoint& point : map.dense) {
    input.points.push_back({point.p_world, point.normal_world, point.sigma_m});
  }
  input.lines = map.lines;
  input.sights = std::move(sights);
  std::vector<Sights> of_lines = SightsOfLines(map);
  std::move(of_lines.begin(), of_lines.end(), std::back_inserter(input.sights));
  for (const StampedPose& pose : map.trajectory) {
    input.trajectory_world.push_back(pose.T_world_imu.translation);
  }
  return input;
}

}  // namespace slcmap
