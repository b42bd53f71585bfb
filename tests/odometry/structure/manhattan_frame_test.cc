#include "odometry/structure/manhattan_frame.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

#include "odometry/frontend/line_detector.h"
#include "tests/odometry/structure/made_segments.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

using testing::kDegree;

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

class ManhattanFrameTest : public ::testing::Test {
 protected:
  // What a camera sees of lines along the world's axes and of clutter, from a box before it.
  std::vector<LineSegment> Segments(int lines_an_axis, int clutter) {
    std::vector<testing::WorldLine> lines;
    std::normal_distribution<double> normal;
    const auto add = [&](const Eigen::Vector3d& d, int count) {
      for (const auto& line : testing::ScatteredLines(d, count, &random_)) lines.push_back(line);
    };
    for (int axis = 0; axis < 3; ++axis) add(Eigen::Vector3d::Unit(axis), lines_an_axis);
    for (int i = 0; i < clutter; ++i) add({normal(random_), normal(random_), normal(random_)}, 1);
    return testing::ProjectAll(lines, R_world_camera_, 0.4, &random_);
  }

  double LargestError(const ManhattanFrame& frame) const {
    double largest_rad = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d d_world = R_world_camera_ * frame.R_camera_manhattan.col(axis);
      Eigen::Index nearest;
      d_world.cwiseAbs().maxCoeff(&nearest);
      largest_rad = std::max(largest_rad, AngleBetween(d_world, Eigen::Vector3d::Unit(nearest)));
    }
    return largest_rad;
  }

  std::mt19937 random_{5};
  const Eigen::Matrix3d R_world_camera_ = testing::CameraLooking(0.4, 0.15);
};

TEST_F(ManhattanFrameTest, FindsThreeOrthogonalDirectionsAmongClutter) {
  const auto frame = DetectManhattanFrame(Segments(120, 120), testing::kFocal_px);
  ASSERT_TRUE(frame.has_value());
  const Eigen::Matrix3d& R = frame->R_camera_manhattan;
  EXPECT_TRUE((R.transpose() * R).isIdentity(1e-9));
  EXPECT_NEAR(R.determinant(), 1, 1e-9);
  EXPECT_LT(LargestError(*frame), 0.3 * kDegree);
  EXPECT_GT((R_world_camera_ * R.col(2)).z(), 0.999);  // up
  EXPECT_GT(R(2, 0), std::abs(R(2, 1)));               // ahead
}

TEST_F(ManhattanFrameTest, APriorTellsTheVertical) {
  const Eigen::Vector3d up = R_world_camera_.transpose() * Eigen::Vector3d(0.01, 0, 1).normalized();
  const auto frame = DetectManhattanFrame(Segments(120, 120), testing::kFocal_px, up);
  ASSERT_TRUE(frame.has_value());
  EXPECT_LT(LargestError(*frame), 0.3 * kDegree);
}

TEST_F(ManhattanFrameTest, TellsWhichSegmentFollowsWhichAxis) {
  const auto segments = Segments(120, 0);
  const auto frame = DetectManhattanFrame(segments, testing::kFocal_px);
  ASSERT_TRUE(frame.has_value());
  ASSERT_EQ(frame->axes.size(), segments.size());
  EXPECT_GT(frame->explained_share, 0.95);
}

TEST_F(ManhattanFrameTest, FindsNoneWhereTooFewSegmentsAgree) {
  EXPECT_FALSE(DetectManhattanFrame({}, testing::kFocal_px).has_value());
  EXPECT_FALSE(DetectManhattanFrame(Segments(2, 0), testing::kFocal_px).has_value());
  EXPECT_FALSE(DetectManhattanFrame(Segments(0, 500), testing::kFocal_px).has_value());
}

