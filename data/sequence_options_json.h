// How a recording was opened, as run.json and map.json have it.
#pragma once

#include "data/json_file.h"
#include "data/sequence_options.h"

namespace slcmap {

// Of what the user chooses; paths as they are.
inline Json OpenedJson(const SequenceOptions& opened) {
  return {{"cameras", opened.cameras},
          {"calibration", opened.calibration},
          {"masks", opened.masks},
          {"pair_tolerance_s", opened.max_stereo_offset_s},
          {"right_offset_s", opened.right_offset_s}};
}

// Of the object that holds it; the default of one by an earlier version, which does not.
inline SequenceOptions ParseOpened(const Json& holder) {
  SequenceOptions opened;
  if (!holder.contains("opened")) return opened;
  const Json& json = holder.at("opened");
  opened.cameras = json.at("cameras").get<std::vector<int>>();
  opened.calibration = json.at("calibration").get<std::string>();
  opened.masks = json.at("masks").get<std::vector<std::string>>();
  opened.max_stereo_offset_s = json.at("pair_tolerance_s").get<double>();
  opened.right_offset_s = json.at("right_offset_s").get<double>();
  return opened;
}

}  // namespace slcmap
