// A reader a format of maps by others. All throw DataError naming the file.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "data/external/external_map.h"

namespace slcmap::inline data {

// `path` is for messages; `bytes` is what stands in the file.
ExternalMap ReadPcd(const std::string& path, std::string_view bytes);
ExternalMap ReadLas(const std::string& path, std::string_view bytes);
ExternalMap ReadObj(const std::string& path, std::string_view bytes);
ExternalMap ReadDxf(const std::string& path, std::string_view bytes);

// The lines, points and faces of a DXF file of text, in metres where it says its units.
struct DxfLine {
  std::string layer;
  std::vector<Eigen::Vector3d> points;  // of a closed one the first stands at the end again
};
struct DxfDrawing {
  std::vector<DxfLine> lines;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<Eigen::Vector3d, 3>> triangles;
};
DxfDrawing ReadDxfDrawing(const std::string& path, std::string_view bytes);

// Rows of numbers, and what the rows look like tells whose they are.
ExternalMap ReadMapText(const std::string& path, std::string_view bytes);

// One of limap's track files: its first row is the line.
void AddTrack(const std::string& path, ExternalMap* map);

// Adds a point where it is finite, else counts it.
void AddPoint(const Eigen::Vector3d& p, ExternalMap* map);

// Of coordinates of single precision that are as large as that.
inline double GetFloatStep(double largest) {
  const auto at = static_cast<float>(largest);
  return std::nextafter(at, HUGE_VALF) - at;
}

// Calls handle(row number from 1, row) for each row, without its end.
template <typename Handler>
void ForEachTextRow(std::string_view bytes, Handler handle) {
  int row = 0;
  for (size_t from = 0; from < bytes.size();) {
    const size_t end = std::min(bytes.find('\n', from), bytes.size());
    std::string_view text = bytes.substr(from, end - from);
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    handle(++row, text);
    from = end + 1;
  }
}

}  // namespace slcmap::data
