// A recording in a folder or in a bag becomes a map, and the map files that other programs open:
// map_recording SEQ MAP EXPORT
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "data/io/image.h"
#include "data/source/sequence.h"
#include "export/export.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/odometry.h"

namespace {

cv::Mat ReadGray(const slcmap::Sequence& sequence, const std::string& path) {
  return slcmap::ReadGrayImage(*sequence.store, path, {}).image;
}

// What mapping needs to open the recording's images again.
slcmap::RunSource DescribeSource(const slcmap::Sequence& sequence,
                                 const slcmap::OdometryOptions& options) {
  slcmap::RunSource source;
  source.sequence = std::filesystem::weakly_canonical(sequence.folder).string();
  source.options = options.ToYaml();
  source.raw_rig = sequence.rig;
  source.opened = sequence.opened;
  const auto within = [&](const std::filesystem::path& image) {
    return image.lexically_relative(sequence.folder).string();
  };
  for (const slcmap::StereoEntry& entry : sequence.images) {
    source.images.push_back({entry.stamp_ns, within(entry.left_path), within(entry.right_path)});
  }
  return source;
}

slcmap::OdometryRun RunOdometry(const slcmap::Sequence& sequence,
                                const slcmap::OdometryOptions& options) {
  slcmap::Odometry odometry(sequence.rig, options, 2);
  for (const slcmap::ImuSample& sample : sequence.imu) odometry.AddImu(sample);
  for (const slcmap::StereoEntry& entry : sequence.images) {
    odometry.AddStereo({entry.stamp_ns, ReadGray(sequence, entry.left_path), {}},
                       {[&, path = entry.right_path] { return ReadGray(sequence, path); }});
  }
  odometry.Finish();
  return odometry.Run();
}

void MapRecording(const std::string& recording, const std::string& map_folder,
                  const std::string& export_folder) {
  const slcmap::Sequence sequence = slcmap::OpenSequence(recording);
  const slcmap::OdometryOptions options;
  slcmap::OdometryRun run = RunOdometry(sequence, options);
  run.complete = true;
  run.source = DescribeSource(sequence, options);
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
