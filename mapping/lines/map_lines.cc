#include "mapping/lines/map_lines.h"

#include <algorithm>
#include <iterator>
#include <opencv2/core/utility.hpp>

#include "mapping/lines/guided_pass.h"
#include "mapping/lines/line_finder.h"
#include "mapping/lines/line_kinds.h"
#include "mapping/lines/line_merging.h"
#include "mapping/lines/line_texture.h"
#include "mapping/lines/tracked_evidence.h"

namespace slcmap {
namespace {

// Shares of the time, about, up to the end of a step.
constexpr double kFound = 0.6, kLooked = 0.85, kLookedAgain = 0.95;

void AddMapLines(const TrackedLine& line, int64_t id, const std::vector<BuildingAxis>& axes,
                 const MapLineOptions& options, std::vector<MapLine>* map_lines) {
  MapLine piece;
  piece.id = id;
  piece.segment = line.segment;
  if (line.axis >= 0) {
    const BuildingAxis& axis = axes[line.axis];
    piece.axis = axis.axis;
    piece.world = axis.world;
    piece.deviation_rad =
        std::acos(std::min(1.0, std::abs(axis.direction_world.dot(line.line.direction_world))));
  }
  piece.sigma_m = line.fit.sigma_m();
  piece.deviation_sigma_rad =
      std::sqrt(line.fit.world_covariance.bottomRightCorner<2, 2>().trace() / 2);
  piece.observations = line.fit.views;
  piece.kind = KindOf(line, options.kinds);
  for (const Stretch& interval : line.intervals) {
    piece.start_world = line.line.point_world + interval.from_m * line.line.direction_world;
    piece.end_world = line.line.point_world + interval.to_m * line.line.direction_world;
    map_lines->push_back(piece);
  }
}

}  // namespace

std::vector<BuildingAxis> AxesOfViews(const Views& views, const ViewImages& images,
                                      const MapLineOptions& options, const Progress& progress) {
  const std::vector<BuildingAxis> none;
  LineFinder finder(views, images, none, options);
  std::vector<DirectedLine> directed;
  for (const TrackedLine& line : finder.Find({}, progress)) {
    directed.push_back({line.line.direction_world, line.seen.length_m(),
                        std::sqrt(line.fit.covariance.bottomRightCorner<2, 2>().trace() / 2)});
  }
  return FindAxes(directed);
}

BuiltLines BuildLines(const Views& views, const ViewImages& images,
                      const std::vector<BuildingAxis>& axes, std::vector<TrackedLine> known,
                      const SightDepths& sights, const LineSurfaces& surfaces,
                      const MapLineOptions& options, const Progress& progress) {
  std::vector<TrackedLine> lines =
      LineFinder(views, images, axes, options).Find(std::move(known), progress.Part(0, kFound));
  LookForLines(views, images, sights, options, &lines, progress.Part(kFound, kLooked));
  FitAgain(views, images.rig(), axes, options, &lines);
  LookAgain(views, images, sights, axes, options, &lines, progress.Part(kLooked, kLookedAgain));
  lines = MergeLines(std::move(lines), options.merging);
  cv::parallel_for_({0, static_cast<int>(lines.size())}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      lines[i].surfaces = surfaces.Beside(lines[i].line, lines[i].intervals);
    }
  });
  FitAmongNeighbours(views, images.rig(), axes, options, &lines);
  CountParallels(options.kinds.texture_reach_m, &lines);
  return {AsMapLines(lines, axes, options),
          EvidenceOf(lines, views, ViewCameras(views, images.rig()))};
}

std::vector<MapLine> AsMapLines(const std::vector<TrackedLine>& lines,
                                const std::vector<BuildingAxis>& axes,
                                const MapLineOptions& options) {
  std::vector<MapLine> map_lines;
  for (size_t i = 0; i < lines.size(); ++i) {
    AddMapLines(lines[i], static_cast<int64_t>(i), axes, options, &map_lines);
  }
  return map_lines;
}

std::vector<MapLine> TakeMarks(std::vector<MapLine>* lines) {
  const auto is_mark = [](const MapLine& line) { return line.kind == LineKind::kMark; };
  std::vector<MapLine> marks;
  std::copy_if(lines->begin(), lines->end(), std::back_inserter(marks), is_mark);
  std::erase_if(*lines, is_mark);
  return marks;
}

}  // namespace slcmap
