#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "data/core/error.h"
#include "export/sfm/model.h"
#include "export/web/cloud_tiles.h"
#include "export/web/page_writer.h"

namespace slcmap::inline exporting {
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

Place MakePlace(const Eigen::Vector3d& p_m, std::size_t index) {
  Place place{};
  place.index = index;
  for (int axis = 0; axis < 3; ++axis) {
    const double chunk = std::floor(p_m[axis] / kPageChunk_m);
    place.chunk[axis] = static_cast<int64_t>(chunk);
    place.steps[axis] =
        static_cast<uint16_t>(std::lround((p_m[axis] / kPageChunk_m - chunk) * kSteps));
  }
  place.morton = MortonCode(place.steps[0], place.steps[1], place.steps[2]);
  return place;
}

std::vector<Place> SortedPlaces(const MapResult& map, const Eigen::Vector3d& origin_world) {
  std::vector<Place> places;
  places.reserve(CountDense(map));
  for (std::size_t i = 0; i < CountDense(map); ++i) {
    places.push_back(MakePlace(DenseAt(map, i).p_world - origin_world, i));
  }
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.Key() < b.Key(); });
  return places;
}

void AddPoint(const Place& place, const MapResult& map, PagePoints* page) {
  const DensePoint& point = DenseAt(map, place.index);
  page->x.push_back(place.steps[0]);
  page->y.push_back(place.steps[1]);
  page->z.push_back(place.steps[2]);
  page->grey.push_back(point.grey);
  page->sigma.push_back(SigmaCode(point.sigma_m));
  page->source.push_back(IsFilled(map, place.index) ? 1 : 0);
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

PagePoints ChunkPoints(const MapResult& map, const Eigen::Vector3d& origin_world,
                       const Progress& progress) {
  progress.ReportOrStop(0);
  const std::vector<Place> places = SortedPlaces(map, origin_world);
  progress.ReportOrStop(0.8);
  PagePoints page;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i == 0 || places[i].chunk != places[i - 1].chunk) {
      page.chunks.push_back({ComputeCorner(places[i].chunk), i, 0});
    }
    ++page.chunks.back().count;
    AddPoint(places[i], map, &page);
  }
  return page;
}

namespace {

// Rectifies before it makes smaller, so that each pixel is a mean of those that it stands for.
std::string Jpeg(const cv::Mat& raw, const cv::Mat& map, const PageImageOptions& options) {
  cv::Mat image;
  cv::remap(raw, image, map, cv::noArray(), cv::INTER_LINEAR);
  const double scale = std::min(1.0, static_cast<double>(options.width_px) / image.cols);
  cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 75});
  return {bytes.begin(), bytes.end()};
}

[[noreturn]] void RefuseRecording(const MapResult& map, const SequenceSource& recording) {
  throw DataError(fmt::format(
      "{}: found none of the images of the map's {} keyframes that can be read, expected the "
      "recording that the map was made of",
      recording.info().name, map.keyframes.size()));
}

}  // namespace

std::vector<PageImage> ReadPageImages(const MapResult& map, const SequenceSource& recording,
                                      const PageImageOptions& options, const Progress& progress) {
  const cv::Mat rectifying = RectifyingMap(map.rectified_rig, recording.info().rig, 0);
  const auto most = static_cast<std::size_t>(options.most);
  const std::size_t step = std::max<std::size_t>(1, (map.keyframes.size() + most - 1) / most);
  std::vector<PageImage> images;
  for (std::size_t i = 0; i < map.keyframes.size(); i += step) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(map.keyframes.size()));
    const std::size_t at = ImageAt(recording.info().pair_stamps_ns, map.keyframes[i].stamp_ns);
    if (at == recording.info().pair_stamps_ns.size()) continue;
    const cv::Mat raw = recording.ReadImage(at, 0).image;
    if (!raw.empty()) images.push_back({i, Jpeg(raw, rectifying, options)});
  }
  if (images.empty() && !map.keyframes.empty()) RefuseRecording(map, recording);
  return images;
}

}  // namespace slcmap::exporting
