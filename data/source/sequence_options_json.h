// How a recording was opened, as run.json and map.json have it.
#pragma once

#include "data/io/json.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

// Of what the user chooses, and of pairs that were mended; paths as they are.
inline Json OpenedJson(const SequenceOptions& opened) {
  Json pieces = Json::array();
  for (const PairPiece& piece : opened.pieces) {
    pieces.push_back({{"from_ns", piece.from_ns},
                      {"to_ns", piece.to_ns},
                      {"later", piece.later},
                      {"late", piece.late},
                      {"has_right", piece.has_right}});
  }
  Json json = {{"cameras", opened.cameras},
               {"calibration", opened.calibration},
               {"masks", opened.masks},
               {"pair_tolerance_s", opened.max_stereo_offset_s},
               {"right_offset_s", opened.right_offset_s}};
  if (!pieces.empty()) json["pieces"] = pieces;
  if (!opened.topics.empty()) json["topics"] = opened.topics;
  if (opened.right_stamped_later_s != 0)
    json["right_stamped_later_s"] = opened.right_stamped_later_s;
  if (!opened.others_stamped_later_s.empty()) {
    json["others_stamped_later_s"] = opened.others_stamped_later_s;
  }
  return json;
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
  opened.topics = json.value("topics", "");
  opened.right_stamped_later_s = json.value("right_stamped_later_s", 0.0);
  opened.others_stamped_later_s = json.value("others_stamped_later_s", std::vector<double>());
  for (const Json& piece : json.value("pieces", Json::array())) {
    opened.pieces.push_back({piece.at("from_ns").get<int64_t>(), piece.at("to_ns").get<int64_t>(),
                             piece.at("later").get<int>(), piece.at("late").get<int>(),
                             piece.at("has_right").get<bool>()});
  }
  return opened;
}

}  // namespace slcmap::data
