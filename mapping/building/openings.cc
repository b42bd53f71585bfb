#include "mapping/building/openings.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "data/core/math.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr double kSnap_m = 0.05;  // to a line, or by 2 sigma of it

constexpr double kFloorGap_m = 0.45;   // beneath a door, where little is seen
constexpr double kFloorEnds_m = 0.15;  // so far from floor and top, rays to these end at a face too
constexpr double kLeastDoor_m = 1.7;   // height
constexpr double kWidestDoor_m = 1.9;
constexpr double kJamb_m = 0.3;        // beside an opening, where its wall must have been measured
constexpr double kReveal_m = 0.25;     // of lines at an opening from the plane of the face
constexpr double kUpright = 0.98;      // cosine
constexpr double kLongestStep_m = 2;   // of a walk: from one run to the next nobody walked
constexpr double kBar_m = 0.15;        // between panes of one window, at most
constexpr double kPaneAlong = 0.5;     // of the shorter of two panes, beside the other
constexpr double kLeastFilled = 0.55;  // of an opening's rectangle by cells that were passed

// Cells that were passed, without gaps and single cells.
cv::Mat1b PassedMask(const FaceGrid& grid) {
  cv::Mat1b passed(grid.rows(), grid.columns(), uchar{0}), hit = passed.clone();
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      if (grid.IsPassed(row, column)) passed(row, column) = 255;
      if (grid.IsHit(row, column)) hit(row, column) = 255;
    }
  }
  const cv::Mat kernel = cv::Mat::ones(5, 5, CV_8U);
  // A border of nothing: closing must not reach over the edge of the grid.
  cv::Mat1b wide;
  cv::copyMakeBorder(passed, wide, 4, 4, 4, 4, cv::BORDER_CONSTANT, 0);
  cv::morphologyEx(wide, wide, cv::MORPH_CLOSE, kernel);
  wide(cv::Rect(4, 4, grid.columns(), grid.rows())).copyTo(passed);
  passed.setTo(0, hit);
  cv::morphologyEx(passed, passed, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U), {-1, -1}, 1,
                   cv::BORDER_REPLICATE);
  return passed;
}

// The first and the last of the sums along one side that are at least half of the usual large one.
std::pair<int, int> FindCore(const std::vector<int>& sums) {
  std::vector<int> sorted = sums;
  std::sort(sorted.begin(), sorted.end());
  const int least = std::max(1, sorted[sorted.size() * 8 / 10] / 2);
  int first = 0, last = static_cast<int>(sums.size()) - 1;
  while (first < last && sums[first] < least) ++first;
  while (last > first && sums[last] < least) --last;
  return {first, last};
}

// The rectangle of most of a region, in cells.
std::optional<cv::Rect> FindCore(const cv::Mat1i& labels, int label, const cv::Rect& box) {
  std::vector<int> across(box.width, 0), up(box.height, 0);
  for (int row = 0; row < box.height; ++row) {
    for (int column = 0; column < box.width; ++column) {
      if (labels(box.y + row, box.x + column) != label) continue;
      ++across[column];
      ++up[row];
    }
  }
  const auto [left, right] = FindCore(across);
  const auto [bottom, top] = FindCore(up);
  const cv::Rect core(box.x + left, box.y + bottom, right - left + 1, top - bottom + 1);
  int filled = 0;
  for (int row = core.y; row < core.y + core.height; ++row) {
    for (int column = core.x; column < core.x + core.width; ++column) {
      filled += labels(row, column) == label ? 1 : 0;
    }
  }
  if (filled < kLeastFilled * core.area()) return std::nullopt;
  return core;
}

bool AnyHit(const FaceGrid& grid, int first_column, int last_column, int first_row, int last_row) {
  for (int column = std::max(0, first_column); column <= std::min(grid.columns() - 1, last_column);
       ++column) {
    for (int row = std::max(0, first_row); row <= std::min(grid.rows() - 1, last_row); ++row) {
      if (grid.IsHit(row, column)) return true;
    }
  }
  return false;
}

// Whether something was measured in a strip of cells; single rays may end wrongly.
bool IsHitAlong(const FaceGrid& grid, const cv::Rect& strip) {
  cv::Mat hit;
  cv::compare(grid.support(strip), grid.passes(strip), hit, cv::CMP_GT);
  return 4 * cv::countNonZero(hit) > strip.area();
}

