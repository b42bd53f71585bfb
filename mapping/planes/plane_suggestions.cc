#include "mapping/planes/plane_suggestions.h"

#include <algorithm>
#include <array>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "data/angle_unit.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int kHeadingBins = 180;       // of half a turn: a degree each
constexpr int kHeadingBlur = 2;         // bins
constexpr int kHeadingApart = 12;       // bins
constexpr double kHeadingShare = 0.03;  // of all upright surfaces, that a heading has
constexpr double kUprightSine = 0.2, kLevelCosine = 0.97;
constexpr double kFacing = 0.94;      // cosine between a point's normal and the plane's
constexpr double kLineTurn = 0.035;   // of a line against a plane that it is on
constexpr double kLevelSlope = 0.05;  // of level lines
constexpr double kBin_m = 0.01;
constexpr int kOffsetBlur = 2;  // bins
// Beside a plane, evidence of planes that face the same way is what noise left of it, or flat
// things on it.
constexpr double kShadow_m = 0.13;
constexpr double kLeastSigma_m = 0.005;
constexpr double kStray = 0.002;  // of the points, above and below the building

// A piece of what suggests planes, as large as a point of the dense cloud.
struct Evidence {
  Vector3d p = Vector3d::Zero();
  double n_m = 0;  // along the normal of the planes that are looked for
  double weight = 1;
};

bool IsLevelLine(const MapLine& line, double min_m) {
  const Vector3d way = line.end_world - line.start_world;
  return line.kind != LineKind::kMark && line.kind != LineKind::kPipe && way.norm() >= min_m &&
         std::abs(way.z()) < kLevelSlope * way.norm();
}

// The angle of a level direction in half a turn, in bins.
double BinOf(const Vector3d& normal) {
  const double angle = std::atan2(normal.y(), normal.x()) / kDegree;
  return std::fmod(angle + 360, kHeadingBins);
}

double BinsBetween(double a, double b) {
  const double d = std::abs(a - b);
  return std::min(d, kHeadingBins - d);
}

struct HeadingVote {
  double bin = 0, weight = 0;
  bool is_line = false;
};

std::vector<HeadingVote> HeadingVotes(const std::vector<DensePoint>& dense,
                                      const std::vector<MapLine>& lines, double voxel_m,
                                      const PlaneOptions& options) {
  std::vector<HeadingVote> votes;
  for (const DensePoint& point : dense) {
    if (std::abs(point.normal_world.z()) < kUprightSine) {
      votes.push_back({BinOf(point.normal_world), 1, false});
    }
  }
  for (const MapLine& line : lines) {
    if (!IsLevelLine(line, options.min_line_m)) continue;
    const Vector3d way = line.end_world - line.start_world;
    votes.push_back({BinOf({-way.y(), way.x(), 0}), way.norm() / voxel_m, true});
  }
  return votes;
}

// A heading as the lines have it, and where there are none, the points.
double MeanHeading(const std::vector<HeadingVote>& votes, double bin) {
  std::array<double, 2> sum{}, weight{};
  for (const HeadingVote& vote : votes) {
    double off = vote.bin - bin;
    off -= kHeadingBins * std::round(off / kHeadingBins);
    if (std::abs(off) > kHeadingBlur + 1) continue;
    sum[vote.is_line] += vote.weight * off;
    weight[vote.is_line] += vote.weight;
  }
  const int best = weight[1] > 0 ? 1 : 0;
  return (bin + sum[best] / weight[best]) * kDegree;
}

// Of the normals of upright planes, in half a turn.
std::vector<double> Headings(const std::vector<HeadingVote>& votes) {
  std::array<double, kHeadingBins> histogram{}, blurred{};
  double total = 0;
  for (const HeadingVote& vote : votes) {
    histogram[static_cast<int>(vote.bin) % kHeadingBins] += vote.weight;
    total += vote.weight;
  }
  for (int bin = 0; bin < kHeadingBins; ++bin) {
    for (int k = -kHeadingBlur; k <= kHeadingBlur; ++k) {
      blurred[bin] += histogram[(bin + k + kHeadingBins) % kHeadingBins];
    }
  }
  std::vector<double> headings;
  while (true) {
    const auto best = std::max_element(blurred.begin(), blurred.end());
    if (*best <= kHeadingShare * total) return headings;
    const auto bin = static_cast<double>(best - blurred.begin());
    headings.push_back(MeanHeading(votes, bin + 0.5));
    for (int k = 0; k < kHeadingBins; ++k) {
      if (BinsBetween(k, bin) <= kHeadingApart) blurred[k] = 0;
    }
  }
}

