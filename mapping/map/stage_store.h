// What the finished stages of a map made, kept on disk until the map is done: one that was stopped
// goes on behind them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/occupancy_map.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// Files of a folder, each with a checksum and the key of what it was made of. Without a folder
// nothing is kept.
class StageStore {
 public:
  StageStore() = default;
  StageStore(std::string folder, std::string key)
      : folder_(std::move(folder)), key_(std::move(key)) {}

  // What was saved of a stage, of the same key; nothing where there is none, or it is damaged.
  std::optional<std::string> Load(const std::string& stage) const;

  // Whole or not at all. Where it cannot be written, it is not kept, with a warning.
  void Save(const std::string& stage, const std::function<std::string()>& contents) const;

  // Removes what was saved, whatever its key, and the folder where nothing else is in it.
  static void Remove(const std::string& folder);

 private:
  std::string MakePath(const std::string& stage) const;

  std::string folder_, key_;
};

// What tells this program from another build of it, of the same version too. Throws DataError.
std::string ProgramId();

// A checksum of what the stages are made of: the run and its poses and calibration as they are
// mapped, its images, as `images` tells them (StatesOfImages), options (YAML), and the program.
std::string StageKey(const OdometryRun& run, const std::string& images, const std::string& options,
                     const std::string& program);

using CountedWarnings = std::map<std::string, int64_t>;

// The dense stage: the map's dense points and occupancy, what each view saw, and the warnings that
// it has counted.
struct DenseStage {
  std::vector<DensePoint> dense;
  OccupancyMap occupancy{0.1};
  std::vector<ViewRays> rays;
  CountedWarnings warnings;
};
std::string PackDense(const MapResult& map, const std::vector<ViewRays>& rays,
                      const CountedWarnings& warnings);
// Nothing where the bytes are of another form.
std::optional<DenseStage> UnpackDense(const std::string& bytes);

// The stage of lines, marks among them.
struct LineStage {
  std::vector<MapLine> lines;
  LineEvidence evidence;
  CountedWarnings warnings;
};
std::string PackLines(const LineStage& stage);
std::optional<LineStage> UnpackLines(const std::string& bytes);

}  // namespace slcmap::mapping