// Whether rays end in a strip of cells, or points lie there.
bool IsHeld(const FaceGrid& grid, const cv::Rect& strip) {
  const cv::Mat ends = grid.support(strip) + grid.hits(strip);
  return 4 * cv::countNonZero(ends > grid.passes(strip)) > strip.area();
}

// Down to the floor through what nobody looked at, as a camera that walks past sees of passages.
// What stands there, or a sill, leaves it as it is.
void GrowToFloor(const FaceGrid& grid, cv::Rect* core) {
  constexpr double kLeastSill_m = 0.85;  // that a window needs no proof of
  if (core->y * grid.cell_m >= kLeastSill_m) return;
  for (int row = core->y - 1; row * grid.cell_m >= kFloorEnds_m; --row) {
    if (IsHeld(grid, {core->x, row, core->width, 1})) return;
  }
  core->height += core->y;
  core->y = 0;
}

// From the floor up through what nobody looked at, as a camera that looks down sees of doors: up to
// what is over it, or as high as doors are; to the top where rays pass over it and hardly any end
// there. What is lower than a table is no door.
void GrowUnseen(const FaceGrid& grid, cv::Rect* core) {
  constexpr double kUsualDoor_m = 2.1, kTable_m = 0.9;
  const int top = core->y + core->height;
  if (core->y * grid.cell_m > kFloorGap_m || top * grid.cell_m < kTable_m) return;
  const int most = std::min(grid.rows(), static_cast<int>(std::lround(kUsualDoor_m / grid.cell_m)));
  while (core->y + core->height < most &&
         !IsHitAlong(grid, {core->x, core->y + core->height, core->width, 1})) {
    ++core->height;
  }
  const int reached = core->y + core->height;
  const int last = grid.rows() - static_cast<int>(std::lround(kFloorEnds_m / grid.cell_m));
  if (reached >= last) return;
  const cv::Rect over(core->x, reached, core->width, last - reached);
  for (int row = over.y; row < last; ++row) {
    if (IsHeld(grid, {over.x, row, over.width, 1})) return;
  }
  constexpr double kLeastPassed = 10;  // rays; a few may end wrongly
  const double passed = cv::sum(grid.passes(over))[0];
  const double ended = cv::sum(grid.support(over))[0] + cv::sum(grid.hits(over))[0];
  if (passed >= kLeastPassed && passed > ended) core->height = grid.rows() - core->y;
}

// How many columns there are from one on to the wall beside an opening; 0 where it is far.
int CountToJamb(const FaceGrid& grid, const cv::Rect& core, int column, int step) {
  const int reach = static_cast<int>(std::lround(kJamb_m / grid.cell_m));
  for (int count = 0; count <= reach; ++count, column += step) {
    if (column < 0 || column >= grid.columns()) return 0;
    if (IsHitAlong(grid, {column, core.y, 1, core.height})) return count;
  }
  return 0;
}

// What reaches the floor, up to the wall beside it, where nothing was measured between: leaves and
// frames hide it.
void GrowToJambs(const FaceGrid& grid, cv::Rect* core) {
  if (core->y * grid.cell_m > kFloorGap_m) return;
  const int left = CountToJamb(grid, *core, core->x - 1, -1);
  const int right = CountToJamb(grid, *core, core->x + core->width, 1);
  core->x -= left;
  core->width += left + right;
}

// Whether something was measured beside it on both sides.
bool IsFramed(const FaceGrid& grid, const cv::Rect& core) {
  const int reach = static_cast<int>(std::lround(kJamb_m / grid.cell_m));
  const int top = grid.rows() - 1;
  return AnyHit(grid, core.x - reach, core.x - 1, 0, top) &&
         AnyHit(grid, core.x + core.width, core.x + core.width + reach - 1, 0, top);
}

// What a line says of an edge: where it is along the face, or how high.
struct EdgeLine {
  bool is_upright;
  double at_m, sigma_m;
  double from_m, to_m;  // its extent, along the other direction
};

std::vector<EdgeLine> LinesNear(const Face& face, const std::vector<MapLine>& lines) {
  std::vector<EdgeLine> near;
  for (const MapLine& line : lines) {
    const Vector3d &a = line.start_world, &b = line.end_world;
    if (std::abs(face.DistanceTo(a.head<2>())) > kReveal_m ||
        std::abs(face.DistanceTo(b.head<2>())) > kReveal_m) {
      continue;
    }
    const Vector3d direction = (b - a).normalized();
    const double s = face.MeasureAlong(a.head<2>()), t = face.MeasureAlong(b.head<2>());
    if (std::abs(direction.z()) > kUpright) {
      near.push_back(
          {true, 0.5 * (s + t), line.sigma_m, std::min(a.z(), b.z()), std::max(a.z(), b.z())});
    } else if (std::abs(face.Along().dot(direction.head<2>())) > kUpright) {
      near.push_back({false, 0.5 * (a.z() + b.z()), line.sigma_m, std::min(s, t), std::max(s, t)});
    }
  }
  return near;
}