std::vector<Evidence> EvidenceFacing(const Vector3d& normal, const std::vector<DensePoint>& dense,
                                     const std::vector<MapLine>& lines, double voxel_m,
                                     const PlaneOptions& options) {
  std::vector<Evidence> evidence;
  for (const DensePoint& point : dense) {
    if (point.normal_world.dot(normal) < kFacing) continue;
    evidence.push_back({point.p_world, normal.dot(point.p_world), 1});
  }
  if (std::abs(normal.z()) > 0.5) return evidence;
  // A line is known better than a point and says as much as all points of a plane that ends at it.
  const double weight = options.min_surface_m2 / (voxel_m * options.min_line_m);
  for (const MapLine& line : lines) {
    if (!IsLevelLine(line, options.min_line_m)) continue;
    const Vector3d way = line.end_world - line.start_world;
    if (std::abs(way.normalized().dot(normal)) > kLineTurn) continue;
    const int count = static_cast<int>(std::ceil(way.norm() / voxel_m));
    for (int i = 0; i < count; ++i) {
      const Vector3d p = line.start_world + (i + 0.5) / count * way;
      evidence.push_back({p, normal.dot(p), weight});
    }
  }
  return evidence;
}

// The offset that most evidence has; nothing where that is less than `least`.
std::optional<double> StrongestOffset(const std::vector<Evidence>& evidence, double least) {
  std::map<int, double> histogram;
  for (const Evidence& piece : evidence) {
    histogram[static_cast<int>(std::floor(piece.n_m / kBin_m))] += piece.weight;
  }
  double most = 0, best_m = 0;
  for (const auto& [bin, unused] : histogram) {
    double here = 0;
    for (auto other = histogram.lower_bound(bin - kOffsetBlur);
         other != histogram.end() && other->first <= bin + kOffsetBlur; ++other) {
      here += other->second;
    }
    if (here <= most) continue;
    most = here;
    best_m = (bin + 0.5) * kBin_m;
  }
  return most < least ? std::nullopt : std::optional(best_m);
}

struct Box {
  double low_z_m = 0, high_z_m = 0;
};

// The heights between which a building was measured.
Box HeightsOf(const std::vector<DensePoint>& dense) {
  std::vector<double> heights;
  for (const DensePoint& point : dense) heights.push_back(point.p_world.z());
  std::sort(heights.begin(), heights.end());
  const auto stray = static_cast<size_t>(kStray * static_cast<double>(heights.size()));
  return {heights[stray], heights[heights.size() - 1 - stray]};
}

// Splits what lies on one plane into parts that are far from each other, each with its own offset.
class PlaneSplitter {
 public:
  PlaneSplitter(const Vector3d& normal, const Box& heights, double least,
                const PlaneOptions& options)
      : heights_(heights), least_(least), options_(options) {
    frame_.normal = normal;
    const bool is_upright = std::abs(normal.z()) < 0.5;
    frame_.u = is_upright ? Vector3d(-normal.y(), normal.x(), 0) : Vector3d(Vector3d::UnitX());
    frame_.v = normal.cross(frame_.u);
    frame_.cell_m = options.cell_m;
    reach_u_ = Cells(options.reach_m);
    reach_v_ = Cells(is_upright ? options.height_m : options.reach_m);
  }

  void AddPlanes(double offset_m, const std::vector<Evidence>& evidence,
                 std::vector<SuggestedPlane>* planes) const {
    PlaneGrid grid = Around(evidence);
    cv::Mat1b seeds = cv::Mat1b::zeros(grid.rows, grid.columns);
    for (const Evidence& piece : evidence) seeds(grid.RowOf(piece.p), grid.ColumnOf(piece.p)) = 255;
    cv::Mat1b near;
    const cv::Size reach(2 * reach_u_ + 1, 2 * reach_v_ + 1);
    cv::dilate(seeds, near, cv::getStructuringElement(cv::MORPH_RECT, reach));
    cv::Mat1i labels;
    const int count = cv::connectedComponents(near, labels, 4, CV_32S);
    std::vector<double> weights(count, 0), sums(count, 0), squares(count, 0);
    for (const Evidence& piece : evidence) {
      const int label = labels(grid.RowOf(piece.p), grid.ColumnOf(piece.p));
      weights[label] += piece.weight;
      sums[label] += piece.weight * (piece.n_m - offset_m);
      squares[label] += piece.weight * std::pow(piece.n_m - offset_m, 2);
    }
    for (int label = 1; label < count; ++label) {
      if (weights[label] < least_) continue;
      const double mean_m = sums[label] / weights[label];
      grid.offset_m = offset_m + mean_m;
      SuggestedPlane plane = Cropped(grid, labels == label);
      plane.weight = weights[label];
      plane.sigma_m = std::sqrt(std::max(squares[label] / weights[label] - mean_m * mean_m,
                                         kLeastSigma_m * kLeastSigma_m));
      planes->push_back(std::move(plane));
    }
  }

