// Scenes whose maps are laid on each other.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <string>

#include "tests/testing/scanned_map.h"

namespace slcmap::testing {

// A floor and a ceiling from x, y, of a size.
inline std::string Slabs(double x, double y, double width_m, double depth_m) {
  const std::string slab = fmt::format("  - {{kind: slab, at: [{}, {}, ", x, y),
                    size = fmt::format("], size: [{}, {}], ", width_m, depth_m);
  return slab + "0" + size + "material: carpet}\n" + slab + "2.7" + size +
         "material: ceiling, faces_down: true}\n";
}

// Two rooms of different sizes with a door between them, and things in both; its mirror image.
inline Scene TwoRoomFlat(bool is_mirrored = false) {
  const double sense = is_mirrored ? -1 : 1, left = is_mirrored ? -9 : 0;
  std::string text = "objects:\n" + Slabs(left, 0, 9, 4) +
                     fmt::format(R"(
  - {{kind: wall, points: [[{0}, 0], [{1}, 0], [{1}, 4], [{0}, 4]], closed: true, skirting_height: 0.09}}
  - {{kind: wall, points: [[{2}, 0], [{2}, 4]], has_back: true, doors: [[0, 1.2, 1.0, 2.1, 90]]}}
)",
                                 left, left + 9, 5 * sense);
  for (const auto& [x, rest] : {std::pair(0.5, "3.2, 0], size: [0.8, 0.6, 1.8]"),
                                {3.2, "0.4, 0], size: [1.2, 0.6, 0.75]"},
                                {8.2, "0.6, 0], size: [0.6, 1.0, 1.1]"},
                                {6.4, "3.6, 0.9], size: [1.0, 0.3, 0.9]"}}) {
    text += fmt::format("  - {{kind: box, at: [{}, {}}}\n", sense * x, rest);
  }
  return SceneFromText(text);
}

// Through the left room alone, and through both.
inline const Way kWestWay = {{1.5, 2, 1.5}, {4, 2.4, 1.5}, {4.3, 1.7, 1.5}};
inline const Way kWholeWay = {{7.5, 2.5, 1.5}, {6, 1.8, 1.5}, {4, 1.7, 1.5}, {2, 1.6, 1.5}};

// Two rooms that look alike, the one as the other, and between them one that does not; ways through
// all three, and through each of the two.
inline Scene TwinRooms() {
  return SceneFromText("objects:\n" + Slabs(0, 0, 12, 4) + R"(
  - {kind: wall, points: [[0, 0], [4, 0], [4, 4], [0, 4]], closed: true}
  - {kind: wall, points: [[4.2, 0], [7.8, 0], [7.8, 4], [4.2, 4]], closed: true}
  - {kind: wall, points: [[8, 0], [12, 0], [12, 4], [8, 4]], closed: true}
  - {kind: box, at: [1, 3.2, 0], size: [0.8, 0.6, 1.8], repeat: 2, step: [8, 0, 0]}
  - {kind: box, at: [3, 0.4, 0], size: [1.2, 0.6, 0.75], repeat: 2, step: [8, 0, 0]}
  - {kind: box, at: [6, 3.4, 0], size: [1.2, 0.6, 0.75]}
)");
}
inline const std::vector<Way> kAllOfTwins = {
    {{1.5, 2, 1.5}, {3, 2, 1.5}}, {{5, 2, 1.5}, {7, 2, 1.5}}, {{9.5, 2, 1.5}, {11, 2, 1.5}}};
inline const Way kFirstTwin = {{2, 2.6, 1.5}, {2, 1.2, 1.5}};
inline const Way kSecondTwin = {{10, 2.6, 1.5}, {10, 1.2, 1.5}};

inline Scene OtherBuilding() {
  return RoomWithBoxes("[9, 7]", "[[0, 0], [9, 0], [9, 3], [6, 7], [0, 7]]");
}
inline const Way kOtherWay = {{5, 5, 1.5}, {6, 2, 1.5}};

inline RigidTransform Turned(double yaw_deg, const Eigen::Vector3d& t) {
  return LevelTransform(yaw_deg * kDegree, t);
}

}  // namespace slcmap::testing
