#include "mapping/dense/depth_refinement.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "data/core/types.h"
#include "mapping/views/stereo_depth.h"

namespace slcmap::inline mapping {

// One patch of a reference image in a neighbour's: how alike they are, and which way is better.

inline constexpr int kPatchRadius = 3, kPatchSpacing_px = 2;  // taps of a patch, on either side
inline constexpr int kPatchTaps = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
inline constexpr int kPatchMargin_px = kPatchRadius * kPatchSpacing_px;

// Whole registers of four: what is beyond the taps is zero, or means nothing.
inline constexpr int kPatchLanes = (kPatchTaps + 3) / 4 * 4;
using Taps = Eigen::Array<float, kPatchLanes, 1>;

// The patch of a reference image around a pixel, without its mean.
struct ReferencePatch {
  Taps values;
  float energy = 0;  // sum of squares
};

// The pixel is at least kPatchMargin_px inside the image (float).
ReferencePatch PatchAt(const cv::Mat& image, int u, int v);

// A neighbour relative to the reference, in the pixels of the camera that both are.
struct PlaneWarp {
  PlaneWarp(const Camera& camera, const RigidTransform& T_neighbour_reference);
  // Homogeneous pixel in the neighbour: A (u, v, 1) + b inverse_depth.
  Eigen::Matrix3f A;
  Eigen::Vector3f b;
};

struct PatchComparison {
  bool is_inside = false;     // all taps lie in the neighbour's image
  float correlation = 0;      // normalised, zero mean
  float step = 0;             // of inverse depth, to the best agreement by first order
  float information = 0;      // of that step, 1/variance, by the residuals that are left
  float pixels_per_unit = 0;  // how fast the patch moves with inverse depth
};

// Compares a patch, mapped by the plane of its node, with the neighbour's image (float).
PatchComparison ComparePatch(const ReferencePatch& patch, int u, int v, const DepthNode& node,
                             const PlaneWarp& warp, const cv::Mat& neighbour);

namespace {

// Smoothed images still have noise and rounding.
constexpr float kMinVariance = 0.15F;  // of residuals, grey values squared
// Smoothing makes the residuals of taps depend on each other, and surfaces are not quite planes:
// with this share about two thirds of simulated depths are within one sigma.
constexpr float kIndependentShare = 0.12F;
constexpr float kMinContrast = 0.6F, kMaxContrast = 1.6F;  // between two images of one patch

// Where the taps are from the middle of the patch; those beyond them are there.
struct TapPlaces {
  Taps x = Taps::Zero(), y = Taps::Zero(), is_tap = Taps::Zero();

