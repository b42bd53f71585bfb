// Writes the page of the room of room_map.h, or of a large one, for the tests in a browser.
//
//   write_room_page TEMPLATE OUTPUT [LINES DENSE_POINTS PLANES] [--images | --tiles]
//
// With --images every other keyframe has a picture, white at the top right, black elsewhere, and a
// wall is not where it was planned. With --tiles the output is a folder for a tileset with its
// page.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "data/io/file.h"
#include "export/scene/formats.h"
#include "export/web/page_writer.h"
#include "tests/export/web/room_map.h"

namespace {

std::vector<slcmap::PageImage> Images(const slcmap::MapResult& map) {
  cv::Mat image = cv::Mat::zeros(48, 64, CV_8U);
  image(cv::Rect(32, 0, 32, 24)) = 255;
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes);
  std::vector<slcmap::PageImage> images;
  for (std::size_t i = 0; i < map.keyframes.size(); i += 2) {
    images.push_back({i, {bytes.begin(), bytes.end()}});
  }
  return images;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace slcmap;
  const bool is_sized = argc >= 6;
  const std::string what = argc == 4 || argc == 7 ? argv[argc - 1] : "";
  if (argc < 3 || argc == 5 || argc > 7 ||
      (argc % 3 == 1 && what != "--images" && what != "--tiles")) {
    std::fprintf(
        stderr,
        "write_room_page TEMPLATE OUTPUT [LINES DENSE_POINTS PLANES] [--images | --tiles]\n");
    return 2;
  }
  slcmap::testing::RoomMapSize size;
  if (is_sized) size = {std::atoi(argv[3]), std::atoi(argv[4]), std::atoi(argv[5])};
  // Of more than a tile.
  if (what == "--tiles" && !is_sized) size.dense_points = 100000;
  try {
    MapResult map = slcmap::testing::MakeRoomMap(size);
    if (what == "--tiles") {
      WriteTiles(ReadFile(argv[1]), argv[2], map);
      return 0;
    }
    if (what == "--images") {
      map.plan.emplace().walls.push_back(
          {PlanStatus::kDeviates, 0, 3, {104, 0}, {104, 3}, -0.021, 0.004});
    }
    const auto images = what == "--images" ? Images(map) : std::vector<PageImage>();
    WriteFile(argv[2], MakePage(map, ReadFile(argv[1]), "A made room", images));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
