// A recording in EuRoC's (ASL) or TUM VI's layout becomes a map, and the map files that other
// programs open: map_recording SEQ MAP EXPORT
#include <cstdio>
#include <exception>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "data/source/sequence.h"
#include "export/export.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/odometry.h"

namespace {

cv::Mat ReadGray(const std::string& path) { return cv::imread(path, cv::IMREAD_GRAYSCALE); }

// What mapping needs to open the recording's images again.
slcmap::RunSource DescribeSource(const slcmap::Sequence& sequence, const std::string& folder,
                                 const slcmap::OdometryOptions& options) {
  slcmap::RunSource source;
  source.sequence = std::filesystem::weakly_canonical(folder).string();
  source.options = options.ToYaml();
  source.raw_rig = sequence.rig;
  source.opened = sequence.opened;
  for (const slcmap::StereoEntry& entry : sequence.images) {
    source.images.push_back({entry.stamp_ns, std::filesystem::relative(entry.left_path, folder),
                             std::filesystem::relative(entry.right_path, folder)});
  }
  return source;
}

slcmap::OdometryRun RunOdometry(const slcmap::Sequence& sequence,
                                const slcmap::OdometryOptions& options) {
  slcmap::Odometry odometry(sequence.rig, options, 2);
  for (const slcmap::ImuSample& sample : sequence.imu) odometry.AddImu(sample);
  for (const slcmap::StereoEntry& entry : sequence.images) {
    odometry.AddStereo({entry.stamp_ns, ReadGray(entry.left_path), {}},
                       [path = entry.right_path] { return ReadGray(path); });
  }
  odometry.Finish();
  return odometry.Run();
}

void MapRecording(const std::string& folder, const std::string& map_folder,
                  const std::string& export_folder) {
  const slcmap::Sequence sequence = slcmap::OpenSequence(folder);
  const slcmap::OdometryOptions options;
  slcmap::OdometryRun run = RunOdometry(sequence, options);
  run.complete = true;
  run.source = DescribeSource(sequence, folder, options);
  const slcmap::MapResult map = slcmap::BuildMap({run}, slcmap::MappingOptions());
  slcmap::WriteMapFolder(map_folder, map);
  slcmap::ExportOptions formats;
  formats.formats = {"dxf", "ply", "glb"};
  slcmap::ExportMap(map, export_folder, formats);
  std::printf("%zu poses, %zu lines, %zu dense points, %zu rooms\n", map.trajectory.size(),
              map.lines.size(), CountDense(map), map.building.rooms.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: map_recording SEQ MAP EXPORT\n", stderr);
    return 2;
  }
  try {
    MapRecording(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
