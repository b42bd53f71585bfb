// A small piece of an image as a reference, its alignment to sub-pixel accuracy in other images,
// and its place along the same row of the right one.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace slcmap::inline odometry {

// Images of halved size, the finest first. The pixel (u, v) of level n is (u, v) 2^n of level 0.
using ImagePyramid = std::vector<cv::Mat>;  // 8 bit, one channel

ImagePyramid BuildPyramid(const cv::Mat& image, int levels);

// Where a patch lies in an image: its pixel at `offset` is seen at center_px + affine * offset.
struct PatchWarp {
  Eigen::Vector2f center_px = Eigen::Vector2f::Zero();
  Eigen::Matrix2f affine = Eigen::Matrix2f::Identity();
};

// The pixels that a patch consists of: a disc with weights that fade towards its border.
struct PatchPattern {
  explicit PatchPattern(int diameter_px);
  int radius_px = 0;
  Eigen::VectorXf x_px, y_px;  // offsets from the centre
  Eigen::VectorXf weights;     // their sum is 1
};

// The reference at one level. It is aligned by inverse-compositional Gauss-Newton (Baker and
// Matthews, "Lucas-Kanade 20 Years On", 2004) on brightness up to gain and offset: both are
// projected out of the Jacobian beforehand, so that a step is a product of a fixed matrix with the
// sampled image.
class Patch {
 public:
  // Takes the reference at a pixel of the image; false where it would reach beyond the border, or
  // has no texture or only that of an edge. AlignAffine() needs with_affine.
  bool Extract(const PatchPattern& pattern, const cv::Mat& image, const Eigen::Vector2f& center_px,
               bool with_affine);

  // Moves the warp's centre (also its affine part, if asked for) to where the image agrees best.
  // Returns the normalised cross-correlation there, -1 when it left the image or diverged.
  float Align(const PatchPattern& pattern, const cv::Mat& image, int max_iterations,
              float min_step_px, PatchWarp* warp) const;
  float AlignAffine(const PatchPattern& pattern, const cv::Mat& image, int iterations,
                    PatchWarp* warp) const;

  // The normalised cross-correlation with the image at the warp, -1 beyond the border.
  float Correlation(const PatchPattern& pattern, const cv::Mat& image, const PatchWarp& warp) const;

  bool empty() const { return template_.size() == 0; }

 private:
  struct Match {
    float gain = 0;  // brightness of the image over that of the reference
    float correlation = -1;
  };
  Match Compare(const PatchPattern& pattern, const Eigen::VectorXf& sampled) const;
  void PrepareSteps(const PatchPattern& pattern, const Eigen::VectorXf& gradient_x,
                    const Eigen::VectorXf& gradient_y, bool with_affine);

  Eigen::VectorXf template_;  // weighted, of zero mean
  float norm_ = 0;            // weighted standard deviation
  Eigen::Matrix<float, 2, Eigen::Dynamic, Eigen::RowMajor> shift_steps_;
  Eigen::Matrix<float, 6, Eigen::Dynamic, Eigen::RowMajor> affine_steps_;
};

// The place of a piece of the left image along the same row of the right one.

struct RowMatch {
  Eigen::Vector2f right_px;
  float correlation = 0;  // normalised
};

// Compares the square around left_px, rounded to a pixel, with every disparity from -1 to
// max_disparity_px. Nothing where the square reaches beyond the image or has no texture.
std::optional<RowMatch> SearchRow(const cv::Mat& left, const cv::Mat& right,
                                  const Eigen::Vector2f& left_px, int max_disparity_px);

}  // namespace slcmap::odometry
