#include "mapping/dense/depth_refinement.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "mapping/dense/patch_match.h"
#include "mapping/dense/slope_fit.h"

namespace slcmap {
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

void SmoothSlopes(const Camera& camera, const DenseOptions& options, DepthGrid* grid) {
  constexpr int kMinNodes = 6;
  constexpr float kTolerance = 0.02F;  // of inverse depth, as a share: slopes are rough at first
  const double min_cosine = std::cos(options.max_grazing_deg * M_PI / 180);
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
                 const Camera& camera, const DenseOptions& options, DepthGrid* grid) {
  std::vector<PatchRefiner> levels;
  for (int level = 0; level < DepthPyramid::kLevels; ++level) {
    levels.emplace_back(reference, neighbours, camera, level);
  }
  const DepthGrid matched = *grid;
  for (int pass = 0; pass < 2; ++pass) {
    RefineNodes(levels, matched, grid);
    SmoothSlopes(camera, options, grid);
  }
}

}  // namespace slcmap