// Real images of a corridor with depth: the directions of its lines are those of the normals of its
// walls, floor and ceiling.
class CorridorFrames : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::SharedData("corridor_frames");
    if (folder_.empty()) GTEST_SKIP() << "no corridor_frames";
    for (const auto& entry : std::filesystem::directory_iterator(folder_ + "/rgb")) {
      names_.push_back(entry.path().filename().string());
    }
    std::sort(names_.begin(), names_.end());
    std::vector<cv::Point2d> pixels;
    for (int i = 0; i < 640 * 480; ++i) pixels.emplace_back(i % 640, i / 640);
    cv::undistortPoints(pixels, rays_, K_, distortion_);
  }

  std::vector<LineSegment> Segments(const std::string& name) const {
    const cv::Mat image = cv::imread(folder_ + "/rgb/" + name, cv::IMREAD_GRAYSCALE);
    cv::Mat straight;
    cv::undistort(image, straight, K_, distortion_);
    std::vector<LineSegment> segments = DetectSegments(straight, cv::Mat(), LineDetectorOptions());
    for (LineSegment& segment : segments) {
      for (Eigen::Vector2d* end : {&segment.start, &segment.end}) {
        *end = (*end - Eigen::Vector2d(K_(0, 2), K_(1, 2)))
                   .cwiseQuotient(Eigen::Vector2d(K_(0, 0), K_(1, 1)));
      }
    }
    return segments;
  }

  // Points of a depth image in the camera frame, zero where there is no depth below 4 m.
  cv::Mat_<cv::Vec3d> Points(const std::string& name) const {
    const cv::Mat_<uint16_t> depth_mm =
        cv::imread(folder_ + "/depth/" + name, cv::IMREAD_UNCHANGED);
    cv::Mat_<cv::Vec3d> points(depth_mm.size(), cv::Vec3d());
    for (int i = 0; i < static_cast<int>(rays_.size()); ++i) {
      const int y = i / depth_mm.cols, x = i % depth_mm.cols;
      const double z_m = 1e-3 * depth_mm(y, x);
      if (z_m < 4) points(y, x) = {z_m * rays_[i].x, z_m * rays_[i].y, z_m};
    }
    return points;
  }

  // The normal of the surface about a pixel; nothing where it is not plane.
  static std::optional<Eigen::Vector3d> NormalAt(const cv::Mat_<cv::Vec3d>& points, int x, int y) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    int count = 0;
    for (int v = y - 16; v <= y + 16; v += 4) {
      for (int u = x - 16; u <= x + 16; u += 4) {
        const cv::Vec3d& p = points(v, u);
        if (p[2] <= 0) return std::nullopt;
        const Eigen::Vector3d q(p[0], p[1], p[2]);
        mean += q;
        square += q * q.transpose();
        ++count;
      }
    }
    mean /= count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square / count -
                                                                mean * mean.transpose());
    const double sigma_m = 0.002 * mean.z() * mean.z() + 0.001;
    if (solver.eigenvalues()(0) > sigma_m * sigma_m) return std::nullopt;
    return solver.eigenvectors().col(0);
  }

  static std::vector<Eigen::Vector3d> Normals(const cv::Mat_<cv::Vec3d>& points) {
    std::vector<Eigen::Vector3d> normals;
    for (int y = 20; y < points.rows - 20; y += 10) {
      for (int x = 20; x < points.cols - 20; x += 10) {
        const auto normal = NormalAt(points, x, y);
        if (normal) normals.push_back(*normal);
      }
    }
    return normals;
  }

  // The mode of the normals that is nearest to a direction (mean shift); nothing where few are
  // there: doors and things that stand about are not the building.
  static std::optional<Eigen::Vector3d> Mode(const std::vector<Eigen::Vector3d>& normals,
                                             Eigen::Vector3d direction) {
    for (const double radius_rad : {0.25, 0.15, 0.1, 0.07, 0.07, 0.07, 0.07}) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int count = 0;
      for (const Eigen::Vector3d& n : normals) {
        if (AngleBetween(n, direction) > radius_rad) continue;
        sum += n.dot(direction) > 0 ? n : Eigen::Vector3d(-n);
        ++count;
      }
      if (count < 100) return std::nullopt;
      direction = sum.normalized();
    }
    return direction;
  }

  std::string folder_;
  std::vector<std::string> names_;
  std::vector<cv::Point2d> rays_;  // of all pixels, on the plane z = 1
  const cv::Matx33d K_{537.600, 0, 315.149, 0, 539.033, 244.519, 0, 0, 1};
  const std::vector<double> distortion_{0.035427, -0.047648, 0.001071, 0.001266, -0.207042};
};

TEST_F(CorridorFrames, DirectionsAreThoseOfTheWalls) {
  std::vector<double> errors_deg;
  double share = 0;
  int found = 0;
  for (const std::string& name : names_) {
    const auto frame = DetectManhattanFrame(Segments(name), K_(0, 0));
    if (!frame) continue;
    ++found;
    share += frame->explained_share;
    const auto normals = Normals(Points(name));
    std::printf("%s: explained %.2f, against the normals of surfaces (degrees):", name.c_str(),
                frame->explained_share);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d d = frame->R_camera_manhattan.col(axis);
      const auto mode = Mode(normals, d);
      if (mode) errors_deg.push_back(AngleBetween(*mode, d) / kDegree);
      std::printf(mode ? " %.2f" : " -", mode ? errors_deg.back() : 0);
    }
    std::printf("\n");
  }
  std::sort(errors_deg.begin(), errors_deg.end());
  ASSERT_GT(errors_deg.size(), names_.size());
  std::printf("found in %d of %zu, explained %.2f; median %.2f, 90 %% %.2f degrees of %zu\n", found,
              names_.size(), share / found, errors_deg[errors_deg.size() / 2],
              errors_deg[errors_deg.size() * 9 / 10], errors_deg.size());
  EXPECT_GE(found, static_cast<int>(names_.size()) - 1);
  EXPECT_GT(share / found, 0.9);
  // Bounds above what was measured (1.1 and 1.8). In the depth images alone, walls and floor are up
  // to 1.2 degrees (median 0.4) from a right angle, which is part of it; the rest is not explained.
  EXPECT_LT(errors_deg[errors_deg.size() / 2], 1.5);
  EXPECT_LT(errors_deg[errors_deg.size() * 9 / 10], 2.0);
}

}  // namespace
}  // namespace slcmap