 private:
  int Cells(double length_m) const {
    return static_cast<int>(std::lround(length_m / options_.cell_m));
  }

  PlaneGrid Around(const std::vector<Evidence>& evidence) const {
    PlaneGrid grid = frame_;
    double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9;
    for (const Evidence& piece : evidence) {
      low_u = std::min(low_u, grid.u.dot(piece.p));
      high_u = std::max(high_u, grid.u.dot(piece.p));
      low_v = std::min(low_v, grid.v.dot(piece.p));
      high_v = std::max(high_v, grid.v.dot(piece.p));
    }
    grid.from_u_m = low_u - reach_u_ * grid.cell_m;
    grid.columns = Cells(high_u - low_u) + 2 * reach_u_ + 1;
    grid.from_v_m = low_v - reach_v_ * grid.cell_m;
    grid.rows = Cells(high_v - low_v) + 2 * reach_v_ + 1;
    return grid;
  }

  // The grid without what is outside a mask, and above or below the building.
  SuggestedPlane Cropped(const PlaneGrid& grid, const cv::Mat1b& mask) const {
    cv::Rect box = cv::boundingRect(mask);
    if (std::abs(grid.normal.z()) < 0.5) {
      const int low =
          static_cast<int>(std::floor((heights_.low_z_m - grid.from_v_m) / grid.cell_m));
      const int high =
          static_cast<int>(std::ceil((heights_.high_z_m - grid.from_v_m) / grid.cell_m));
      box &= cv::Rect(0, low, grid.columns, std::max(0, high - low));
    }
    SuggestedPlane plane{grid, mask(box).clone(), 0, 0};
    plane.grid.from_u_m += box.x * grid.cell_m;
    plane.grid.from_v_m += box.y * grid.cell_m;
    plane.grid.columns = box.width;
    plane.grid.rows = box.height;
    return plane;
  }

  PlaneGrid frame_;
  const Box heights_;
  const double least_;
  const PlaneOptions& options_;
  int reach_u_ = 0, reach_v_ = 0;
};

bool IsNear(const SuggestedPlane& plane, const Vector3d& p) {
  const int column = plane.grid.ColumnOf(p), row = plane.grid.RowOf(p);
  return plane.grid.Contains(column, row) && plane.near(row, column) != 0;
}

// All planes that face one way, the strongest first.
void AddPlanesFacing(const Vector3d& normal, std::vector<Evidence> evidence, const Box& heights,
                     double least, const PlaneOptions& options,
                     std::vector<SuggestedPlane>* planes) {
  const PlaneSplitter splitter(normal, heights, least, options);
  while (const auto offset_m = StrongestOffset(evidence, least)) {
    std::vector<Evidence> on_plane, left;
    for (const Evidence& piece : evidence) {
      const bool is_on = std::abs(piece.n_m - *offset_m) <= options.merge_m;
      (is_on ? on_plane : left).push_back(piece);
    }
    if (on_plane.empty()) return;
    const size_t first = planes->size();
    splitter.AddPlanes(*offset_m, on_plane, planes);
    std::erase_if(left, [&](const Evidence& piece) {
      return std::abs(piece.n_m - *offset_m) <= kShadow_m &&
             std::any_of(planes->begin() + static_cast<int64_t>(first), planes->end(),
                         [&](const SuggestedPlane& plane) { return IsNear(plane, piece.p); });
    });
    evidence = std::move(left);
  }
}

}  // namespace

std::vector<SuggestedPlane> SuggestPlanes(const std::vector<DensePoint>& dense,
                                          const std::vector<MapLine>& lines, double voxel_m,
                                          const PlaneOptions& options) {
  std::vector<SuggestedPlane> planes;
  if (dense.empty()) return planes;
  const Box heights = HeightsOf(dense);
  const double least = options.min_surface_m2 / (voxel_m * voxel_m);
  std::vector<Vector3d> normals = {Vector3d::UnitZ(), -Vector3d::UnitZ()};
  for (const double heading : Headings(HeadingVotes(dense, lines, voxel_m, options))) {
    const Vector3d normal(std::cos(heading), std::sin(heading), 0);
    normals.push_back(normal);
    normals.emplace_back(-normal);
  }
  for (const Vector3d& normal : normals) {
    AddPlanesFacing(normal, EvidenceFacing(normal, dense, lines, voxel_m, options), heights, least,
                    options, &planes);
  }
  return planes;
}

}  // namespace slcmap
