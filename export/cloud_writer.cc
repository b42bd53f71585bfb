#include "export/cloud_writer.h"

#include "export/world_offset.h"
#include "mapping/dense/dense_file.h"
#include "mapping/point_cloud.h"

namespace slcmap {

std::vector<std::string> CloudWriter::Names() const {
  return {"points.pcd", "dense.pcd", "dense.ply", "occupancy.bt"};
}

std::vector<std::string> CloudWriter::Write(const std::string& folder, const MapResult& map,
                                            const Progress& progress) const {
  WritePcd(folder + "/points.pcd", map.points);
  progress.ReportOrStop(0.2);
  WriteDensePcd(folder + "/dense.pcd", map.dense);
  progress.ReportOrStop(0.5);
  WriteDensePly(folder + "/dense.ply", map.dense, options_.form(),
                WorldOffsetNote(map.source.world_offset_m));
  progress.ReportOrStop(0.8);
  map.occupancy.Write(folder + "/occupancy.bt");
  std::vector<std::string> paths;
  for (const std::string& name : Names()) paths.push_back(folder + "/" + name);
  return paths;
}

}  // namespace slcmap
