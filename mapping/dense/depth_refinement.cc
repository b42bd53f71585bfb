#include "mapping/dense/depth_refinement.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/dense/patch_match.h"
#include "mapping/dense/slope_fit.h"

namespace slcmap {
namespace {

constexpr int kSteps = 3;              // of a pass
constexpr float kMaxStep_px = 1.5F;    // in the neighbour where it moves most
constexpr float kConverged_px = 0.15F;  // what the last step may still be
constexpr float kMaxWay_px = 3;        // from the first depth, in the right image
constexpr float kMinCorrelation = 0.5F, kMinLastCorrelation = 0.65F;
constexpr float kMinEnergy = 1.0F;     // of a patch, grey values squared a tap
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

class PatchRefiner {
 public:
  PatchRefiner(const cv::Mat& reference, const std::vector<NeighbourImage>& neighbours,
               const Camera& camera)
      : reference_(reference), neighbours_(neighbours) {
    for (const NeighbourImage& neighbour : neighbours) {
      warps_.emplace_back(camera, neighbour.T_neighbour_reference);
    }
  }

  // Refines the node in place; it becomes unknown where that fails.
  void Refine(int u, int v, DepthNode* node) const {
    const DepthNode first = *node;
    node->inverse_depth = 0;
    if (u < kPatchMargin_px || v < kPatchMargin_px || u >= reference_.cols - kPatchMargin_px ||
        v >= reference_.rows - kPatchMargin_px) {
      return;
    }
    const ReferencePatch patch = PatchAt(reference_, u, v);
    if (patch.energy < kMinEnergy * kPatchTaps) return;
    DepthNode moving = first;
    CombinedStep combined;
    for (int i = 0; i <= kSteps; ++i) {
      const bool is_last = i == kSteps;
      combined = Step(patch, u, v, moving, is_last ? kMinLastCorrelation : kMinCorrelation);
      if (combined.agreeing == 0) return;
      const float limit = kMaxStep_px / combined.max_pixels_per_unit;
      if (is_last && std::abs(combined.step) * combined.max_pixels_per_unit > kConverged_px) return;
      moving.inverse_depth += std::clamp(combined.step, -limit, limit);
    }
    const float right_pixels = warps_.front().b.norm();
    if (std::abs(moving.inverse_depth - first.inverse_depth) * right_pixels > kMaxWay_px) return;
    moving.sigma = 1 / std::sqrt(combined.information);
    *node = moving;
  }

 private:
  CombinedStep Step(const ReferencePatch& patch, int u, int v, const DepthNode& node,
                    float min_correlation) const {
    std::vector<std::pair<float, float>> steps;  // and their information
    CombinedStep combined;
    for (std::size_t i = 0; i < warps_.size(); ++i) {
      const PatchComparison comparison =
          ComparePatch(patch, u, v, node, warps_[i], *neighbours_[i].image);
      if (!comparison.is_inside || comparison.correlation < min_correlation) continue;
      steps.emplace_back(comparison.step, WithPose(comparison, neighbours_[i].pose_sigma_px));
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
      const auto worst = std::max_element(steps.begin(), steps.end(),
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

  const cv::Mat& reference_;
  const std::vector<NeighbourImage>& neighbours_;
  std::vector<PatchWarp> warps_;
};

void RefineNodes(const PatchRefiner& refiner, DepthGrid* grid) {
  for (int row = 0; row < grid->rows; ++row) {
    for (int column = 0; column < grid->columns; ++column) {
      DepthNode& node = grid->At(column, row);
      if (node.is_known()) refiner.Refine(grid->ColumnPixel(column), grid->RowPixel(row), &node);
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
      const float dx = static_cast<float>(x * grid.step_px), dy = static_cast<float>(y * grid.step_px);
      const float expected = centre.inverse_depth + dx * centre.slope_x + dy * centre.slope_y;
      if (std::abs(node.inverse_depth - expected) > tolerance + 3 * node.sigma) continue;
      fit.Add(dx, dy, node.inverse_depth, 1 / (node.sigma * node.sigma));
    }
  }
  return fit;
}

}  // namespace

cv::Mat SmoothedImage(const cv::Mat& image) {
  cv::Mat smoothed;
  image.convertTo(smoothed, CV_32F);
  cv::GaussianBlur(smoothed, smoothed, {5, 5}, 0.8);
  return smoothed;
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

void RefineDepth(const cv::Mat& reference, const std::vector<NeighbourImage>& neighbours,
                 const Camera& camera, const DenseOptions& options, DepthGrid* grid) {
  const PatchRefiner refiner(reference, neighbours, camera);
  for (int pass = 0; pass < 2; ++pass) {
    RefineNodes(refiner, grid);
    SmoothSlopes(camera, options, grid);
  }
}

}  // namespace slcmap
