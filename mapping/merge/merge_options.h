// Options of aligning and merging maps.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace slcmap {

// A rough place of the second map's origin in the first one's world, and how it is turned.
struct RoughStart {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;
};

// How far from a rough start the alignment is looked for.
inline constexpr double kStartReach_m = 2, kStartReachUp_m = 1, kStartReachYaw_rad = 0.35;

struct AlignmentOptions {
  std::optional<RoughStart> start;  // none: anywhere

  // Of the plan that is searched; grows with buildings that are larger than some 200 m.
  double vote_cell_m = 0.1;
  int max_candidates = 60;  // places that are looked at closely

  // What the maps have to share.
  double min_surfaces_m2 = 4, min_lines_m = 8;
  // Of what both know, the share of surfaces of the one in the free space of the other.
  double max_contradiction = 0.12;
  double min_agreeing = 0.5;  // of the surfaces of the second that the first knows
  // Another place is about as good where what tells the two apart (metres of lines and m2) speaks
  // for it as far, as a share of what speaks for the best, or where that is not so much more.
  double max_rival_share = 0.5;
  double min_telling = 1.5;
};

}  // namespace slcmap
