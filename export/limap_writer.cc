#include "export/limap_writer.h"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <set>
#include <utility>

#include "data/file.h"
#include "export/model_images.h"

namespace slcmap {
namespace {

// A line's segment in an image, numbered as the image's first, second, ...
struct Segment {
  int image_id = 0, number = 0;
  LineSegment px;
};

// A piece of a line, and the segments that support it.
struct Track {
  Eigen::Vector3d start_world, end_world;
  std::vector<Segment> segments;
};

using PieceKey = std::pair<int64_t, int>;  // line and piece

std::map<PieceKey, std::vector<Segment>> SegmentsOf(const MapResult& map) {
  std::map<std::pair<int64_t, int>, int> ids;  // of images, by stamp and camera
  for (const ModelImage& image : ModelImages(map)) ids[{image.stamp_ns, image.camera}] = image.id;
  std::map<int, int> counts;  // of the segments in each image
  std::map<PieceKey, std::vector<Segment>> segments;
  const Eigen::Vector2d corner(kCornerOrigin_px, kCornerOrigin_px);
  for (const LineSupport& support : map.line_evidence.supports) {
    const auto image = ids.find({support.stamp_ns, support.camera});
    if (image == ids.end()) continue;
    const int id = image->second;
    segments[{support.line_id, support.piece}].push_back(
        {id, counts[id]++, {support.px.start + corner, support.px.end + corner}});
  }
  return segments;
}

std::vector<Track> MakeTracks(const MapResult& map) {
  std::map<PieceKey, std::vector<Segment>> segments = SegmentsOf(map);
  std::map<int64_t, int> pieces;  // of each line, so far
  std::vector<Track> tracks;
  for (const MapLine& line : map.lines) {
    tracks.push_back(
        {line.start_world, line.end_world, std::move(segments[{line.id, pieces[line.id]++}])});
  }
  return tracks;
}

std::string Numbers(const Eigen::Vector3d& p) {
  return fmt::format("{:.10f} {:.10f} {:.10f}", p.x(), p.y(), p.z());
}

std::size_t CountImages(const Track& track) {
  std::set<int> images;
  for (const Segment& segment : track.segments) images.insert(segment.image_id);
  return images.size();
}

// Tracks count from 0 in the order of the map's lines.
std::string TracksText(const std::vector<Track>& tracks) {
  std::string text = fmt::format("{}\n", tracks.size());
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    std::string images, numbers;
    for (const Segment& segment : track.segments) {
      images += fmt::format("{} ", segment.image_id);
      numbers += fmt::format("{} ", segment.number);
    }
    text += fmt::format("{} {} {}\n{}\n{}\n{}\n{}\n", i, track.segments.size(), CountImages(track),
                        Numbers(track.start_world), Numbers(track.end_world), images, numbers);
  }
  return text;
}

// A row: the number of its segments in space, their ends, the number of its supports, and of each
// the image, its number there, and its ends.
std::string RowsText(const std::vector<Track>& tracks) {
  std::string text;
  for (const Track& track : tracks) {
    text += fmt::format("1 {} {} {}", Numbers(track.start_world), Numbers(track.end_world),
                        track.segments.size());
    for (const auto& [image_id, number, px] : track.segments) {
      text += fmt::format(" {} {} {:.2f} {:.2f} {:.2f} {:.2f}", image_id, number, px.start.x(),
                          px.start.y(), px.end.x(), px.end.y());
    }
    text += "\n";
  }
  return text;
}

}  // namespace

std::vector<std::string> LimapWriter::Write(const std::string& folder, const MapResult& map,
                                            const Progress& progress) const {
  const std::string own = folder + "/limap";
  MakeFolder(own);
  const std::vector<Track> tracks = MakeTracks(map);
  WriteFile(own + "/alltracks.txt", TracksText(tracks));
  progress.ReportOrStop(0.5);
  WriteFile(own + "/lines.txt", RowsText(tracks));
  progress.ReportOrStop(1);
  return {own + "/alltracks.txt", own + "/lines.txt"};
}

}  // namespace slcmap