// An edge of an opening: of its sides, or of its top and bottom.
struct OpeningEdge {
  bool is_upright;
  double at_m;          // as the grid has it
  double from_m, to_m;  // its extent, along the other direction
  int outward;          // 1 or -1
};

// The place of the nearest line beside an edge of the grid that runs along enough of it. Few rays
// go through an opening right beside its frame, or a leaf that stands open there: farther outward,
// what runs along most of it is its frame, too.
double Snapped(const std::vector<EdgeLine>& lines, const OpeningEdge& edge, double snap_m) {
  constexpr double kFrameReach_m = 0.2, kAlong = 0.3, kFrameAlong = 0.6;
  double best_m = edge.at_m, least_m = 1e9;
  for (const EdgeLine& line : lines) {
    if (line.is_upright != edge.is_upright) continue;
    const double distance_m = std::abs(line.at_m - edge.at_m);
    const double overlap_m = std::min(line.to_m, edge.to_m) - std::max(line.from_m, edge.from_m);
    const double along = overlap_m / (edge.to_m - edge.from_m);
    const bool is_near = distance_m <= std::max(2 * line.sigma_m, snap_m) && along >= kAlong;
    const double out_m = edge.outward * (line.at_m - edge.at_m);
    const bool is_frame = out_m > 0 && out_m <= kFrameReach_m && along >= kFrameAlong;
    if ((!is_near && !is_frame) || distance_m >= least_m) continue;
    least_m = distance_m;
    best_m = line.at_m;
  }
  return best_m;
}

void SnapEdges(const std::vector<EdgeLine>& lines, double snap_m, FaceOpening* opening) {
  const FaceOpening grid = *opening;
  const auto side = [&](double at_m, int outward) {
    return Snapped(lines, {true, at_m, grid.low_m, grid.high_m, outward}, snap_m);
  };
  const auto level = [&](double at_m, int outward) {
    return Snapped(lines, {false, at_m, grid.from_m, grid.to_m, outward}, snap_m);
  };
  opening->from_m = side(grid.from_m, -1);
  opening->to_m = side(grid.to_m, 1);
  opening->high_m = level(grid.high_m, 1);
  if (opening->kind == OpeningKind::kWindow) opening->low_m = level(grid.low_m, -1);
}

bool IsWalked(const Face& face, const FaceOpening& opening,
              const std::vector<Vector3d>& trajectory) {
  for (size_t i = 1; i < trajectory.size(); ++i) {
    const Vector3d &a = trajectory[i - 1], &b = trajectory[i];
    if ((b - a).norm() > kLongestStep_m) continue;
    const double before = face.DistanceTo(a.head<2>()), after = face.DistanceTo(b.head<2>());
    if (before * after >= 0) continue;
    const Vector3d at = a + before / (before - after) * (b - a);
    const double along_m = face.MeasureAlong(at.head<2>());
    if (along_m > opening.from_m && along_m < opening.to_m && at.z() > opening.low_m &&
        at.z() < opening.high_m + kLintel_m) {
      return true;
    }
  }
  return false;
}

void SetKind(const Level& level, FaceOpening* opening) {
  const bool from_floor = opening->low_m < level.floor_m + kFloorGap_m || opening->walked;
  if (!from_floor || (!opening->walked && opening->high_m - level.floor_m < kLeastDoor_m)) {
    opening->kind = OpeningKind::kWindow;
    return;
  }
  opening->low_m = level.floor_m;
  const bool has_lintel = opening->high_m < level.top_m - kLintel_m;
  const bool is_wide = opening->to_m - opening->from_m > kWidestDoor_m;
  opening->kind = has_lintel && !is_wide ? OpeningKind::kDoor : OpeningKind::kPassage;
}

Interval MeasureAlong(const FaceOpening& opening) { return {opening.from_m, opening.to_m}; }
Interval CollectHeights(const FaceOpening& opening) { return {opening.low_m, opening.high_m}; }

