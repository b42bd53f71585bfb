// A map on control points: where its recordings show them, where that places it, and what pulls
// poses to them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/source/sequence_source.h"
#include "mapping/adjustment/adjustment_state.h"
#include "mapping/control/control_points.h"
#include "mapping/map/map.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// A recording, and the stamps of its keyframes, and of images between them that have a pose, as the
// map has them: later by stamps_moved_ns.
struct ControlRecording {
  std::string path;
  SequenceOptions opened;
  int64_t stamps_moved_ns = 0;
  std::vector<int64_t> stamps_ns;
};

// Those that a map was made of; `moved_to` is where the only one is, where it is not "".
std::vector<ControlRecording> ListControlRecordings(const MapResult& map,
                                                    const std::string& moved_to);
ControlRecording ControlRecordingOfRun(const OdometryRun& run, const std::string& moved_to);

// Adds the tags that these images show. Returns the raw cameras. Throws DataError where the
// recording is not there, StoppedError.
Rig AddTags(const ControlRecording& recording, const Progress& progress, Control* control);

// Metres of the grid to a metre of the ground where the points are. Throws ConfigError for a system
// that cannot be, DataError where the points are not in its area, perhaps with swapped axes.
double FindGridScale(const Control& control);

// Places the map: its georeference, and how it lies on the points and distances. `raw`: the cameras
// that recorded it, as it has found them. Throws DataError as PlaceOnPoints does, and where marks
// are at no image of the map, or too few points were seen.
void PlaceOnControl(const Control& control, const Rig& raw, MapResult* map);

// Counts runs that control has scaled, as a warning of the run.
inline constexpr const char* kScaledToControl = "scaled_to_control";

// What pulls the run, which is scaled first where its metre is wrong by what was measured: points,
// as far as three agree with it, and known distances from which it is not off by 3 % and more.
// Their sightings are added to it as observations of landmarks.
ControlTies TieToControl(const Control& control, OdometryRun* run);

}  // namespace slcmap::mapping