  TapPlaces() {
    for (int tap = 0; tap < kPatchTaps; ++tap) {
      x[tap] = static_cast<float>(tap % (2 * kPatchRadius + 1) - kPatchRadius);
      y[tap] = static_cast<float>(tap / (2 * kPatchRadius + 1) - kPatchRadius);
      is_tap[tap] = 1;
    }
  }
};

const TapPlaces& Places() {
  static const TapPlaces places;
  return places;
}

// Zero beyond the taps.
void RemoveMean(Taps* values) {
  *values *= Places().is_tap;
  *values = (*values - values->sum() / kPatchTaps) * Places().is_tap;
}

// Grey values in the neighbour, and how they change with inverse depth.
struct WarpedPatch {
  Taps values, slopes;
  float pixels_per_unit = 0;
  bool is_inside = false;
};

// Places in an image, all inside, with how far they move with inverse depth.
struct TapPixels {
  Taps u, v, du, dv;
};

// Bilinear values, and derivatives along (du, dv).
void Sample(const cv::Mat& image, const TapPixels& at, WarpedPatch* patch) {
  const Eigen::Array<int, kPatchLanes, 1> columns = at.u.cast<int>(), rows = at.v.cast<int>();
  const float* pixels = image.ptr<float>();
  const auto stride = static_cast<std::ptrdiff_t>(image.step1());
  Taps top_left, top_right, bottom_left, bottom_right;  // grey values around the places
  for (int tap = 0; tap < kPatchLanes; ++tap) {
    const float* top = pixels + rows[tap] * stride + columns[tap];
    top_left[tap] = top[0];
    top_right[tap] = top[1];
    bottom_left[tap] = top[stride];
    bottom_right[tap] = top[stride + 1];
  }
  const Taps x = at.u - columns.cast<float>(), y = at.v - rows.cast<float>();
  const Taps across_top = top_right - top_left, across_bottom = bottom_right - bottom_left;
  const Taps upper = top_left + x * across_top;
  const Taps down = bottom_left + x * across_bottom - upper;
  patch->values = upper + y * down;
  patch->slopes = at.du * (across_top + y * (across_bottom - across_top)) + at.dv * down;
}

WarpedPatch Warp(int u, int v, const DepthNode& node, const PlaneWarp& warp, const cv::Mat& image) {
  constexpr float kMinDepth = 1e-6F;  // homogeneous: behind the camera it is below 0
  constexpr int kMiddle = kPatchTaps / 2;
  WarpedPatch patch;
  const Eigen::Vector3f centre =
      warp.A * Eigen::Vector3f(static_cast<float>(u), static_cast<float>(v), 1) +
      node.inverse_depth * warp.b;
  const Eigen::Vector3f along_x = kPatchSpacing_px * (warp.A.col(0) + node.slope_x * warp.b);
  const Eigen::Vector3f along_y = kPatchSpacing_px * (warp.A.col(1) + node.slope_y * warp.b);
  const TapPlaces& places = Places();
  const Taps depth = centre.z() + places.x * along_x.z() + places.y * along_y.z();
  if (!(depth.minCoeff() > kMinDepth)) return patch;
  const Taps inverse = depth.inverse();
  TapPixels at;
  at.u = (centre.x() + places.x * along_x.x() + places.y * along_y.x()) * inverse;
  at.v = (centre.y() + places.x * along_x.y() + places.y * along_y.y()) * inverse;
  const float last_column = static_cast<float>(image.cols - 1) - 1e-3F;
  const float last_row = static_cast<float>(image.rows - 1) - 1e-3F;
  patch.is_inside = at.u.minCoeff() >= 0 && at.v.minCoeff() >= 0 && at.u.maxCoeff() < last_column &&
                    at.v.maxCoeff() < last_row;
  if (!patch.is_inside) return patch;
  at.du = (warp.b.x() - at.u * warp.b.z()) * inverse;
  at.dv = (warp.b.y() - at.v * warp.b.z()) * inverse;
  patch.pixels_per_unit = std::hypot(at.du[kMiddle], at.dv[kMiddle]);
  Sample(image, at, &patch);
  return patch;
}

}  // namespace

ReferencePatch PatchAt(const cv::Mat& image, int u, int v) {
  ReferencePatch patch;
  patch.values.setZero();
  int tap = 0;
  for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
    const float* row = image.ptr<float>(v + y * kPatchSpacing_px) + u;
    for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
      patch.values[tap++] = row[x * kPatchSpacing_px];
    }
  }
  RemoveMean(&patch.values);
  patch.energy = patch.values.square().sum();
  return patch;
}

PlaneWarp::PlaneWarp(const Camera& camera, const RigidTransform& T_neighbour_reference) {
  Eigen::Matrix3d K;
  K << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1;
  A = (K * T_neighbour_reference.rotation.toRotationMatrix() * K.inverse()).cast<float>();
  b = (K * T_neighbour_reference.translation).cast<float>();
}

