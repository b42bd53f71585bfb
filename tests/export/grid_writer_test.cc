#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <opencv2/imgcodecs.hpp>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/plan/occupancy_grid.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

constexpr double kGridRes_m = 0.1;

// Free space of 2 m by 1 m over a floor at -1 m, a wall of full height along its right side, a step
// of 0.1 m, a lintel at 2 m, and something that is unknown.
MapResult MakeRoomToDriveIn() {
  MapResult map;
  map.building.storeys = {{0, -1, std::nullopt}};
  CellObservation cells;
  const auto fill = [](const Eigen::Vector3i& low, const Eigen::Vector3i& high,
                       std::vector<OctreeCell>* of) {
    for (int x = low.x(); x < high.x(); ++x) {
      for (int y = low.y(); y < high.y(); ++y) {
        for (int z = low.z(); z < high.z(); ++z) of->emplace_back(x, y, z);
      }
    }
  };
  fill({-5, 3, -10}, {15, 13, 10}, &cells.free);
  fill({15, 3, -10}, {16, 13, 14}, &cells.occupied);  // the wall
  fill({0, 5, -10}, {2, 7, -9}, &cells.occupied);     // the step
  fill({8, 3, 10}, {10, 13, 12}, &cells.occupied);    // the lintel
  fill({-5, 20, -5}, {-4, 21, -4}, &cells.occupied);  // a thing beyond what was seen
  map.occupancy.Mark(cells);
  map.occupancy.Finish();
  return map;
}

// As map_server reads it: the value of the cell that holds a point.
class ReadGrid {
 public:
  explicit ReadGrid(const std::string& yaml)
      : yaml_(YAML::LoadFile(yaml)),
        image_(cv::imread(yaml.substr(0, yaml.rfind('/') + 1) + yaml_["image"].as<std::string>(),
                          cv::IMREAD_UNCHANGED)) {}

  int At(double x, double y) const {
    const double resolution_m = yaml_["resolution"].as<double>();
    const int column =
        static_cast<int>(std::floor((x - yaml_["origin"][0].as<double>()) / resolution_m));
    const int row =
        static_cast<int>(std::floor((y - yaml_["origin"][1].as<double>()) / resolution_m));
    return image_.at<uint8_t>(image_.rows - 1 - row, column);
  }
  const YAML::Node& yaml() const { return yaml_; }

 private:
  YAML::Node yaml_;
  cv::Mat image_;
};

TEST(GridWriter, ASecondReaderFindsWallsWhereTheyAre) {
  const testing::TempFolder temp;
  GridWriter().Write(temp.Path(""), MakeRoomToDriveIn(), {});
  const ReadGrid grid(temp.Path("grid/storey_0.yaml"));
  EXPECT_EQ(grid.yaml()["negate"].as<int>(), 0);
  EXPECT_EQ(grid.yaml()["mode"].as<std::string>(), "trinary");
  EXPECT_EQ(grid.yaml()["resolution"].as<double>(), kGridRes_m);
  for (double y = 0.35; y < 1.3; y += kGridRes_m) {
    EXPECT_EQ(grid.At(1.55, y), 0);    // the wall
    EXPECT_EQ(grid.At(1.45, y), 254);  // before it
    EXPECT_EQ(grid.At(0.95, y), 254);  // beneath the lintel
  }
  EXPECT_EQ(grid.At(0.1, 0.6), 254);   // over the step
  EXPECT_EQ(grid.At(-0.45, 2.05), 0);  // the thing is at the top
  EXPECT_EQ(grid.At(1.0, 2.05), 205);
  EXPECT_LT((255 - 254) / 255.0, grid.yaml()["free_thresh"].as<double>());
  EXPECT_GT((255 - 205) / 255.0, grid.yaml()["free_thresh"].as<double>());
  EXPECT_GT(1.0, grid.yaml()["occupied_thresh"].as<double>());
}

TEST(GridWriter, HeightsAreAnOption) {
  const testing::TempFolder temp;
  GridWriter({.low_m = 0, .high_m = 2.3}).Write(temp.Path(""), MakeRoomToDriveIn(), {});
  const ReadGrid grid(temp.Path("grid/storey_0.yaml"));
  EXPECT_EQ(grid.At(0.1, 0.6), 0);
  EXPECT_EQ(grid.At(0.95, 0.8), 0);
  EXPECT_THROW(GridWriter({.low_m = 2, .high_m = 1}).Write(temp.Path(""), {}, {}), ConfigError);
}

TEST(GridWriter, AnEmptyMapIsOneUnknownCell) {
  const testing::TempFolder temp;
  GridWriter().Write(temp.Path(""), MapResult(), {});
  EXPECT_EQ(ReadGrid(temp.Path("grid/no_storey.yaml")).At(0.05, 0.05), 205);
}

}  // namespace
}  // namespace slcmap
