#include "export/page_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace slcmap {
namespace {

constexpr double kSteps = 65535;  // of a coordinate across a chunk

// Where a point is, in the order in which points are kept.
struct Place {
  std::array<int64_t, 3> chunk;
  uint64_t morton;
  std::array<uint16_t, 3> steps;
  std::size_t index;

  auto Key() const { return std::tie(chunk, morton, index); }
};

// The bits of a number with two zeros behind each.
uint64_t Spread(uint16_t value) {
  uint64_t spread = 0;
  for (int bit = 0; bit < 16; ++bit) {
    spread |= static_cast<uint64_t>((value >> bit) & 1) << (3 * bit);
  }
  return spread;
}

Place MakePlace(const Eigen::Vector3d& p_m, std::size_t index) {
  Place place{};
  place.index = index;
  for (int axis = 0; axis < 3; ++axis) {
    const double chunk = std::floor(p_m[axis] / kPageChunk_m);
    place.chunk[axis] = static_cast<int64_t>(chunk);
    place.steps[axis] =
        static_cast<uint16_t>(std::lround((p_m[axis] / kPageChunk_m - chunk) * kSteps));
    place.morton |= Spread(place.steps[axis]) << axis;
  }
  return place;
}

std::vector<Place> SortedPlaces(const std::vector<DensePoint>& points,
                                const Eigen::Vector3d& origin_world) {
  std::vector<Place> places;
  places.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    places.push_back(MakePlace(points[i].p_world - origin_world, i));
  }
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.Key() < b.Key(); });
  return places;
}

void AddPoint(const Place& place, const DensePoint& point, PagePoints* page) {
  page->x.push_back(place.steps[0]);
  page->y.push_back(place.steps[1]);
  page->z.push_back(place.steps[2]);
  page->grey.push_back(point.grey);
  page->sigma.push_back(SigmaCode(point.sigma_m));
  page->source.push_back(static_cast<uint8_t>(point.source));
}

Eigen::Vector3d ComputeCorner(const std::array<int64_t, 3>& chunk) {
  return kPageChunk_m * Eigen::Vector3d(static_cast<double>(chunk[0]),
                                        static_cast<double>(chunk[1]),
                                        static_cast<double>(chunk[2]));
}

}  // namespace

uint8_t SigmaCode(double sigma_m) {
  constexpr double kSmallest_m = 1e-4, kPerOctave = 16;
  const double code = kPerOctave * std::log2(std::max(sigma_m, kSmallest_m) / kSmallest_m);
  return static_cast<uint8_t>(std::lround(std::min(code, 255.0)));
}

PagePoints ChunkPoints(const std::vector<DensePoint>& points, const Eigen::Vector3d& origin_world,
                       const Progress& progress) {
  progress.ReportOrStop(0);
  const std::vector<Place> places = SortedPlaces(points, origin_world);
  progress.ReportOrStop(0.8);
  PagePoints page;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i == 0 || places[i].chunk != places[i - 1].chunk) {
      page.chunks.push_back({ComputeCorner(places[i].chunk), i, 0});
    }
    ++page.chunks.back().count;
    AddPoint(places[i], points[places[i].index], &page);
  }
  return page;
}

}  // namespace slcmap
