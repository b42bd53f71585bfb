// Writes the page of the room of room_map.h, or of a large one, for the tests in a browser.
//
//   write_room_page TEMPLATE OUTPUT [LINES DENSE_POINTS PLANES]
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "data/file.h"
#include "export/page_writer.h"
#include "tests/export/page/room_map.h"

int main(int argc, char** argv) {
  using namespace slcmap;
  if (argc != 3 && argc != 6) {
    std::fprintf(stderr, "write_room_page TEMPLATE OUTPUT [LINES DENSE_POINTS PLANES]\n");
    return 2;
  }
  slcmap::testing::RoomMapSize size;
  if (argc == 6) size = {std::atoi(argv[3]), std::atoi(argv[4]), std::atoi(argv[5])};
  try {
    const MapResult map = slcmap::testing::MakeRoomMap(size);
    WriteFile(argv[2], MakePage(map, ReadFile(argv[1]), {.title = "A made room"}));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
