#include "odometry/window/line_triangulation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>

#include "odometry/factors/factor.h"
#include "odometry/factors/line_residual.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxRelativeSigma = 0.25;      // of the line's place across it, to its distance
constexpr double kMaxDirectionSigma_rad = 0.2;  // of a general line

constexpr int kMaxIterations = 6;
constexpr double kMinAngle_rad = 0.03;  // between a ray and the line that it should meet

// A segment as one camera saw it, in the world.
struct SegmentView {
  Vector3d centre;
  Vector3d start, end;  // unit rays to its ends
  Vector3d Middle() const { return (start + end).normalized(); }
};

SegmentView MakeSegmentView(const LineSegment& segment, int camera, const StereoGeometry& geometry,
                            const RigidTransform& T_world_imu) {
  const RigidTransform T_world_camera = T_world_imu * geometry.T_imu_camera[camera];
  const auto ray = [&](const Vector2d& end) -> Vector3d {
    return T_world_camera.rotation * geometry.OnTruePlane(camera, end).homogeneous().normalized();
  };
  return {T_world_camera.translation, ray(segment.start), ray(segment.end)};
}

std::vector<SegmentView> CollectViews(const std::vector<PosedLineObservation>& observations,
                                      const StereoGeometry& geometry) {
  std::vector<SegmentView> views;
  for (const PosedLineObservation& observation : observations) {
    const StereoLineMeasurement& m = observation.measurement;
    views.push_back(MakeSegmentView(m.left, m.camera, geometry, observation.T_world_imu));
    if (m.right)
      views.push_back(MakeSegmentView(*m.right, m.camera + 1, geometry, observation.T_world_imu));
  }
  return views;
}

// Where on the line, in metres from its point, a ray passes nearest; nothing where that is behind
// the ray's origin, or the two are nearly parallel.
std::optional<double> MeetRay(const PointAndDirection& line, const Vector3d& centre,
                              const Vector3d& ray) {
  const Vector3d between = line.point_world - centre;
  const double cosine = line.direction_world.dot(ray);
  const double squared_sine = 1 - cosine * cosine;
  if (squared_sine < kMinAngle_rad * kMinAngle_rad) return std::nullopt;
  const double along_m =
      (cosine * ray.dot(between) - line.direction_world.dot(between)) / squared_sine;
  if (ray.dot(between) + along_m * cosine <= 0) return std::nullopt;
  return along_m;
}

bool IsInFront(const PointAndDirection& line, const std::vector<SegmentView>& views) {
  return std::all_of(views.begin(), views.end(), [&](const SegmentView& view) {
    return MeetRay(line, view.centre, view.Middle()).has_value();
  });
}

using Factors = std::vector<std::unique_ptr<Factor>>;

// The normal equations of a line's block, which is the last of every factor.
struct LineNormalEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  double cost = 0;
};

// The poses and the heading stay as they are.
class LineProblem {
 public:
  LineProblem(Factors factors, const std::vector<PosedLineObservation>& observations,
              double heading_rad, double loss_sigma)
      : factors_(std::move(factors)), heading_rad_(heading_rad), loss_sigma_(loss_sigma) {
    for (const PosedLineObservation& observation : observations)
      PoseToBlock(observation.T_world_imu, poses_.emplace_back().data());
  }

