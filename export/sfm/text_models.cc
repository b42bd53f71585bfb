#include <spdlog/fmt/fmt.h>

#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "data/io/file.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"
#include "export/sfm/model.h"

namespace slcmap::inline exporting {
namespace {

std::string CamerasText(const Rig& rig) {
  std::string text = "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy, of rectified images\n";
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    if (!IsCalibrated(camera)) continue;
    text += fmt::format("{} PINHOLE {} {} {:.9f} {:.9f} {:.9f} {:.9f}\n", i + 1, camera.width_px,
                        camera.height_px, camera.fx_px, camera.fy_px,
                        camera.cx_px + kCornerOrigin_px, camera.cy_px + kCornerOrigin_px);
  }
  return text;
}

// A point in an image, and in a point's track: which image, and which of the points there.
struct PointInImage {
  Eigen::Vector2d px;
  std::size_t point;
};

std::vector<std::vector<PointInImage>> PointsInImages(const std::vector<ModelPoint>& points,
                                                      std::size_t images) {
  std::vector<std::vector<PointInImage>> seen(images);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const ModelObservation& sight : points[i].track)
      seen[sight.image].push_back({sight.px, i});
  }
  return seen;
}

// Two rows an image: its pose, world to camera, and the points that it shows.
std::string ImagesText(const std::vector<ModelImage>& images,
                       const std::vector<ModelPoint>& points) {
  const auto seen = PointsInImages(points, images.size());
  std::string text = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# X Y POINT3D_ID ...\n";
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ModelImage& image = images[i];
    const Eigen::Quaterniond& q = image.T_camera_world.rotation;
    const Eigen::Vector3d& t = image.T_camera_world.translation;
    fmt::format_to(out, "{} {:.12f} {:.12f} {:.12f} {:.12f} {:.9f} {:.9f} {:.9f} {} {}\n", image.id,
                   q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), image.camera + 1, image.name);
    const char* blank = "";
    for (const auto& [px, point] : seen[i]) {
      fmt::format_to(out, "{}{:.3f} {:.3f} {}", std::exchange(blank, " "),
                     px.x() + kCornerOrigin_px, px.y() + kCornerOrigin_px, point + 1);
    }
    text += "\n";
  }
  return text;
}

// Sights come in the order of points, as the points of each image do.
std::string PointsText(const std::vector<ModelPoint>& points,
                       const std::vector<ModelImage>& images) {
  std::vector<int> counts(images.size(), 0);  // of the points in each image so far
  std::string text = "# POINT3D_ID X Y Z R G B ERROR TRACK (IMAGE_ID POINT2D_IDX ...)\n";
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& p = points[i].p_world;
    fmt::format_to(out, "{} {:.6f} {:.6f} {:.6f} 128 128 128 ", i + 1, p.x(), p.y(), p.z());
    if (points[i].track.empty()) {
      text += "-1\n";
      continue;
    }
    fmt::format_to(out, "{:.4f}", points[i].error_px);
    for (const ModelObservation& sight : points[i].track) {
      fmt::format_to(out, " {} {}", images[sight.image].id, counts[sight.image]++);
    }
    text += "\n";
  }
  return text;
}

}  // namespace

std::vector<std::string> WriteColmap(const std::string& images, const RecordingOptions& recording,
                                     const std::string& folder, const MapResult& map,
                                     const Progress& progress) {
  const std::string model = folder + "/colmap";
  MakeFolder(model);
  WriteFile(model + "/cameras.txt", CamerasText(map.rectified_rig));
  const std::vector<ModelImage> of_model = ModelImages(map);
  const std::vector<ModelPoint> points = ModelPoints(map, of_model);
  progress.ReportOrStop(0.5);
  const std::string offset = GeoreferenceNote(map.source.georeference);
  WriteFile(model + "/images.txt",
            (offset.empty() ? "" : "# " + offset + "\n") + ImagesText(of_model, points));
  WriteFile(model + "/points3D.txt", PointsText(points, of_model));
  std::vector<std::string> paths = {model + "/cameras.txt", model + "/images.txt",
                                    model + "/points3D.txt"};
  if (!images.empty()) {
    const std::vector<std::string> written =
        WriteRectifiedImages(model + "/images", map, of_model, recording, progress.Part(0.6, 1));
    paths.insert(paths.end(), written.begin(), written.end());
  }
  return paths;
}

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

std::map<PieceKey, std::vector<Segment>> CollectSegments(const MapResult& map) {
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
  std::map<PieceKey, std::vector<Segment>> segments = CollectSegments(map);
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

std::vector<std::string> WriteLimap(const std::string& folder, const MapResult& map,
                                    const Progress& progress) {
  const std::string own = folder + "/limap";
  MakeFolder(own);
  const std::vector<Track> tracks = MakeTracks(map);
  WriteFile(own + "/alltracks.txt", TracksText(tracks));
  progress.ReportOrStop(0.5);
  WriteFile(own + "/lines.txt", RowsText(tracks));
  return {own + "/alltracks.txt", own + "/lines.txt"};
}

}  // namespace slcmap::exporting
