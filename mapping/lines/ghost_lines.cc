#include "mapping/lines/ghost_lines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "mapping/lines/line_in_view.h"
#include "mapping/lines/line_kinds.h"

namespace slcmap {
namespace {

constexpr double kNear_px = 1.5, kBeyondEnd_px = 2;  // of a place from the image of a line
constexpr double kTurned = 0.2;                      // sine, of an edge from it
constexpr double kBeyond_m = 0.05;                   // of a line's intervals

// From elsewhere it may not be there.
bool IsSeenInOnePlane(const TrackedLine& line, const MapLineOptions& options) {
  return line.parallax_rad < options.min_parallax_rad &&
         !IsKnownBeside(line.surfaces, options.kinds);
}

bool IsOn(const LineSegment& px, const EdgePlace& place) {
  const double length_px = px.Length();
  if (length_px <= 0) return false;
  const Eigen::Vector2d along = (px.end - px.start) / length_px, off = place.px - px.start;
  const double along_px = along.dot(off);
  return along_px >= -kBeyondEnd_px && along_px <= length_px + kBeyondEnd_px &&
         std::abs(along.x() * off.y() - along.y() * off.x()) <= kNear_px &&
         std::abs(along.dot(place.normal)) <= kTurned;
}

// Places of a line in one image, and whether another line's edge is there.
struct PlacesInImage {
  std::vector<const EdgePlace*> places;
  std::vector<char> explained;
};

using ImageKey = std::pair<int, int>;  // view and camera

std::map<ImageKey, PlacesInImage> PlacesOfImages(const TrackedLine& line) {
  std::map<ImageKey, PlacesInImage> images;
  for (const EdgePlace& place : line.places) {
    PlacesInImage& image = images[{place.view, place.camera}];
    image.places.push_back(&place);
    image.explained.push_back(0);
  }
  return images;
}

void Explain(const TrackedLine& other, const ViewCameras& views, const MapLineOptions& options,
             const ImageKey& key, PlacesInImage* image) {
  const auto [view, camera] = key;
  for (const Stretch& interval : other.intervals) {
    const auto part = SeenPart(other.line, {interval.from_m - kBeyond_m, interval.to_m + kBeyond_m},
                               views.T_camera_world[view][camera], views.cameras[camera],
                               {.max_depth_m = options.max_depth_m});
    if (!part) continue;
    for (size_t i = 0; i < image->places.size(); ++i) {
      if (IsOn(part->px, *image->places[i])) image->explained[i] = 1;
    }
  }
}

double ShareExplained(const TrackedLine& line, const std::vector<const TrackedLine*>& others,
                      const ViewCameras& views, const MapLineOptions& options) {
  double explained = 0;
  std::map<ImageKey, PlacesInImage> images = PlacesOfImages(line);
  for (auto& [key, image] : images) {
    for (const TrackedLine* other : others) {
      if (other->segment == line.segment) Explain(*other, views, options, key, &image);
    }
    explained += static_cast<double>(std::ranges::count(image.explained, 1));
  }
  return line.places.empty() ? 0 : explained / static_cast<double>(line.places.size());
}

}  // namespace

void DropGhosts(const ViewCameras& views, const MapLineOptions& options,
                std::vector<TrackedLine>* lines) {
  std::vector<const TrackedLine*> others;
  for (const TrackedLine& line : *lines) {
    if (!IsSeenInOnePlane(line, options)) others.push_back(&line);
  }
  std::vector<char> is_ghost;
  for (const TrackedLine& line : *lines) {
    is_ghost.push_back(IsSeenInOnePlane(line, options) &&
                       ShareExplained(line, others, views, options) >= options.min_ghost_share);
  }
  std::vector<TrackedLine> kept;
  for (size_t i = 0; i < lines->size(); ++i) {
    if (!is_ghost[i]) kept.push_back(std::move((*lines)[i]));
  }
  *lines = std::move(kept);
}

}  // namespace slcmap
