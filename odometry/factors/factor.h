// The parameter blocks of the estimator, also of the rig's calibration: how many numbers they have,
// how they are perturbed, and whether they are eliminated. The base of the estimator's residuals:
// linear in tangent space, with first-estimate Jacobians; the prior, and the terms of what is as
// given and of standing still.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/manifold.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <vector>

#include "data/core/rigid_transform.h"
#include "odometry/geometry/imu.h"
#include "odometry/geometry/lines.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline odometry {

// A pose block is (p_world_imu, q_world_imu as x y z w). Its tangent is (dp, dtheta):
// p <- p + dp in world axes, R <- R Exp(dtheta) in body axes.
inline constexpr int kPoseSize = 7;
inline constexpr int kPoseTangentSize = 6;

// A speed-and-bias block is (v_world, gyroscope bias, accelerometer bias), perturbed by addition.
inline constexpr int kSpeedBiasSize = 9;

using Matrix34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return kPoseTangentSize; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// d Log(x^-1 y) / d y at y = x for rotations stored as x y z w.
Matrix34d RotationMinusJacobian(const double* quaternion);

RigidTransform PoseFromBlock(const double* pose);
void PoseToBlock(const RigidTransform& pose, double* block);

// How a general line block is perturbed.

class OrthonormalLineManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kGeneralLineSize; }
  int TangentSize() const override { return kGeneralLineTangentSize; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// What the window estimates of the rig beside its motion: where the IMU is against the cameras, and
// the cameras against each other, as corrections of the calibration that was given.

// The body is the left camera's rigid frame, placed where the given calibration has the IMU: poses
// of the window are the body's at the very moment of exposure. An IMU calibration block is
//
//   (phi, tau, delta, e): rotation vector in rad, lever in m, time in s, errors
//   (odometry/geometry/imu.h)
//
// with the IMU's true place in the body T_body_imu = (Exp(phi), tau), and exposure later by delta,
// on the IMU's clock, than the given time offset has it, and the IMU's readings to be corrected for
// e, which comes after what the given calibration says of them. Perturbed by addition.
inline constexpr int kImuCalibrationSize = 7 + kImuErrorsSize;
enum ImuCalibrationRow { kRowImuRotation = 0, kRowLever = 3, kRowTimeOffset = 6, kRowErrors = 7 };

// A camera calibration block is
//
//   (psi, s, d): rotation vector in rad, the share by which focal lengths are longer than given,
//   and by how many px of the image as it was recorded the right camera's principal point is off
//
// with the right camera's true place T_imu_right (Exp(psi), 0), and a point p of a camera's true
// frame seen where p.xy / p.z = m - s / (1 + s) g(m) - H(m) d holds for the measurement m on the
// plane z = 1 (see odometry/geometry/pinhole.h; of an ideal pinhole m = (1 + s) p.xy / p.z + d / f;
// d is 0 in the left camera). Perturbed by addition. Of both principal points in common little is
// told: it looks like a turn of the IMU.
inline constexpr int kCameraCalibrationSize = 6;
enum CameraCalibrationRow { kRowRightRotation = 0, kRowFocalLength = 3, kRowRightCentre = 4 };

using ImuCalibrationBlock = std::array<double, kImuCalibrationSize>;
using CameraCalibrationBlock = std::array<double, kCameraCalibrationSize>;

struct CalibrationState {
  ImuCalibrationBlock imu{};
  CameraCalibrationBlock cameras{};
};

// Both blocks as one vector: the IMU's, then that of the cameras.
inline constexpr int kCameras = kImuCalibrationSize;  // row where the cameras' block starts
inline constexpr int kCalibrationSize = kImuCalibrationSize + kCameraCalibrationSize;
using CalibrationVector = Eigen::Matrix<double, kCalibrationSize, 1>;
using CalibrationMatrix = Eigen::Matrix<double, kCalibrationSize, kCalibrationSize>;

// The turn Exp(psi) of the right camera of a camera calibration block.
inline Eigen::Quaterniond RightRotation(const double* block) {
  return ExpRotation(Eigen::Map<const Eigen::Vector3d>(block + kRowRightRotation));
}

// What a camera calibration block says of the lens of the left camera (0) or of the right one.
inline LensCorrection GetLens(int camera, const double* block) {
  LensCorrection lens;
  lens.focal_length = block[kRowFocalLength];
  if (camera == 1) lens.centre_px = Eigen::Map<const Eigen::Vector2d>(block + kRowRightCentre);
  return lens;
}

// Of an IMU calibration block.
inline ImuErrors GetErrors(const double* block) {
  return Eigen::Map<const ImuErrors>(block + kRowErrors);
}
inline RigidTransform BodyFromImu(const double* block) {
  return {ExpRotation(Eigen::Map<const Eigen::Vector3d>(block + kRowImuRotation)),
          Eigen::Map<const Eigen::Vector3d>(block + kRowLever)};
}

ceres::Manifold* SharedPoseManifold();
ceres::Manifold* SharedLineManifold();  // of general lines

// Terms and the prior say of each block of which kind it is: nothing is concluded from its size.
struct BlockKind {
  int size = 0;          // numbers of the block
  int tangent_size = 0;  // freedoms
  // How tangents are added; null where as numbers are. Shared by all blocks: it has no state.
  ceres::Manifold* (*manifold)() = nullptr;
  // A point, which has three freedoms and is eliminated before all else: it may depend on any
  // state, but no term binds two, and a term binds it last.
  bool is_point = false;
  // A line, which no term binds with another line: where the prior does not bind it either, it is
  // eliminated early.
  bool is_line = false;
  bool is_calibration = false;  // of the rig: there as long as the window
};

inline constexpr int kPointSize = 3;            // see point_residual.h
inline constexpr int kSharedDeviationSize = 2;  // see odometry/factors/line_constraints.h

inline constexpr BlockKind kPoseKind{kPoseSize, kPoseTangentSize, SharedPoseManifold};
inline constexpr BlockKind kSpeedBiasKind{kSpeedBiasSize, kSpeedBiasSize};
inline constexpr BlockKind kImuCalibrationKind{
    kImuCalibrationSize, kImuCalibrationSize, nullptr, false, false, true};
inline constexpr BlockKind kCameraCalibrationKind{
    kCameraCalibrationSize, kCameraCalibrationSize, nullptr, false, false, true};
// By how much longer than given the readout of rolling shutters is, in s.
inline constexpr BlockKind kReadoutKind{1, 1, nullptr, false, false, true};
inline constexpr BlockKind kHeadingKind{kHeadingSize, kHeadingSize};
inline constexpr BlockKind kSharedDeviationKind{kSharedDeviationSize, kSharedDeviationSize};
inline constexpr BlockKind kSlopeKind{kSlopeSize, kSlopeSize};
inline constexpr BlockKind kStructuralLineKind{kStructuralLineSize, kStructuralLineSize, nullptr,
                                               false, true};
inline constexpr BlockKind kGeneralLineKind{kGeneralLineSize, kGeneralLineTangentSize,
                                            SharedLineManifold, false, true};
inline constexpr BlockKind kPointKind{kPointSize, kPointSize, nullptr, true};

// The block at x, moved by a tangent vector.
void BlockPlus(const BlockKind& kind, const double* x, const double* delta, double* x_plus_delta);

// The tangent vector y minus x of two blocks of a kind.
void BlockMinus(const BlockKind& kind, const double* y, const double* x, double* y_minus_x);

// A residual's Jacobian by the numbers of the block at x, from that by its tangent. Both are
// row-major, rows x kind.tangent_size and rows x kind.size.
void JacobianByBlock(const BlockKind& kind, const double* x, int rows, const double* by_tangent,
                     double* by_block);

// A whitened residual of one to five parameter blocks.
//
// Jacobians are evaluated at the linearisation point of a block where one is set, and at the
// current estimate elsewhere; residuals always at the current estimate. Blocks that the
// marginalisation prior touches have one, so that all terms agree on what cannot be observed
// (first-estimate Jacobians; Huang, Mourikis and Roumeliotis, ISER 2008).
class Factor : public ceres::CostFunction {
 public:
  static constexpr int kMaxBlocks = 5;

  // The point must outlive the factor; null means the current estimate.
  void SetLinearizationPoint(int block, const double* point) { linearization_[block] = point; }

  int rows() const { return num_residuals(); }
  int blocks() const { return static_cast<int>(parameter_block_sizes().size()); }
  const BlockKind& kind(int block) const { return kinds_[block]; }
  int tangent_size(int block) const { return kinds_[block].tangent_size; }

  // Whitened residuals at `parameters`, and Jacobians by each block's tangent (row-major, rows() x
  // tangent_size(k); null where not wanted) at the linearisation points.
  void Linearize(const double* const* parameters, double* residuals, double** jacobians) const;

  // As Ceres wants it: Jacobians by all numbers of a block.
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 protected:
  Factor(int rows, const std::vector<BlockKind>& kinds);

  // Residuals and tangent Jacobians at one and the same point. jacobians may be null, and so may
  // each of its entries.
  virtual void EvaluateAt(const double* const* parameters, double* residuals,
                          double** jacobians) const = 0;

 private:
  std::array<BlockKind, kMaxBlocks> kinds_;
  std::array<const double*, kMaxBlocks> linearization_{};
};

// What is known of the window's states from everything that has left the window.

// A linear term in square-root form: |residual + jacobian (x minus x_lin)|^2, where the columns of
// the Jacobian are the tangents of the blocks in their order.
struct Prior {
  std::vector<double*> blocks;  // the parameter blocks it speaks of
  std::vector<BlockKind> kinds;
  std::vector<std::vector<double>> x_lin;  // where each was linearised
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;

  bool empty() const { return blocks.empty(); }
  int TangentOffset(int block) const;
  int TangentTotal() const;
  // x minus x_lin of all blocks at their current values (in `parameters`, in the order of blocks).
  Eigen::VectorXd Difference(const double* const* parameters) const;
};

// Block: a calibration block (see blocks.h), whose numbers are corrections of what was given.
// r = weights * x, a row a number; a weight is one over a standard deviation, or 0.
class AsGivenResidual final : public Factor {
 public:
  AsGivenResidual(const BlockKind& kind, const Eigen::VectorXd& weights);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  Eigen::VectorXd weights_;
};

// Blocks: the readout, then those of the residual that it is put around, whose linearisation points
// it keeps. Of a measurement that was brought to its stamp by the readout `at_s` and moves with it:
// r = residual + by_readout (readout - at_s).
class ByReadoutResidual final : public Factor {
 public:
  // by_readout: 1 / s, a row a residual.
  ByReadoutResidual(std::unique_ptr<Factor> residual, const Eigen::VectorXd& by_readout,
                    double at_s);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  std::unique_ptr<Factor> residual_;
  Eigen::VectorXd by_readout_;
  double at_s_;
};

// Block: speed-and-bias. r = v / sigma, three rows.
class ZeroVelocityResidual final : public Factor {
 public:
  explicit ZeroVelocityResidual(double sigma_m_s);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

}  // namespace slcmap::odometry
