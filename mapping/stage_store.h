// What the finished stages of a map made, kept on disk until the map is done: one that was stopped
// goes on behind them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/map.h"
#include "mapping/options.h"
#include "mapping/views/recorded_views.h"

namespace slcmap {

// Files of a folder, each with a checksum and the key of what it was made of. Without a folder
// nothing is kept.
class StageStore {
 public:
  StageStore() = default;
  StageStore(std::string folder, std::string key)
      : folder_(std::move(folder)), key_(std::move(key)) {}

  // What was saved of a stage, of the same key; nothing where there is none, or it is damaged.
  std::optional<std::string> Load(const std::string& stage) const;

  // Whole or not at all. Where it cannot be written, it is not kept, which is no error.
  void Save(const std::string& stage, const std::function<std::string()>& contents) const;

 private:
  std::string PathOf(const std::string& stage) const;

  std::string folder_, key_;
};

// A checksum of what the stages are made of: poses and calibration of the run as it is mapped, the
// recording, options, and the program.
std::string StageKey(const OdometryRun& run, const std::string& sequence,
                     const MappingOptions& options, const std::string& program);

// What a stage has found besides its results: warnings that it has counted, images it has missed.
struct StageReports {
  std::map<std::string, int64_t> warnings;
  std::vector<std::string> lost_images;
};

// The dense stage: the map's dense points and occupancy, and what each view saw.
std::string PackDense(const MapResult& map, const std::vector<Sights>& sights,
                      const StageReports& reports);
// Sets the map's; nothing is set where the bytes are of another form.
struct UnpackedDense {
  std::vector<DensePoint> dense;
  OccupancyMap occupancy;
  std::vector<Sights> sights;
  StageReports reports;
};
std::optional<UnpackedDense> UnpackDense(const std::string& bytes);

// The stage of lines, marks among them.
struct LineStage {
  std::vector<MapLine> lines;
  LineEvidence evidence;
  StageReports reports;
};
std::string PackLines(const LineStage& stage);
std::optional<LineStage> UnpackLines(const std::string& bytes);

}  // namespace slcmap
