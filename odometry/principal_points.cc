#include "odometry/principal_points.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "odometry/geometry/pinhole.h"
#include "odometry/residuals/principal_point_residual.h"
#include "odometry/window/calibration_estimate.h"
#include "odometry/window/point_landmarks.h"
#include "odometry/window/solver.h"

namespace slcmap {
namespace {

constexpr size_t kMaxPieces = 8;
constexpr size_t kMinObservations = 4;  // of a point that is used
constexpr double kGivenSigma_px = 5;    // of what was given
constexpr int kIterations = 4;

// Cameras' calibration block and principal points.
constexpr int kSize = kCameraCalibrationSize + kPrincipalPointSize;
using Eigen::Vector2d;
using Vector = Eigen::Matrix<double, kSize, 1>;
using Matrix = Eigen::Matrix<double, kSize, kSize>;

// In units of the standard deviations of what was given, with that as prior.
struct Told {
  Vector x;
  Matrix covariance;
};

std::vector<std::span<const Keyframe>> PiecesOf(const std::vector<Keyframe>& keyframes,
                                                size_t size) {
  std::vector<std::span<const Keyframe>> pieces;
  const size_t count = std::min(kMaxPieces, keyframes.size() / size);
  for (size_t k = 0; k < count; ++k) {
    const size_t from = count > 1 ? k * (keyframes.size() - size) / (count - 1) : 0;
    const std::span<const Keyframe> piece(&keyframes[from], size);
    if (piece.front().segment == piece.back().segment) pieces.push_back(piece);
  }
  return pieces;
}

// A piece of the run as an adjustment of its own.
class Piece {
 public:
  Piece(const Rig& given, const OdometryOptions& options, const OdometryRun& run,
        std::span<const Keyframe> keyframes)
      : given_(given), rectified_(run.rectified_rig) {
    const double focal_px = rectified_.cameras[0].fx_px;
    model_.geometry =
        StereoGeometry(rectified_.T_imu_camera, focal_px / options.window.point_sigma_px);
    model_.geometry.lens_shifts =
        std::make_shared<const std::array<LensShift, 2>>(LensShiftsOf(given_, rectified_));
    model_.point_loss = std::make_unique<ceres::HuberLoss>(options.window.point_loss_sigma);
    StartAt(run.calibration);
    for (const Keyframe& keyframe : keyframes) AddFrame(keyframe);
    TriangulatePoints(options.window.triangulation, model_.Corrected(model_.geometry), &window_);
  }

  std::optional<Told> Fit(const Vector& given_sigma) {
    std::vector<Term> terms = Terms();
    SolverOptions solver;
    solver.max_iterations = kIterations;
    StateInformation information;
    const SolverSummary summary = Solve(
        &terms, PriorOf(given_sigma), [](const double*) { return false; }, solver, &information);
    const WindowCovariance covariance(information);
    double* cameras = model_.calibration->cameras.data();
    if (!summary.usable || !covariance.Knows(principal_px_.data())) return std::nullopt;
    Told told;
    told.x << Eigen::Map<const Eigen::Matrix<double, kCameraCalibrationSize, 1>>(cameras),
        Eigen::Map<const Eigen::Vector4d>(principal_px_.data());
    told.x.segment<2>(kRowRightCentre) -= known_centre_px_;
    const Vector scale = given_sigma.cwiseInverse();
    told.x = scale.cwiseProduct(told.x);
    told.covariance =
        scale.asDiagonal() * covariance.Of({cameras, principal_px_.data()}) * scale.asDiagonal();
    return told;
  }

 private:
  void StartAt(const std::vector<CalibrationEstimate>& known) {
    if (known.empty()) return;
    double* cameras = model_.calibration->cameras.data();
    Eigen::Map<Eigen::Vector3d>{cameras + kRowRightRotation} = known.back().right_rotation_rad;
    cameras[kRowFocalLength] = known.back().focal_length;
    // Poses and turn are of the run's with this; it is held, and what is found comes on top.
    known_centre_px_ = known.back().right_centre_px;
    Eigen::Map<Eigen::Vector2d>{cameras + kRowRightCentre} = known_centre_px_;
  }

  void AddFrame(const Keyframe& keyframe) {
    FrameState& frame = *window_.frames.emplace_back(std::make_unique<FrameState>());
    frame.id = keyframe.id;
    PoseToBlock(keyframe.T_world_imu, frame.pose.data());
    for (const KeyframeObservation& seen : keyframe.observations) {
      StereoMeasurement& at = frame.measurements[seen.landmark_id];
      at.left = PlaneFromPixel(rectified_.cameras[0], seen.left_px);
      if (seen.right_px) at.right = PlaneFromPixel(rectified_.cameras[1], *seen.right_px);
    }
    RegisterPoints(&frame, &window_);
  }

  std::vector<Term> Terms() {
    std::vector<Term> terms;
    for (auto& [id, landmark] : window_.landmarks) {
      if (!landmark.triangulated || landmark.frames.size() < kMinObservations) continue;
      for (FrameState* frame : landmark.frames) {
        AddPointTerm(&landmark, frame, model_, &terms);
        AddPrincipalPoints(frame->measurements.at(id), &terms.back());
      }
    }
    return terms;
  }

