// A map folder, one of whose files is another.
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "tests/fuzz/folder_target.h"
#include "tests/testing/made_building.h"
#include "tests/testing/made_run.h"

namespace {

const slcmap::fuzz::FolderTarget& Target() {
  static const slcmap::fuzz::FolderTarget target([](const std::string& folder) {
    slcmap::MappingOptions options;
    options.occupancy.resolution_m = 0.5;
    slcmap::MapResult map = slcmap::MapRun(slcmap::testing::MakeLineRun(), nullptr, options);
    map.building = slcmap::testing::MakeBuilding(2);
    map.pipes.emplace_back();
    map.pipes[0].end_world = {0, 0, 2};
    map.pipes[0].radius_m = 0.05;
    const int64_t first_ns = map.trajectory.front().stamp_ns;
    const int64_t last_ns = map.trajectory.back().stamp_ns;
    map.source.merged = {{"", "a", "0.1.0", 0, {}, slcmap::StampSpan{first_ns, last_ns - 1}},
                         {"b", "b", "0.1.0", 5, {}, slcmap::StampSpan{last_ns, last_ns}}};
    slcmap::WriteMapFolder(folder, map);
  });
  return target;
}

}  // namespace

std::vector<std::string> slcmap::fuzz::Seeds() { return Target().Seeds(); }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Target().Run(bytes, size, [](const std::string& folder) { slcmap::ReadMapFolder(folder); });
  return 0;
}