// Whether two openings lie beside or above each other with no more than a bar between them.
bool ArePanes(const FaceOpening& a, const FaceOpening& b) {
  const auto share = [](const Interval& one, const Interval& other) {
    return Common(one, other).length_m() / std::min(one.length_m(), other.length_m());
  };
  const Interval a_along = MeasureAlong(a), b_along = MeasureAlong(b);
  const Interval a_up = CollectHeights(a), b_up = CollectHeights(b);
  if (Common(a_along, b_along).length_m() < -kBar_m) return false;
  if (Common(a_up, b_up).length_m() < -kBar_m) return false;
  return share(a_along, b_along) >= kPaneAlong || share(a_up, b_up) >= kPaneAlong;
}

FaceOpening Joined(const FaceOpening& window, const FaceOpening& pane) {
  FaceOpening joined = window;
  joined.from_m = std::min(window.from_m, pane.from_m);
  joined.to_m = std::max(window.to_m, pane.to_m);
  joined.low_m = std::min(window.low_m, pane.low_m);
  joined.high_m = std::max(window.high_m, pane.high_m);
  return joined;
}

// Two panes of one window, with no door between them.
bool AreOneWindow(const FaceOpening& a, const FaceOpening& b,
                  const std::vector<FaceOpening>& openings) {
  const auto is_window = [](const FaceOpening& o) { return o.kind == OpeningKind::kWindow; };
  if (!is_window(a) || !is_window(b) || !ArePanes(a, b)) return false;
  const FaceOpening joined = Joined(a, b);
  return std::none_of(openings.begin(), openings.end(), [&](const FaceOpening& other) {
    return !is_window(other) && Common(MeasureAlong(joined), MeasureAlong(other)).length_m() > 0;
  });
}

// A window may be divided by bars.
void JoinPanes(std::vector<FaceOpening>* openings) {
  for (size_t i = 0; i < openings->size(); ++i) {
    for (size_t k = i + 1; k < openings->size(); ++k) {
      if (!AreOneWindow((*openings)[i], (*openings)[k], *openings)) continue;
      (*openings)[i] = Joined((*openings)[i], (*openings)[k]);
      openings->erase(openings->begin() + static_cast<std::ptrdiff_t>(k));
      i = k = 0;  // it has grown
    }
  }
}

// As the grid has it; none where too little of the region is a rectangle, or nothing is beside it.
std::optional<FaceOpening> MakeOpening(const FaceGrid& grid, const cv::Mat1i& labels, int label,
                                       const cv::Rect& box) {
  auto core = FindCore(labels, label, box);
  if (!core) return std::nullopt;
  GrowToFloor(grid, &*core);
  GrowUnseen(grid, &*core);
  GrowToJambs(grid, &*core);
  if (core->width * grid.cell_m < kBuildingMinOpening_m ||
      core->height * grid.cell_m < kBuildingMinOpening_m || !IsFramed(grid, *core)) {
    return std::nullopt;
  }
  FaceOpening opening;
  opening.from_m = grid.from_m + core->x * grid.cell_m;
  opening.to_m = opening.from_m + core->width * grid.cell_m;
  opening.low_m = grid.low_m + core->y * grid.cell_m;
  opening.high_m = opening.low_m + core->height * grid.cell_m;
  return opening;
}

}  // namespace

std::vector<FaceOpening> FindOpenings(const Face& face, const FaceGrid& grid, const Level& level,
                                      const BuildingInput& input) {
  cv::Mat1i labels, stats;
  cv::Mat1d middles;
  const int count =
      cv::connectedComponentsWithStats(PassedMask(grid), labels, stats, middles, 4, CV_32S);
  std::vector<FaceOpening> openings;
  for (int label = 1; label < count; ++label) {
    const cv::Rect box(stats(label, cv::CC_STAT_LEFT), stats(label, cv::CC_STAT_TOP),
                       stats(label, cv::CC_STAT_WIDTH), stats(label, cv::CC_STAT_HEIGHT));
    auto opening = MakeOpening(grid, labels, label, box);
    if (!opening) continue;
    opening->walked = IsWalked(face, *opening, input.trajectory_world);
    SetKind(level, &*opening);
    openings.push_back(*opening);
  }
  JoinPanes(&openings);
  const std::vector<EdgeLine> lines = LinesNear(face, input.lines);
  for (FaceOpening& opening : openings) SnapEdges(lines, kSnap_m, &opening);
  std::sort(openings.begin(), openings.end(), [](const FaceOpening& a, const FaceOpening& b) {
    return a.from_m != b.from_m ? a.from_m < b.from_m : a.low_m < b.low_m;
  });
  return openings;
}

}  // namespace slcmap::mapping