  LineNormalEquations At(const double* block) const {
    const int size = factors_[0]->tangent_size(factors_[0]->blocks() - 1);
    LineNormalEquations out{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
    for (size_t i = 0; i < factors_.size(); ++i) {
      const Factor& factor = *factors_[i];
      const int last = factor.blocks() - 1;
      std::array<const double*, Factor::kMaxBlocks> parameters{poses_[i].data(), &heading_rad_};
      parameters[last] = block;
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(factor.rows(), size);
      std::array<double*, Factor::kMaxBlocks> jacobians{};
      jacobians[last] = j.data();
      Eigen::VectorXd r(factor.rows());
      factor.Linearize(parameters.data(), r.data(), jacobians.data());
      const double norm = r.norm();
      const double weight = norm > loss_sigma_ ? loss_sigma_ / norm : 1;
      out.information += weight * j.transpose() * j;
      out.gradient += weight * j.transpose() * r;
      out.cost += norm > loss_sigma_ ? loss_sigma_ * (2 * norm - loss_sigma_) : norm * norm;
    }
    return out;
  }

 private:
  Factors factors_;
  std::vector<std::array<double, kPoseSize>> poses_;
  double heading_rad_, loss_sigma_;
};

// Gauss-Newton from `block` while the cost falls. Returns the covariance; nothing where the
// observations leave some direction of the block open.
std::optional<Eigen::MatrixXd> Refine(const LineProblem& problem, const BlockKind& kind,
                                      double* block) {
  LineNormalEquations at = problem.At(block);
  std::vector<double> moved(kind.size);
  for (int i = 0; i < kMaxIterations; ++i) {
    const Eigen::VectorXd step = at.information.ldlt().solve(-at.gradient);
    if (!step.allFinite()) return std::nullopt;
    BlockPlus(kind, block, step.data(), moved.data());
    LineNormalEquations next = problem.At(moved.data());
    if (!(next.cost < at.cost)) break;
    std::copy(moved.begin(), moved.end(), block);
    at = std::move(next);
  }
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(at.information);
  if (!ldlt.isPositive() || ldlt.rcond() < 1e-14) return std::nullopt;
  return ldlt.solve(Eigen::MatrixXd::Identity(at.gradient.size(), at.gradient.size()));
}

// The point across the axis, from the anchor, that is nearest to the planes of the axis and the
// middles of the segments.
std::optional<Vector2d> MeetAxisPlanes(const std::vector<SegmentView>& views,
                                       const StructuralLine& line, double heading_rad) {
  const Vector3d axis = AxisDirection(line.axis, heading_rad);
  const Matrix32d across = AxesAcross(line.axis, heading_rad);
  Matrix2d a = Matrix2d::Zero();
  Vector2d b = Vector2d::Zero();
  for (const SegmentView& view : views) {
    const Vector3d normal = axis.cross(view.Middle());
    if (normal.norm() < kMinAngle_rad) continue;
    const Vector2d n = across.transpose() * normal.normalized();
    a += n * n.transpose();
    b += n * n.dot(across.transpose() * (view.centre - line.anchor_world));
  }
  const Vector2d crossing = a.ldlt().solve(b);
  if (!crossing.allFinite() || crossing.norm() == 0) return std::nullopt;
  return crossing;
}

// The line in which the planes of the segments meet best, each the surer the longer it was seen.
std::optional<PointAndDirection> MeetPlanes(const std::vector<SegmentView>& views,
                                            const Vector3d& anchor_world) {
  Matrix3d normals = Matrix3d::Zero();
  Vector3d offsets = Vector3d::Zero();
  for (const SegmentView& view : views) {
    const Vector3d normal = view.start.cross(view.end);  // as long as the sine of the angle seen
    normals += normal * normal.transpose();
    offsets += normal * normal.dot(view.centre - anchor_world);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(normals);
  const Vector3d direction = eigen.eigenvectors().col(0);
  const double scale = eigen.eigenvalues()[2];
  if (!(eigen.eigenvalues()[1] > 1e-9 * scale)) return std::nullopt;
  const Vector3d nearest =
      (normals + scale * direction * direction.transpose()).ldlt().solve(offsets);
  const Vector3d across = nearest - direction * direction.dot(nearest);
  return PointAndDirection{anchor_world + across, direction};
}

bool IsWithin(double distance_m, const LineTriangulationOptions& options) {
  return distance_m > options.min_distance_m && distance_m < options.max_distance_m;
}

double LargestSigma(const Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
}

// The largest standard deviation across the line, over the distance to it, where the view saw it.
double RelativeSigma(const GeneralLineBlock& block, const PointAndDirection& line,
                     const Matrix4d& covariance, const SegmentView& view) {
  const double along_m = *MeetRay(line, view.centre, view.Middle());
  const Eigen::Matrix<double, 3, 4> moved = GeneralLineShift(block.data(), along_m);
  const Matrix3d across =
      Matrix3d::Identity() - line.direction_world * line.direction_world.transpose();
  const Vector3d seen = line.point_world + along_m * line.direction_world;
  return LargestSigma(across * moved * covariance * moved.transpose() * across) /
         (seen - view.centre).norm();
}

}  // namespace

std::optional<StructuralLineFit> TriangulateStructuralLine(
    const std::vector<PosedLineObservation>& observations, const StructuralLine& line,
    double heading_rad, const StereoGeometry& geometry, const LineTriangulationOptions& options) {
  const std::vector<SegmentView> views = CollectViews(observations, geometry);
  const std::optional<Vector2d> crossing = MeetAxisPlanes(views, line, heading_rad);
  if (!crossing) return std::nullopt;
  StructuralLineFit fit{{std::atan2(crossing->y(), crossing->x()), 1 / crossing->norm()}, {}};
  Factors factors;
  for (const PosedLineObservation& observation : observations) {
    factors.push_back(
        std::make_unique<StructuralLineResidual>(&geometry, line, observation.measurement));
  }
  const LineProblem problem(std::move(factors), observations, heading_rad, options.loss_sigma);
  const auto covariance = Refine(problem, kStructuralLineKind, fit.block.data());
  if (!covariance || !IsWithin(1 / fit.block[1], options)) return std::nullopt;
  fit.covariance = *covariance;
  // Relative to the distance 1 / rho: across the ray by dtheta, along it by drho / rho.
  const Vector2d scale(1, 1 / fit.block[1]);
  const Matrix2d relative = scale.asDiagonal() * fit.covariance * scale.asDiagonal();
  const double sigma =
      std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix2d>(relative).eigenvalues()[1]);
  const PointAndDirection in_world{CrossingPoint(line, heading_rad, fit.block.data()),
                                   AxisDirection(line.axis, heading_rad)};
  if (!(sigma < kMaxRelativeSigma) || !IsInFront(in_world, views)) return std::nullopt;
  return fit;
}

