// Writes the page of the room of room_map.h, or of a large one, for the tests in a browser.
//
//   write_room_page TEMPLATE OUTPUT [LINES DENSE_POINTS PLANES | --images]
//
// With --images every other keyframe has a picture, white at the top right, black elsewhere.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "data/io/file.h"
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
  const bool with_images = argc == 4 && argv[3] == std::string("--images");
  if (argc != 3 && argc != 6 && !with_images) {
    std::fprintf(stderr,
                 "write_room_page TEMPLATE OUTPUT [LINES DENSE_POINTS PLANES | --images]\n");
    return 2;
  }
  slcmap::testing::RoomMapSize size;
  if (argc == 6) size = {std::atoi(argv[3]), std::atoi(argv[4]), std::atoi(argv[5])};
  try {
    const MapResult map = slcmap::testing::MakeRoomMap(size);
    const auto images = with_images ? Images(map) : std::vector<PageImage>();
    WriteFile(argv[2], MakePage(map, ReadFile(argv[1]), {.title = "A made room"}, images));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
