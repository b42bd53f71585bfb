// How a recording was opened, as run.json and map.json have it.
#pragma once

#include "data/io/json_fields.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

template <typename Fields>
void Describe(Fields& fields, Of<PairPiece> auto& piece) {
  fields.Value("from_ns", piece.from_ns);
  fields.Value("to_ns", piece.to_ns);
  fields.Value("later", piece.later);
  fields.Value("late", piece.late);
  fields.Value("has_right", piece.has_right);
}

// Of what the user chooses, and of pairs that were mended; paths as they are.
template <typename Fields>
void Describe(Fields& fields, Of<SequenceOptions> auto& opened) {
  fields.Value("cameras", opened.cameras);
  fields.Value("calibration", opened.calibration);
  fields.Value("masks", opened.masks);
  fields.Value("pair_tolerance_s", opened.max_stereo_offset_s);
  fields.Value("right_offset_s", opened.right_offset_s);
  fields.SaidList("pieces", opened.pieces);
  fields.Said("topics", opened.topics);
  fields.Said("right_stamped_later_s", opened.right_stamped_later_s);
  fields.Said("others_stamped_later_s", opened.others_stamped_later_s);
}

inline Json OpenedJson(const SequenceOptions& opened) { return JsonWriter::Write(opened); }

// Of the object that holds it; the default of one by an earlier version, which does not.
inline SequenceOptions ParseOpened(const Json& holder) {
  if (!holder.contains("opened")) return {};
  return JsonReader::Read<SequenceOptions>("opened", holder.at("opened"));
}

}  // namespace slcmap::data