std::optional<GeneralLineFit> TriangulateGeneralLine(
    const std::vector<PosedLineObservation>& observations, const Vector3d& anchor_world,
    const StereoGeometry& geometry, const LineTriangulationOptions& options) {
  const std::vector<SegmentView> views = CollectViews(observations, geometry);
  const std::optional<PointAndDirection> start = MeetPlanes(views, anchor_world);
  if (!start || !IsWithin((start->point_world - anchor_world).norm(), options)) return std::nullopt;
  GeneralLineFit fit{
      GeneralLineThrough(anchor_world, start->point_world, start->direction_world), {}, {}};
  Factors factors;
  for (const PosedLineObservation& observation : observations) {
    factors.push_back(
        std::make_unique<GeneralLineResidual>(&geometry, anchor_world, observation.measurement));
  }
  const LineProblem problem(std::move(factors), observations, 0, options.loss_sigma);
  const auto covariance = Refine(problem, kGeneralLineKind, fit.block.data());
  const PointAndDirection line = GeneralLineFromBlock(anchor_world, fit.block.data());
  if (!covariance || !IsWithin((line.point_world - anchor_world).norm(), options) ||
      !IsInFront(line, views)) {
    return std::nullopt;
  }
  fit.covariance = *covariance;
  const Eigen::Matrix<double, 3, 4> turned = GeneralLineTurn(fit.block.data());
  fit.direction_covariance = turned * fit.covariance * turned.transpose();
  if (!(LargestSigma(fit.direction_covariance) < kMaxDirectionSigma_rad) ||
      !(RelativeSigma(fit.block, line, fit.covariance, views[0]) < kMaxRelativeSigma)) {
    return std::nullopt;
  }
  return fit;
}

std::optional<std::pair<double, double>> ExtentAlong(const PointAndDirection& line,
                                                     const LineSegment& segment,
                                                     const RigidTransform& T_world_camera) {
  const StereoGeometry one_camera({RigidTransform()}, 1);
  const SegmentView view = MakeSegmentView(segment, 0, one_camera, T_world_camera);
  const std::optional<double> start = MeetRay(line, view.centre, view.start);
  const std::optional<double> end = MeetRay(line, view.centre, view.end);
  if (!start || !end) return std::nullopt;
  return std::minmax({*start, *end});
}

}  // namespace slcmap::odometry