PatchComparison ComparePatch(const ReferencePatch& patch, int u, int v, const DepthNode& node,
                             const PlaneWarp& warp, const cv::Mat& neighbour) {
  PatchComparison comparison;
  WarpedPatch warped = Warp(u, v, node, warp, neighbour);
  if (!warped.is_inside) return comparison;
  comparison.is_inside = true;
  comparison.pixels_per_unit = warped.pixels_per_unit;
  RemoveMean(&warped.values);
  RemoveMean(&warped.slopes);
  const float energy = warped.values.square().sum();
  const float product = (warped.values * patch.values).sum();
  comparison.correlation = product / std::sqrt(std::max(energy * patch.energy, 1e-6F));
  const float contrast =
      std::clamp(product / std::max(patch.energy, 1e-6F), kMinContrast, kMaxContrast);
  const Taps residuals = warped.values - contrast * patch.values;
  const float steepness = warped.slopes.square().sum();
  if (steepness <= 0) return comparison;
  const float moved = (warped.slopes * residuals).sum();
  comparison.step = -moved / steepness;
  // What the step takes away of the residuals is not noise.
  const float left = residuals.square().sum() - moved * moved / steepness;
  const float variance = std::max(left / (kPatchTaps - 3), kMinVariance);
  comparison.information = kIndependentShare * steepness / variance;
  return comparison;
}

namespace {

constexpr int kSteps = 3;                      // of a pass
constexpr float kMaxRefinementStep_px = 1.5F;  // in the neighbour where it moves most
constexpr float kConverged_px = 0.25F;         // what the last step may still be
constexpr float kDone_px = 0.02F;              // a smaller step is the last
constexpr float kMaxWay_px = 3;                // from the first depth, in the right image
constexpr float kMinFirstCorrelation = 0.5F, kMinCorrelation = 0.65F;
// Of a patch, grey values squared a tap, by level: noise alone has less.
constexpr std::array<float, DepthPyramid::kLevels> kMinEnergy = {1.0F, 0.25F, 0.08F};
constexpr float kDisagree_sigmas = 3;  // of a neighbour's step: it is left out

struct CombinedStep {
  float step = 0, information = 0, max_pixels_per_unit = 0;
  int agreeing = 0;
};

// The information of a neighbour's step once its pose is counted in.
float WithPose(const PatchComparison& comparison, double pose_sigma_px) {
  const float pose_sigma =
      static_cast<float>(pose_sigma_px) / std::max(comparison.pixels_per_unit, 1e-6F);
  return 1 / (1 / comparison.information + pose_sigma * pose_sigma);
}

Camera AtLevel(Camera camera, int level) {
  const double scale = 1.0 / (1 << level);
  camera.fx_px *= scale;
  camera.fy_px *= scale;
  camera.cx_px = (camera.cx_px + 0.5) * scale - 0.5;
  camera.cy_px = (camera.cy_px + 0.5) * scale - 0.5;
  return camera;
}

// Refines nodes at one level of the pyramids.
class PatchRefiner {
 public:
  PatchRefiner(const DepthPyramid& reference, const std::vector<NeighbourImage>& neighbours,
               const Camera& camera, int level)
      : level_(level), reference_(reference.levels[level]) {
    for (const NeighbourImage& neighbour : neighbours) {
      images_.push_back(neighbour.image->levels[level]);
      pose_sigmas_px_.push_back(neighbour.pose_sigma_px / (1 << level));
      warps_.emplace_back(AtLevel(camera, level), neighbour.T_neighbour_reference);
    }
  }

  // The node at a pixel of the full size, refined; nothing where that fails.
  std::optional<DepthNode> Refine(int u, int v, const DepthNode& node) const {
    const int level_u = u >> level_, level_v = v >> level_;
    const float scale = static_cast<float>(1 << level_);
    // Where the pixel of this level has its middle.
    const float off_u = (static_cast<float>(level_u) + 0.5F) * scale - 0.5F - static_cast<float>(u);
    const float off_v = (static_cast<float>(level_v) + 0.5F) * scale - 0.5F - static_cast<float>(v);
    DepthNode moved = node;
    const float off = node.slope_x * off_u + node.slope_y * off_v;
    moved.inverse_depth += off;
    moved.slope_x *= scale;
    moved.slope_y *= scale;
    if (!RefineAtLevel(level_u, level_v, &moved)) return std::nullopt;
    DepthNode refined = node;
    refined.inverse_depth = moved.inverse_depth - off;
    refined.sigma = moved.sigma;
    return refined;
  }

