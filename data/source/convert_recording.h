// A recording written anew, as a folder or as a bag: its rows as they were written down, before
// anything is judged, so that what opens the copy judges as it does of the original.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "data/bag/bag.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/rig/profile.h"
#include "data/source/recording_tables.h"
#include "data/source/sequence.h"

namespace slcmap::inline data {

// What was written, by sensor: "cam0", "imu0".
struct ConvertedCounts {
  std::map<std::string, int64_t> rows;
  Warnings warnings;  // what could not be used
};

// Writes `part` of a recording, by its stamps as they were written down: images of each camera, and
// the IMU's samples from a second before to a second after. Both throw ConfigError where there is
// no image in it, DataError where the recording cannot be read, OutputError, and StoppedError where
// progress ends it.

// Into a folder: an EuRoC (ASL) folder (mav0). Images that are files stay as they are, others
// become PNG. Of a recording that is such a folder, calibrations come along.
ConvertedCounts WriteAslRecording(const RecordingTables& recording, const SequencePart& part,
                                  const std::string& folder, const Progress& progress);

// Into a bag, with EuRoC's topics: pixels of 8 or 16 bits of grey, with `keep_files` the files that
// images are (PNG and JPEG, topics with /compressed behind them). Where gyroscope and accelerometer
// have rows of their own, they have topics of their own. With a layout, topics, frames, colours and
// calibration are as that rig's driver has them, of left and right cameras alone. Images that
// cannot be decoded are counted and left out. A db3 is a folder.
ConvertedCounts WriteBagRecording(const RecordingTables& recording, const SequencePart& part,
                                  const BagPacking& packing, bool keep_files,
                                  const std::string& path, const Progress& progress,
                                  const std::optional<RigLayout>& layout = std::nullopt);

}  // namespace slcmap::data
