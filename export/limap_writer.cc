#include "export/limap_writer.h"

#include <spdlog/fmt/fmt.h>

#include "data/file.h"

namespace slcmap {
namespace {

std::string Numbers(const Eigen::Vector3d& p) {
  return fmt::format("{:.10f} {:.10f} {:.10f}", p.x(), p.y(), p.z());
}

// Tracks count from 0 in the order of the map's lines.
std::string TracksOf(const std::vector<MapLine>& lines) {
  std::string text = fmt::format("{}\n", lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += fmt::format("{} 0 0\n{}\n{}\n\n\n", i, Numbers(lines[i].start_world),
                        Numbers(lines[i].end_world));
  }
  return text;
}

// A row: the number of its segments, their ends, the number of its supports.
std::string RowsOf(const std::vector<MapLine>& lines) {
  std::string text;
  for (const MapLine& line : lines) {
    text += fmt::format("1 {} {} 0\n", Numbers(line.start_world), Numbers(line.end_world));
  }
  return text;
}

}  // namespace

std::vector<std::string> LimapWriter::Write(const std::string& folder, const MapResult& map,
                                            const Progress& progress) const {
  const std::string own = folder + "/limap";
  MakeFolder(own);
  WriteFile(own + "/alltracks.txt", TracksOf(map.lines));
  progress.ReportOrStop(0.5);
  WriteFile(own + "/lines.txt", RowsOf(map.lines));
  progress.ReportOrStop(1);
  return {own + "/alltracks.txt", own + "/lines.txt"};
}

}  // namespace slcmap
