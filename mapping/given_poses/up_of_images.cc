#include "mapping/given_poses/up_of_images.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/views/recorded_views.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr size_t kMostImages = 16, kLinesOfImage = 40;
constexpr double kMostOff = 0.02;  // sine of the angle between an edge's plane and a direction

// The plane through a camera and an edge that it sees, and how long that is.
struct EdgePlane {
  Vector3d normal;  // unit, in the world
  double length_px;
};

void AddEdges(const cv::Mat& image, const cv::Mat& mask, const Camera& camera,
              const Eigen::Quaterniond& R_world_camera, std::vector<EdgePlane>* edges) {
  constexpr double kLeast_px = 40;
  std::vector<cv::Vec4f> found;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD)->detect(image, found);
  std::vector<EdgePlane> of_image;
  for (const cv::Vec4f& line : found) {
    const Eigen::Vector2d a(line[0], line[1]), b(line[2], line[3]), middle = 0.5 * (a + b);
    const cv::Point at(static_cast<int>(middle.x()), static_cast<int>(middle.y()));
    if ((a - b).norm() < kLeast_px || mask.at<uint8_t>(at) == 0) continue;
    const Vector3d normal =
        PlaneFromPixel(camera, a).homogeneous().cross(PlaneFromPixel(camera, b).homogeneous());
    of_image.push_back({R_world_camera * normal.normalized(), (a - b).norm()});
  }
  std::ranges::sort(of_image, std::greater(), &EdgePlane::length_px);
  of_image.resize(std::min(of_image.size(), kLinesOfImage));
  edges->insert(edges->end(), of_image.begin(), of_image.end());
}

double LengthAlong(const std::vector<EdgePlane>& edges, const Vector3d& direction) {
  double length_px = 0;
  for (const EdgePlane& edge : edges) {
    if (std::abs(edge.normal.dot(direction)) < kMostOff) length_px += edge.length_px;
  }
  return length_px;
}

// Of the edges that follow a direction.
Vector3d Refined(const std::vector<EdgePlane>& edges, const Vector3d& direction) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const EdgePlane& edge : edges) {
    if (std::abs(edge.normal.dot(direction)) < kMostOff) {
      sum += edge.length_px * edge.normal * edge.normal.transpose();
    }
  }
  const Vector3d refined =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(0);
  return refined.dot(direction) < 0 ? -refined : refined;
}

}  // namespace

std::optional<Vector3d> UpByImages(const Sequence& recording, const Trajectory& trajectory) {
  constexpr double kMostFromGuess = 0.77, kSame = 0.5;  // cosines: 40 and 60 degrees
  constexpr double kClearly = 2;                        // times the edges along z
  const RigidTransform& T_imu_camera = recording.rig.T_imu_camera[0];
  Vector3d guess = Vector3d::Zero();
  std::vector<size_t> with_pose;
  std::vector<Eigen::Quaterniond> R_world_imu;
  for (size_t i = 0; i < recording.images.size(); ++i) {
    const auto pose = PoseAt(trajectory, recording.images[i].stamp_ns, 0.1);
    if (!pose) continue;
    with_pose.push_back(i);
    R_world_imu.push_back(pose->rotation);
    guess -= pose->rotation * T_imu_camera.rotation * Vector3d::UnitY();
  }
  if (with_pose.empty() || guess.norm() < kSame * static_cast<double>(with_pose.size())) {
    return std::nullopt;
  }
  guess.normalize();
  if (guess.z() > kSame) return std::nullopt;
  std::vector<size_t> pairs, chosen;
  const size_t count = std::min(kMostImages, with_pose.size());
  for (size_t i = 0; i < count; ++i) {
    chosen.push_back(i * with_pose.size() / count);
    pairs.push_back(with_pose[chosen.back()]);
  }
  const auto images = ImagesOf(recording, pairs);
  const Rig& rig = images->rig();
  std::vector<EdgePlane> edges;
  for (size_t i = 0; i < count; ++i) {
    const cv::Mat left = images->Read(i).left;
    if (left.empty()) continue;
    AddEdges(left, images->mask(0), rig.cameras[0],
             R_world_imu[chosen[i]] * rig.T_imu_camera[0].rotation, &edges);
  }
  Vector3d best = guess;
  double most_px = 0;
  for (size_t i = 0; i < edges.size(); ++i) {
    for (size_t j = i + 1; j < edges.size(); j += 7) {  // of different images as a rule
      Vector3d direction = edges[i].normal.cross(edges[j].normal);
      if (direction.norm() < 0.1) continue;
      direction.normalize();
      if (std::abs(direction.dot(guess)) < kMostFromGuess) continue;
      const double length_px = LengthAlong(edges, direction);
      if (length_px <= most_px) continue;
      most_px = length_px;
      best = direction.dot(guess) < 0 ? Vector3d(-direction) : direction;
    }
  }
  if (most_px == 0) return std::nullopt;
  for (int i = 0; i < 3; ++i) best = Refined(edges, best);
  const bool is_upside_down = guess.z() < -kSame;
  if (!is_upside_down &&
      LengthAlong(edges, best) < kClearly * LengthAlong(edges, Vector3d::UnitZ())) {
    return std::nullopt;
  }
  return best;
}

}  // namespace slcmap
