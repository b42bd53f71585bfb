// Reads a map, and lists its lines and rooms: read_map MAP
#include <cstdio>
#include <exception>

#include "mapping/map/map_folder.h"

namespace {

void ListMap(const slcmap::MapResult& map) {
  std::puts("# line axis start_x_m start_y_m start_z_m end_x_m end_y_m end_z_m sigma_m");
  for (const slcmap::MapLine& line : map.lines) {
    const Eigen::Vector3d &start = line.start_world, &end = line.end_world;
    std::printf("%ld %d %.3f %.3f %.3f %.3f %.3f %.3f %.4f\n", static_cast<long>(line.id),
                static_cast<int>(line.axis), start.x(), start.y(), start.z(), end.x(), end.y(),
                end.z(), line.sigma_m);
  }
  for (const slcmap::Room& room : map.building.rooms) {
    std::printf("# room %ld: %.1f m2\n", static_cast<long>(room.id), room.area_m2);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: read_map MAP\n", stderr);
    return 2;
  }
  try {
    ListMap(slcmap::ReadMapFolder(argv[1]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
