// From a run, or poses by anyone, and the images of its recording to a map of the building; and two
// maps as one.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/io/trajectory.h"
#include "data/source/sequence_source.h"
#include "mapping/control/control_points.h"
#include "mapping/map/map.h"
#include "mapping/options.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

struct RecordedViews;
class StageStore;

// What a map is made of.
struct MapInput {
  OdometryRun run;           // as odometry found it, or as ReadInputAtPoses has it
  std::string name = "run";  // of the run, or of the poses, in warnings
  // How far pairs of images have poses by anyone off, by medians; infinity: nobody knows.
  double off_by_pairs_rad = std::numeric_limits<double>::infinity();
  double off_by_pairs_m = std::numeric_limits<double>::infinity();
  Eigen::Vector3d world_offset_m = Eigen::Vector3d::Zero();  // added to them, as they were given
  std::string recording = {};           // where it has moved to; "": it is where the run says
  std::optional<Control> control = {};  // points that its keyframes show pull them
  bool sparse = false;                  // from the run alone, without its recording's images
  // A folder that keeps what long stages made until StageStore::Remove: a map that was stopped goes
  // on behind them. "": nothing is kept.
  std::string stages = {};
};

// Poses by anyone, of a file whose `form` is known, for a recording that is opened so. Throws what
// ReadExternalPoses and RunAtPoses throw.
MapInput ReadInputAtPoses(const std::string& sequence, const SequenceOptions& opened,
                          const std::string& poses, const PoseForm& form);

// All that `slcmap map` does but reading and writing: adjusts the keyframes, with the revisits that
// edges and images tell, or the poses by anyone; turns the world along the building; looks at the
// images again, or, of a run without a stereo recording, at its landmarks; and builds the map. The
// same input gives the same map, to the last bit. Once progress says so, the map is what is done so
// far, and not complete. Throws ConfigError when an option is not plausible, or would take too much
// memory, and DataError where the recording is not there.
MapResult BuildMap(MapInput input, const MappingOptions& options, const Progress& progress = {});

// The part of it behind the adjustment, for tests and benchmarks: the run is mapped as it is, with
// the views' images where there are some.
MapResult MapRun(const OdometryRun& run, const RecordedViews* recorded,
                 const MappingOptions& options, const StageStore* store = nullptr,
                 const Progress& progress = {});

// A map that is read when its turn comes, so that few are held at once.
struct MapToMerge {
  std::function<MapResult()> read;
  RigidTransform T_world_map;  // of the first: none
  std::string date = {};       // of a recording that is not merged yet, YYYY-MM-DD; "": not said
};

// Those that lie where PlaceMaps has put them, in the world of the first: neighbours in their order
// are united two by two, then these, so that time grows by n log n; the building is made once. What
// later walks saw to be gone is taken out of earlier ones, where dates tell which is which. Throws
// DataError for maps that cannot be merged (made without images, of a run that was lost in between,
// of one run), and StoppedError once progress says so.
MapResult MergeMaps(const std::vector<MapToMerge>& maps, const MappingOptions& options,
                    const Progress& progress = {});

}  // namespace slcmap::mapping