 private:
  bool RefineAtLevel(int u, int v, DepthNode* node) const {
    if (u < kPatchMargin_px || v < kPatchMargin_px || u >= reference_.cols - kPatchMargin_px ||
        v >= reference_.rows - kPatchMargin_px) {
      return false;
    }
    const ReferencePatch patch = PatchAt(reference_, u, v);
    if (patch.energy < kMinEnergy[level_] * kPatchTaps) return false;
    const float first = node->inverse_depth;
    CombinedStep combined;
    for (int i = 0; i <= kSteps; ++i) {
      const bool is_last = i == kSteps;
      combined = Step(patch, u, v, *node, i > 0 ? kMinCorrelation : kMinFirstCorrelation);
      if (combined.agreeing == 0) return false;
      const float moves_px = std::abs(combined.step) * combined.max_pixels_per_unit;
      if (is_last && moves_px > kConverged_px) return false;
      const float limit = kMaxRefinementStep_px / combined.max_pixels_per_unit;
      node->inverse_depth += std::clamp(combined.step, -limit, limit);
      if (i > 0 && moves_px < kDone_px) break;
    }
    const float right_pixels = warps_.front().b.norm();
    if (std::abs(node->inverse_depth - first) * right_pixels > kMaxWay_px) return false;
    node->sigma = 1 / std::sqrt(combined.information);
    return true;
  }

  CombinedStep Step(const ReferencePatch& patch, int u, int v, const DepthNode& node,
                    float min_correlation) const {
    std::vector<std::pair<float, float>> steps;  // and their information
    CombinedStep combined;
    for (std::size_t i = 0; i < warps_.size(); ++i) {
      const PatchComparison comparison = ComparePatch(patch, u, v, node, warps_[i], images_[i]);
      if (!comparison.is_inside || comparison.correlation < min_correlation) continue;
      steps.emplace_back(comparison.step, WithPose(comparison, pose_sigmas_px_[i]));
      combined.max_pixels_per_unit =
          std::max(combined.max_pixels_per_unit, comparison.pixels_per_unit);
    }
    Combine(steps, &combined);
    return combined;
  }

  // The weighted mean of those that agree with it; the one that agrees least is left out first.
  static void Combine(std::vector<std::pair<float, float>>& steps, CombinedStep* combined) {
    while (!steps.empty()) {
      float sum = 0, information = 0;
      for (const auto& [step, weight] : steps) {
        sum += weight * step;
        information += weight;
      }
      const float mean = sum / information;
      const auto misfit = [mean](const std::pair<float, float>& step) {
        return std::abs(step.first - mean) * std::sqrt(step.second);
      };
      const auto worst =
          std::max_element(steps.begin(), steps.end(),
                           [&](const auto& a, const auto& b) { return misfit(a) < misfit(b); });
      if (steps.size() > 1 && misfit(*worst) > kDisagree_sigmas) {
        steps.erase(worst);
        continue;
      }
      combined->step = mean;
      combined->information = information;
      combined->agreeing = static_cast<int>(steps.size());
      return;
    }
  }

