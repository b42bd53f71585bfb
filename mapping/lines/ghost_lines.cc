#include "mapping/lines/ghost_lines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "mapping/lines/line_kinds.h"

namespace slcmap {
namespace {

// Of the edges of two places in one image that are one: across and along them, and between their
// normals (cosine).
constexpr double kAcross_px = 1.5, kAlong_px = 20, kSameWay = 0.98;

// From elsewhere it may not be there.
bool MayBeGhost(const TrackedLine& line, const MapLineOptions& options) {
  return line.parallax_rad < options.min_parallax_rad &&
         !IsKnownBeside(line.surfaces, options.kinds);
}

bool AreOneEdge(const EdgePlace& a, const EdgePlace& b) {
  const Eigen::Vector2f off = a.px - b.px;
  return std::abs(a.normal.dot(b.normal)) >= kSameWay &&
         std::abs(a.normal.dot(off)) <= kAcross_px && off.norm() <= kAlong_px;
}

// What images show of some lines.
class ShownEdges {
 public:
  void Add(const TrackedLine& line) {
    for (const EdgePlace& place : line.places) by_image_[ImageOf(place)].push_back(&place);
  }

  // Of places; 0 of none.
  double ShareOf(const std::vector<EdgePlace>& places) const {
    const auto shown =
        std::ranges::count_if(places, [&](const EdgePlace& place) { return Has(place); });
    return static_cast<double>(shown) / std::max<double>(1, static_cast<double>(places.size()));
  }

 private:
  bool Has(const EdgePlace& place) const {
    const auto shown = by_image_.find(ImageOf(place));
    return shown != by_image_.end() &&
           std::ranges::any_of(shown->second,
                               [&](const EdgePlace* other) { return AreOneEdge(place, *other); });
  }

  static std::pair<int, int> ImageOf(const EdgePlace& place) { return {place.view, place.camera}; }

  std::map<std::pair<int, int>, std::vector<const EdgePlace*>> by_image_;
};

}  // namespace

void DropGhosts(const MapLineOptions& options, std::vector<TrackedLine>* lines) {
  ShownEdges others;
  for (const TrackedLine& line : *lines) {
    if (!MayBeGhost(line, options)) others.Add(line);
  }
  std::vector<char> is_ghost;
  for (const TrackedLine& line : *lines) {
    is_ghost.push_back(MayBeGhost(line, options) &&
                       others.ShareOf(line.places) >= options.min_ghost_share);
  }
  std::vector<TrackedLine> kept;
  for (size_t i = 0; i < lines->size(); ++i) {
    if (!is_ghost[i]) kept.push_back(std::move((*lines)[i]));
  }
  *lines = std::move(kept);
}

}  // namespace slcmap
