#include "mapping/lines/ghost_lines.h"

#include <gtest/gtest.h>

#include "odometry/geometry/pinhole.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

Views RisingViews() {
  Views views;
  for (int i = 0; i < 5; ++i) views.push_back(testing::LookingAtWall({0, 0, 0.1 * i}, i));
  return views;
}

ViewCameras Cameras() { return {RisingViews(), testing::PaintedWall(RisingViews(), {}, 2).rig()}; }

// A vertical line 2 m in front of the views, beside which no surface is known.
TrackedLine VerticalAt(double x_m) {
  TrackedLine line;
  line.line = {{x_m, 2, 0}, Vector3d::UnitZ()};
  line.intervals = {{-0.3, 0.5}};
  line.surfaces.unknown_m = 0.8;
  line.parallax_rad = 0.02;
  return line;
}

// What images of one camera show of an edge becomes places of a line.
void Show(const TrackedLine& edge, int camera, const ViewCameras& cameras, TrackedLine* line) {
  for (int view = 0; view < std::ssize(cameras.T_camera_world); ++view) {
    for (double along_m = -0.25; along_m < 0.5; along_m += 0.1) {
      const Vector3d p = cameras.T_camera_world[view][camera] *
                         (edge.line.point_world + along_m * edge.line.direction_world);
      EdgePlace place;
      place.view = view;
      place.camera = camera;
      place.along_m = static_cast<float>(along_m);
      place.px =
          PixelFromPlane(cameras.cameras[camera], Eigen::Vector2d(p.hnormalized())).cast<float>();
      place.normal = {1, 0};
      line->places.push_back(place);
    }
  }
}

size_t KeptOf(std::vector<TrackedLine> lines, const MapLineOptions& options = {}) {
  DropGhosts(options, &lines);
  return lines.size();
}

// Two edges on a wall, and what the left images' one and the right images' other make of a line.
std::vector<TrackedLine> TwoEdgesAndTheirGhost() {
  const ViewCameras cameras = Cameras();
  std::vector<TrackedLine> lines = {VerticalAt(-0.1), VerticalAt(0.1), VerticalAt(0)};
  for (int i : {0, 1}) {
    lines[i].surfaces = {.flat_m = 0.8};
    Show(lines[i], 0, cameras, &lines[i]);
    Show(lines[i], 1, cameras, &lines[i]);
    Show(lines[i], i, cameras, &lines[2]);
  }
  return lines;
}

TEST(GhostLines, AreMadeOfTheEdgesOfOthers) { EXPECT_EQ(KeptOf(TwoEdgesAndTheirGhost()), 2u); }

TEST(GhostLines, AreNotWhereNoOtherEdgeIs) {
  auto lines = TwoEdgesAndTheirGhost();
  lines.erase(lines.begin(), lines.begin() + 2);
  EXPECT_EQ(KeptOf(lines), 1u);
}

TEST(GhostLines, AreNotSeenFromManySides) {
  auto lines = TwoEdgesAndTheirGhost();
  lines[2].parallax_rad = 0.5;
  EXPECT_EQ(KeptOf(lines), 3u);
}

TEST(GhostLines, HaveNoKnownSurfaceBesideThem) {
  auto lines = TwoEdgesAndTheirGhost();
  lines[2].surfaces = {.relief_m = 0.8};
  EXPECT_EQ(KeptOf(lines), 3u);
}

// What images show elsewhere along a line, or across its places, does not explain them.
TEST(GhostLines, AreNotExplainedByWhatIsElsewhere) {
  auto lines = TwoEdgesAndTheirGhost();
  for (int i : {0, 1}) {
    std::erase_if(lines[i].places, [](const EdgePlace& place) { return place.along_m > -0.2; });
  }
  EXPECT_EQ(KeptOf(lines), 3u);
  lines = TwoEdgesAndTheirGhost();
  for (EdgePlace& place : lines[2].places) place.normal = {0, 1};
  EXPECT_EQ(KeptOf(lines), 3u);
}

TEST(GhostLines, AreExplainedBeyondAShare) {
  auto lines = TwoEdgesAndTheirGhost();
  Show(VerticalAt(0.4), 0, Cameras(), &lines[2]);  // a third of its places
  EXPECT_EQ(KeptOf(lines), 2u);
  EXPECT_EQ(KeptOf(lines, {.min_ghost_share = 0.8}), 3u);
}

// Which of two that may be ghosts is one is not known.
TEST(GhostLines, DoNotExplainEachOther) {
  auto lines = TwoEdgesAndTheirGhost();
  for (int i : {0, 1}) lines[i].surfaces = {.unknown_m = 0.8};
  EXPECT_EQ(KeptOf(lines), 3u);
}

}  // namespace
}  // namespace slcmap