  const int level_;
  const cv::Mat reference_;
  std::vector<cv::Mat> images_;
  std::vector<double> pose_sigmas_px_;
  std::vector<PlaneWarp> warps_;
};

// Whether the matches around a node, at the corners and the middles of the sides of a window, are
// on its plane: a window that reaches over a depth edge fits neither side of it.
bool IsFlatAround(const DepthGrid& matched, int column, int row, int reach_px) {
  constexpr float kSigmas = 4;
  constexpr int kMinKnown = 6;  // of nine
  const int reach = (reach_px + matched.step_px - 1) / matched.step_px;
  const DepthNode& centre = matched.At(column, row);
  int known = 0;
  for (int i = 0; i < 9; ++i) {
    const int x = (i % 3 - 1) * reach, y = (i / 3 - 1) * reach;
    if (!matched.Contains(column + x, row + y)) continue;
    const DepthNode& node = matched.At(column + x, row + y);
    const float expected = centre.inverse_depth +
                           static_cast<float>(x * matched.step_px) * centre.slope_x +
                           static_cast<float>(y * matched.step_px) * centre.slope_y;
    if (!node.is_known()) continue;
    if (std::abs(node.inverse_depth - expected) > kSigmas * node.sigma) return false;
    ++known;
  }
  return known >= kMinKnown;
}

// `matched`: the nodes before any was refined.
void RefineNodes(const std::vector<PatchRefiner>& levels, const DepthGrid& matched,
                 DepthGrid* grid) {
  for (int row = 0; row < grid->rows; ++row) {
    for (int column = 0; column < grid->columns; ++column) {
      DepthNode& node = grid->At(column, row);
      if (!node.is_known()) continue;
      std::optional<DepthNode> refined;
      for (std::size_t level = 0; level < levels.size() && !refined; ++level) {
        if (level > 0 && !IsFlatAround(matched, column, row, kPatchMargin_px << level)) break;
        refined = levels[level].Refine(grid->ColumnPixel(column), grid->RowPixel(row), node);
      }
      node = refined.value_or(DepthNode());
    }
  }
}

// What the nodes around a known one say of its plane; those that do not agree with it (by its
// slopes, and half a pixel of the smallest noise) count for nothing.
SlopeFit FitAround(const DepthGrid& grid, int column, int row, float tolerance) {
  constexpr int kReach = 2;
  const DepthNode& centre = grid.At(column, row);
  SlopeFit fit;
  for (int y = -kReach; y <= kReach; ++y) {
    for (int x = -kReach; x <= kReach; ++x) {
      if (!grid.Contains(column + x, row + y)) continue;
      const DepthNode& node = grid.At(column + x, row + y);
      if (!node.is_known()) continue;
      const float dx = static_cast<float>(x * grid.step_px),
                  dy = static_cast<float>(y * grid.step_px);
      const float expected = centre.inverse_depth + dx * centre.slope_x + dy * centre.slope_y;
      if (std::abs(node.inverse_depth - expected) > tolerance + 3 * node.sigma) continue;
      fit.Add(dx, dy, node.inverse_depth, 1 / (node.sigma * node.sigma));
    }
  }
  return fit;
}

}  // namespace

DepthPyramid::DepthPyramid(const cv::Mat& image) {
  if (image.empty()) return;
  image.convertTo(levels[0], CV_32F);
  cv::GaussianBlur(levels[0], levels[0], {5, 5}, 0.8);
  for (int level = 1; level < kLevels; ++level) {
    cv::resize(levels[level - 1], levels[level], {}, 0.5, 0.5, cv::INTER_AREA);
  }
}

void SmoothSlopes(const Camera& camera, DepthGrid* grid) {
  constexpr int kMinNodes = 6;
  constexpr float kTolerance = 0.02F;  // of inverse depth, as a share: slopes are rough at first
  const double min_cosine = std::cos(kDepthMaxGrazing_deg * M_PI / 180);
  const DepthGrid given = *grid;
  for (int row = 0; row < grid->rows; ++row) {
    for (int column = 0; column < grid->columns; ++column) {
      DepthNode& node = grid->At(column, row);
      if (!node.is_known()) continue;
      const SlopeFit fit = FitAround(given, column, row, kTolerance * node.inverse_depth);
      const auto plane = fit.count() >= kMinNodes ? fit.Solve() : std::nullopt;
      if (plane) {
        node.slope_x = static_cast<float>((*plane)[1]);
        node.slope_y = static_cast<float>((*plane)[2]);
      }
      const Eigen::Vector3d ray =
          PinholeRay(camera, grid->ColumnPixel(column), grid->RowPixel(row));
      if (!plane || CosineOfView(node, camera, ray) < min_cosine) node.inverse_depth = 0;
    }
  }
}

void RefineDepth(const DepthPyramid& reference, const std::vector<NeighbourImage>& neighbours,
                 const Camera& camera, DepthGrid* grid) {
  std::vector<PatchRefiner> levels;
  for (int level = 0; level < DepthPyramid::kLevels; ++level) {
    levels.emplace_back(reference, neighbours, camera, level);
  }
  const DepthGrid matched = *grid;
  for (int pass = 0; pass < 2; ++pass) {
    RefineNodes(levels, matched, grid);
    SmoothSlopes(camera, grid);
  }
}

}  // namespace slcmap::mapping