  void AddPrincipalPoints(const StereoMeasurement& seen, Term* term) {
    const int own = term->factor->blocks() - 1;
    term->blocks[own + 1] = term->blocks[own];
    term->blocks[own] = principal_px_.data();
    std::array<Eigen::Matrix2d, 2> by_pixel{ByPixel(0, seen.left), Eigen::Matrix2d::Zero()};
    if (seen.right) by_pixel[1] = ByPixel(1, *seen.right);
    term->factor = std::make_unique<PrincipalPointResidual>(std::move(term->factor),
                                                            model_.geometry.weight, by_pixel);
  }

  Eigen::Matrix2d ByPixel(int camera, const Eigen::Vector2d& measured) const {
    const Eigen::Quaterniond R_camera_rectified =
        given_.T_imu_camera[camera].rotation.conjugate() * rectified_.T_imu_camera[camera].rotation;
    return PlaneByPixel(given_.cameras[camera], R_camera_rectified, measured);
  }

  // Where the piece stands is nobody's to know.
  Prior PriorOf(const Vector& given_sigma) {
    constexpr double kHeld = 1e-6;
    FrameState& first = *window_.frames.front();
    CalibrationState& calibration = *model_.calibration;
    Prior prior;
    prior.blocks = {first.pose.data(), calibration.cameras.data(), principal_px_.data()};
    prior.kinds = {kPoseKind, kCameraCalibrationKind, kPrincipalPointKind};
    prior.x_lin = {{first.pose.begin(), first.pose.end()},
                   std::vector<double>(kCameraCalibrationSize),
                   std::vector<double>(kPrincipalPointSize)};
    std::copy_n(known_centre_px_.data(), 2, prior.x_lin[1].begin() + kRowRightCentre);
    Eigen::VectorXd sigma(kPoseTangentSize + kSize);
    sigma << Eigen::Matrix<double, kPoseTangentSize, 1>::Constant(kHeld), given_sigma;
    prior.jacobian = sigma.cwiseInverse().asDiagonal();
    prior.residual = Eigen::VectorXd::Zero(sigma.size());
    return prior;
  }

  const Rig& given_;
  const Rig& rectified_;
  CostModel model_;
  WindowState window_;
  std::array<double, kPrincipalPointSize> principal_px_{};
  Vector2d known_centre_px_ = Vector2d::Zero();
};

Vector GivenSigma(const CalibrationOptions& options) {
  constexpr double kHeldSigma = 1e-7;
  Vector sigma;
  sigma << EstimatedSigma(options).tail<kCameraCalibrationSize>().cwiseMax(kHeldSigma),
      Eigen::Vector4d::Constant(kGivenSigma_px);
  sigma.segment<2>(kRowRightCentre).setConstant(kHeldSigma);  // among the others here
  return sigma;
}

// All pieces in one: what each knows beyond the prior, and the prior once.
Told Together(const std::vector<Told>& pieces) {
  Matrix information = Matrix::Identity();
  Vector product = Vector::Zero();
  for (const Told& piece : pieces) {
    const Matrix known = piece.covariance.ldlt().solve(Matrix::Identity());
    information += known - Matrix::Identity();
    product += known * piece.x;
  }
  const Eigen::LDLT<Matrix> solver(information);
  return {solver.solve(product), solver.solve(Matrix::Identity())};
}

// By how much the pieces scatter about what they say together, as a share of what they claim.
double ScatterOf(const std::vector<Told>& pieces, const Told& together) {
  if (pieces.size() < 2) return 1;
  double chi2 = 0;
  for (const Told& piece : pieces) {
    const Eigen::Vector4d off = (piece.x - together.x).tail<4>();
    const Eigen::Matrix4d covariance = piece.covariance.bottomRightCorner<4, 4>();
    chi2 += off.dot(covariance.ldlt().solve(off));
  }
  return std::sqrt(chi2 / static_cast<double>(kPrincipalPointSize * (pieces.size() - 1)));
}

}  // namespace

std::optional<PrincipalPoints> FitPrincipalPoints(const Rig& given, const OdometryOptions& options,
                                                  const OdometryRun& run) {
  if (!options.calibration.principal_points || options.method == Method::kPointsMono) return {};
  const Vector given_sigma = GivenSigma(options.calibration);
  std::vector<Told> told;
  for (const auto& keyframes : PiecesOf(run.keyframes, options.window.max_keyframes)) {
    if (auto piece = Piece(given, options, run, keyframes).Fit(given_sigma)) {
      told.push_back(std::move(*piece));
    }
  }
  if (told.empty()) return {};
  const Told together = Together(told);
  const double scale = std::max(options.calibration.sigma_scale, ScatterOf(told, together));
  PrincipalPoints out;
  for (int camera = 0; camera < 2; ++camera) {
    const int row = kCameraCalibrationSize + 2 * camera;
    out.offset_px[camera] = kGivenSigma_px * together.x.segment<2>(row);
    const Vector2d sigma = scale * together.covariance.diagonal().segment<2>(row).cwiseSqrt();
    out.sigma_px[camera] = kGivenSigma_px * sigma.cwiseMin(1);
  }
  if (!run.calibration.empty()) out.offset_px[1] += run.calibration.back().right_centre_px;
  return out;
}

}  // namespace slcmap
