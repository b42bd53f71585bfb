#include "mapping/building_world.h"

#include <cmath>
#include <optional>

namespace slcmap {
namespace {

bool IsLevel(const Line& line) { return line.axis == LineAxis::kX || line.axis == LineAxis::kY; }

std::optional<double> MainHeading(const OdometryRun& run) {
  std::vector<double> lengths_m(run.manhattan_worlds.size(), 0);
  for (const Line& line : run.lines) {
    if (!IsLevel(line) || line.world < 0 || line.world >= std::ssize(lengths_m)) continue;
    lengths_m[static_cast<size_t>(line.world)] += (line.end_world - line.start_world).norm();
  }
  std::optional<size_t> main;
  for (size_t i = 0; i < lengths_m.size(); ++i) {
    if (run.manhattan_worlds[i].withdrawn) continue;
    if (!main || lengths_m[i] > lengths_m[*main]) main = i;
  }
  if (!main) return std::nullopt;
  return run.manhattan_worlds[*main].heading_rad;
}

// X and Y of a world are interchangeable: its heading stays in (-pi/4, pi/4], and the lines of a
// world whose heading would leave that change axes.
void TurnHeadings(double yaw_rad, OdometryRun* run) {
  constexpr double kSquare_rad = 0.5 * M_PI;
  std::vector<bool> are_swapped;
  for (ManhattanWorld& world : run->manhattan_worlds) {
    const double turned_rad = world.heading_rad + yaw_rad;
    const double squares = std::ceil(turned_rad / kSquare_rad - 0.5);
    world.heading_rad = turned_rad - squares * kSquare_rad;
    are_swapped.push_back(std::fmod(squares, 2) != 0);
  }
  for (Line& line : run->lines) {
    if (!IsLevel(line) || line.world < 0 || line.world >= std::ssize(are_swapped)) continue;
    if (!are_swapped[static_cast<size_t>(line.world)]) continue;
    line.axis = line.axis == LineAxis::kX ? LineAxis::kY : LineAxis::kX;
  }
  for (SlopedDirection& slope : run->sloped_directions) {
    slope.azimuth_rad = std::remainder(slope.azimuth_rad + yaw_rad, 2 * M_PI);
  }
}

void TurnContents(const RigidTransform& T, OdometryRun* run) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (OnlineState& state : run->states) {
    state.T_world_imu = T * state.T_world_imu;
    state.velocity_world_m_s = R * state.velocity_world_m_s;
  }
  for (Keyframe& keyframe : run->keyframes) keyframe.T_world_imu = T * keyframe.T_world_imu;
  for (Landmark& landmark : run->landmarks) landmark.p_world = T * landmark.p_world;
  for (Line& line : run->lines) {
    line.start_world = T * line.start_world;
    line.end_world = T * line.end_world;
    line.covariance_m2 = R * line.covariance_m2 * R.transpose();
  }
}

}  // namespace

RigidTransform TurnAlongBuilding(OdometryRun* run) {
  const std::optional<double> heading_rad = MainHeading(*run);
  if (!heading_rad) return {};
  const RigidTransform T_turned_run{ExpRotation({0, 0, -*heading_rad}), Eigen::Vector3d::Zero()};
  TurnHeadings(-*heading_rad, run);
  TurnContents(T_turned_run, run);
  return T_turned_run;
}

}  // namespace slcmap
