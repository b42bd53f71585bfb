#include "odometry/window/problem.h"

#include <algorithm>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "data/core/math.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/imu_factor.h"
#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "odometry/geometry/imu.h"

namespace slcmap::inline odometry {
namespace {

// A window, frame or landmark of which the terms move something, or do not: one code for both.
template <typename Number, typename T>
using Of = std::conditional_t<std::is_const_v<Number>, const T, T>;

// Binds a block that may have a linearisation point.
template <typename Number, typename Block>
void Bind(int index, Block& block, const std::optional<std::remove_const_t<Block>>& linearization,
          BasicTerm<Number>* term) {
  term->blocks[index] = block.data();
  term->factor->SetLinearizationPoint(index, linearization ? linearization->data() : nullptr);
}

template <typename Number>
void BindPose(int index, Of<Number, FrameState>& frame, BasicTerm<Number>* term) {
  Bind(index, frame.pose, frame.pose_linearization, term);
}

template <typename Number>
void BindSpeedBias(int index, Of<Number, FrameState>& frame, BasicTerm<Number>* term) {
  Bind(index, frame.speed_bias, frame.speed_bias_linearization, term);
}

// Binds the heading, where the line has one.
template <typename Number>
int BindHeading(int index, Of<Number, LineLandmark>& line, BasicTerm<Number>* term) {
  if (line.heading) {
    Bind(index++, line.heading->heading_rad, line.heading->linearization, term);
  }
  return index;
}

// Binds the heading, where the line's block needs one, and the line itself; returns the next index.
template <typename Number>
int BindLine(int index, Of<Number, LineLandmark>& line, BasicTerm<Number>* term) {
  if (line.IsExact()) index = BindHeading(index, line, term);
  Bind(index++, line.block, line.linearization, term);
  return index;
}

// Puts the readout before what the term binds, where it is estimated. `make` makes the term's
// factor of a measurement, which is linear in where that is.
template <typename Number, typename Measurement, typename Make>
void BindReadout(const Measurement& measurement, const Make& make, const CostModel& model,
                 BasicTerm<Number>* term) {
  constexpr double kStep_s = 1e-3;
  if (!model.readout || measurement.timed.empty()) return;
  const auto rows = term->factor->rows();
  Eigen::VectorXd residual(rows), moved(rows);
  term->factor->Linearize(term->blocks.data(), residual.data(), nullptr);
  make(measurement.WithReadoutLonger(kStep_s))
      ->Linearize(term->blocks.data(), moved.data(), nullptr);
  term->factor = std::make_unique<ByReadoutResidual>(std::move(term->factor),
                                                     (moved - residual) / kStep_s, *model.readout);
  std::copy_backward(term->blocks.begin(), term->blocks.end() - 1, term->blocks.end());
  term->blocks[0] = model.readout.get();
}

template <typename Number>
BasicTerm<Number> ImuTerm(Of<Number, FrameState>& from, Of<Number, FrameState>& to,
                          const CostModel& model) {
  BasicTerm<Number> term;
  term.factor = std::make_unique<ImuResidual>(to.from_previous.get(), from.cut, to.cut);
  BindPose(0, from, &term);
  BindSpeedBias(1, from, &term);
  BindPose(2, to, &term);
  BindSpeedBias(3, to, &term);
  term.blocks[4] = model.calibration->imu.data();
  return term;
}

template <typename Number>
BasicTerm<Number> ZeroVelocityTerm(Of<Number, FrameState>& frame, const CostModel& model) {
  BasicTerm<Number> term;
  term.factor = std::make_unique<ZeroVelocityResidual>(model.zero_velocity_sigma_m_s);
  BindSpeedBias(0, frame, &term);
  return term;
}

template <typename Number>
BasicTerm<Number> PointTerm(Of<Number, PointLandmark>& landmark, Of<Number, FrameState>& frame,
                            const CostModel& model) {
  Of<Number, FrameState>& host = *landmark.host();
  const StereoMeasurement& measurement = frame.measurements.at(landmark.id);
  BasicTerm<Number> term;
  term.loss = model.point_loss.get();
  const bool is_host = &frame == &host;
  const auto make = [&](const StereoMeasurement& measured) -> std::unique_ptr<Factor> {
    if (is_host) return std::make_unique<HostPointResidual>(model.geometry, measured);
    return std::make_unique<PointResidual>(&model.geometry, measured, landmark.camera);
  };
  term.factor = make(measurement);
  int next = 0;
  if (!is_host) {
    BindPose(next++, host, &term);
    BindPose(next++, frame, &term);
  }
  term.blocks[next++] = model.calibration->cameras.data();
  term.blocks[next] = landmark.point.data();
  BindReadout(measurement, make, model, &term);
  return term;
}

template <typename Number>
BasicTerm<Number> LineTerm(Of<Number, LineLandmark>& line, Of<Number, FrameState>& frame,
                           const CostModel& model) {
  const StereoLineMeasurement& measurement = frame.lines.at(line.id);
  BasicTerm<Number> term;
  term.loss = model.line_loss.get();
  const auto make = [&](const StereoLineMeasurement& measured) -> std::unique_ptr<Factor> {
    if (line.IsExact()) {
      return std::make_unique<StructuralLineResidual>(&model.lines, line.structural(), measured,
                                                      true);
    }
    return std::make_unique<GeneralLineResidual>(&model.lines, line.anchor_world, measured, true);
  };
  term.factor = make(measurement);
  BindPose(0, frame, &term);
  term.blocks[1] = model.calibration->cameras.data();
  BindLine(2, line, &term);
  BindReadout(measurement, make, model, &term);
  return term;
}

template <typename Number>
BasicTerm<Number> PointOnLineTerm(Of<Number, PointLandmark>& landmark,
                                  Of<Number, LineLandmark>& line, const CostModel& model) {
  BasicTerm<Number> term;
  term.loss = model.point_on_line_loss.get();
  if (line.IsExact()) {
    term.factor = std::make_unique<PointOnLineResidual>(
        &model.geometry, line.structural(), model.point_on_line_sigma_m, landmark.camera);
  } else {
    term.factor = std::make_unique<PointOnFreeLineResidual>(
        &model.geometry, line.anchor_world, model.point_on_line_sigma_m, landmark.camera);
  }
  BindPose(0, *landmark.host(), &term);
  const int next = BindLine(1, line, &term);
  term.blocks[next] = landmark.point.data();
  return term;
}

template <typename Number>
BasicTerm<Number> AlongAxisTerm(Of<Number, LineLandmark>& line, const CostModel& model) {
  BasicTerm<Number> term;
  term.loss = model.along_axis_loss.get();
  int next = 0;
  if (line.slope) {
    term.factor = std::make_unique<AlongSlopeResidual>(line.deviation_sigma_rad);
    Bind(next++, line.slope->angles_rad, line.slope->linearization, &term);
  } else {
    term.factor =
        std::make_unique<AlongAxisResidual>(line.axis, line.deviation_sigma_rad, line.shared);
    next = BindHeading(0, line, &term);
    if (line.shared) term.blocks[next++] = line.shared->off_rad.data();
  }
  Bind(next, line.block, line.linearization, &term);
  return term;
}

template <typename Number>
BasicTerm<Number> SharedDeviationTerm(Of<Number, SharedDeviation>& shared) {
  BasicTerm<Number> term;
  term.factor = std::make_unique<SharedDeviationResidual>(shared.sigma_rad);
  term.blocks[0] = shared.off_rad.data();
  return term;
}

template <typename Number>
void AddFrameTerms(const WindowState& window, const CostModel& model,
                   std::vector<BasicTerm<Number>>* terms) {
  for (size_t i = 0; i < window.frames.size(); ++i) {
    FrameState& frame = *window.frames[i];
    if (i > 0) terms->push_back(ImuTerm<Number>(*window.frames[i - 1], frame, model));
    if (frame.stands_still) terms->push_back(ZeroVelocityTerm<Number>(frame, model));
  }
}

template <typename Number>
void AddLineTerms(Of<Number, LineLandmark>& line, Of<Number, WindowState>& window,
                  const CostModel& model, std::vector<BasicTerm<Number>>* terms) {
  for (FrameState* frame : line.frames) terms->push_back(LineTerm<Number>(line, *frame, model));
  if (!line.IsStructural()) return;
  if (line.MayDeviate()) terms->push_back(AlongAxisTerm<Number>(line, model));
  for (const int64_t id : line.points) {
    const auto it = window.landmarks.find(id);
    if (it == window.landmarks.end() || !it->second.triangulated) continue;
    terms->push_back(PointOnLineTerm<Number>(it->second, line, model));
  }
}

template <typename Number>
void AddNominalPrior(const CostModel& model, std::vector<BasicTerm<Number>>* terms) {
  const auto add = [&](const BlockKind& kind, int row, auto& block) {
    const Eigen::VectorXd weights = model.calibration_ties.segment(row, kind.size);
    if (weights.isZero(0)) return;
    BasicTerm<Number>& term = terms->emplace_back();
    term.factor = std::make_unique<AsGivenResidual>(kind, weights);
    term.blocks[0] = block.data();
  };
  add(kImuCalibrationKind, 0, model.calibration->imu);
  add(kCameraCalibrationKind, kImuCalibrationSize, model.calibration->cameras);
}

template <typename Number>
std::vector<BasicTerm<Number>> AllTerms(Of<Number, WindowState>& window, const CostModel& model) {
  std::vector<BasicTerm<Number>> terms;
  AddNominalPrior(model, &terms);
  AddFrameTerms(window, model, &terms);
  for (auto& [id, landmark] : window.landmarks) {
    if (!landmark.triangulated) continue;
    for (FrameState* frame : landmark.frames) {
      terms.push_back(PointTerm<Number>(landmark, *frame, model));
    }
  }
  for (auto& shared : window.shared_deviations) {
    terms.push_back(SharedDeviationTerm<Number>(shared));
  }
  for (auto& [id, line] : window.lines) {
    if (line.estimated && !line.retired) AddLineTerms<Number>(line, window, model, &terms);
  }
  return terms;
}

}  // namespace

void AddImuTerm(FrameState* from, FrameState* to, const CostModel& model,
                std::vector<Term>* terms) {
  terms->push_back(ImuTerm<double>(*from, *to, model));
}

void AddZeroVelocityTerm(FrameState* frame, const CostModel& model, std::vector<Term>* terms) {
  terms->push_back(ZeroVelocityTerm<double>(*frame, model));
}

void AddPointTerm(PointLandmark* landmark, FrameState* frame, const CostModel& model,
                  std::vector<Term>* terms) {
  terms->push_back(PointTerm<double>(*landmark, *frame, model));
}

void AddPointTerms(PointLandmark* landmark, const CostModel& model, std::vector<Term>* terms) {
  for (FrameState* frame : landmark->frames) AddPointTerm(landmark, frame, model, terms);
}

void AddLineTerm(LineLandmark* line, FrameState* frame, const CostModel& model,
                 std::vector<Term>* terms) {
  terms->push_back(LineTerm<double>(*line, *frame, model));
}

void AddPointOnLineTerm(PointLandmark* landmark, LineLandmark* line, const CostModel& model,
                        std::vector<Term>* terms) {
  terms->push_back(PointOnLineTerm<double>(*landmark, *line, model));
}

void AddAlongAxisTerm(LineLandmark* line, const CostModel& model, std::vector<Term>* terms) {
  terms->push_back(AlongAxisTerm<double>(*line, model));
}

void AddSharedDeviationTerm(SharedDeviation* shared, std::vector<Term>* terms) {
  terms->push_back(SharedDeviationTerm<double>(*shared));
}

std::vector<Term> BuildTerms(WindowState* window, const CostModel& model) {
  return AllTerms<double>(*window, model);
}

FixedTerm FixedPointTerm(const PointLandmark& landmark, const FrameState& frame,
                         const CostModel& model) {
  return PointTerm<const double>(landmark, frame, model);
}

std::vector<FixedTerm> FixedPointTerms(const PointLandmark& landmark, const CostModel& model) {
  std::vector<FixedTerm> terms;
  for (const FrameState* frame : landmark.frames) {
    terms.push_back(FixedPointTerm(landmark, *frame, model));
  }
  return terms;
}

FixedTerm FixedLineTerm(const LineLandmark& line, const FrameState& frame, const CostModel& model) {
  return LineTerm<const double>(line, frame, model);
}

FixedTerm FixedAlongAxisTerm(const LineLandmark& line, const CostModel& model) {
  return AlongAxisTerm<const double>(line, model);
}

std::vector<FixedTerm> FixedTerms(const WindowState& window, const CostModel& model) {
  return AllTerms<const double>(window, model);
}

ImuFit MeasureImuFit(const CostModel& model, const FrameState& from, const FrameState& to) {
  constexpr int kRows = 15;
  using Residual = Eigen::Matrix<double, kRows, 1>;
  const Preintegration& imu = *to.from_previous;
  const ImuResidual factor(&imu, from.cut, to.cut);
  const double* const blocks[] = {from.pose.data(), from.speed_bias.data(), to.pose.data(),
                                  to.speed_bias.data(), model.calibration->imu.data()};
  Residual whitened;
  factor.Evaluate(blocks, whitened.data(), nullptr);
  ImuFit fit;
  fit.chi2 = whitened.squaredNorm() / kRows;
  if (imu.duration_s() <= 0) return fit;
  // With the covariance C and C^-1 = W^T W, C W^T turns W r into r again.
  const Residual r = imu.covariance() * (imu.SqrtInformation().transpose() * whitened);
  fit.turn_rate_rad_s = r.segment<3>(kRowRotation).norm() / imu.duration_s();
  fit.acceleration_m_s2 = r.segment<3>(kRowVelocity).norm() / imu.duration_s();
  return fit;
}

WindowFit MeasureWindowFit(const CostModel& model, const WindowState& window) {
  WindowFit fit;
  const size_t intervals = window.frames.size() - 1;
  for (size_t i = 0; i < intervals; ++i) {
    fit.imu_chi2 += MeasureImuFit(model, *window.frames[i], *window.frames[i + 1]).chi2 /
                    static_cast<double>(intervals);
  }
  for (const auto& [id, measurement] : window.frames.back()->measurements) {
    if (measurement.camera != 0) continue;
    ++fit.newest_points;
    fit.newest_right += measurement.right.has_value();
  }
  return fit;
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The point of a line that is nearest to a ray; nothing where the two are nearly parallel.
std::optional<Vector3d> NearestOnLine(const PointAndDirection& line, const Vector3d& centre,
                                      const Vector3d& ray) {
  constexpr double kMinSquaredSine = 1e-3;
  const Vector3d between = line.point_world - centre;
  const double cosine = line.direction_world.dot(ray);
  const double squared_sine = 1 - cosine * cosine;
  if (squared_sine < kMinSquaredSine) return std::nullopt;
  const double along_m =
      (cosine * ray.dot(between) - line.direction_world.dot(between)) / squared_sine;
  return line.point_world + along_m * line.direction_world;
}

// What a frame needs to bring its measurements to its stamp.
class FrameAtStamp {
 public:
  FrameAtStamp(const WindowState& window, const CostModel& model, const FrameState& frame)
      : window_(window),
        geometry_(model.geometry),
        readout_change_s_(model.readout ? *model.readout : 0),
        estimates_readout_(model.readout),
        motion_(GetMotion(frame, *model.calibration)),
        T_world_body_(frame.T_world_imu()) {
    std::vector<double> depths;
    for (const auto& [id, point] : frame.measurements) {
      if (const auto depth = StereoDepth(point)) depths.push_back(*depth);
    }
    usual_per_m_ = Quantile(std::move(depths), 0.5);
  }

  void Bring(int64_t id, StereoMeasurement* point) const {
    if (point->timed.empty()) return;
    const std::optional<Vector3d> p_body = PointInBody(id);
    const double depth = StereoDepth(*point).value_or(usual_per_m_);
    point->left = Place(&point->timed[0], point->camera, p_body, depth);
    if (point->right) point->right = Place(&point->timed[1], point->camera + 1, p_body, depth);
  }

  void Bring(int64_t id, StereoLineMeasurement* line) const {
    if (line->timed.empty()) return;
    std::optional<PointAndDirection> in_world;
    const auto known = window_.lines.find(id);
    if (known != window_.lines.end() && known->second.estimated) in_world = known->second.InWorld();
    const auto place = [&](size_t seen, size_t end) {
      TimedPlace* timed = &line->timed[2 * seen + end];
      const int camera = line->camera + static_cast<int>(seen);
      return Place(timed, camera, OnLine(in_world, *timed, camera), usual_per_m_);
    };
    line->left = {place(0, 0), place(0, 1)};
    if (line->right) line->right = LineSegment{place(1, 0), place(1, 1)};
  }

 private:
  std::optional<double> StereoDepth(const StereoMeasurement& point) const {
    if (point.timed.size() < 2 || !point.right) return std::nullopt;
    return InverseDepth(AsKnown(point.timed[0]), AsKnown(point.timed[1]),
                        geometry_.T_imu_camera[point.camera],
                        geometry_.T_imu_camera[point.camera + 1], motion_);
  }

  TimedPlace AsKnown(const TimedPlace& timed) const {
    return timed.WithReadoutLonger(readout_change_s_);
  }

  std::optional<Vector3d> PointInBody(int64_t id) const {
    const auto known = window_.landmarks.find(id);
    if (known == window_.landmarks.end() || !known->second.triangulated) return std::nullopt;
    return T_world_body_.Inverse() * LandmarkInWorld(known->second, geometry_);
  }

  // The point of the line, in the body, that a place in an image shows.
  std::optional<Vector3d> OnLine(const std::optional<PointAndDirection>& line,
                                 const TimedPlace& timed, int camera) const {
    if (!line) return std::nullopt;
    const RigidTransform T_world_camera =
        T_world_body_ * motion_.At(AsKnown(timed).after_s) * geometry_.T_imu_camera[camera];
    const Vector3d ray = T_world_camera.rotation * timed.on_plane.homogeneous().normalized();
    const auto p_world = NearestOnLine(*line, T_world_camera.translation, ray);
    if (!p_world) return std::nullopt;
    return T_world_body_.Inverse() * *p_world;
  }

  // At the stamp; says in `given` how that moves with the readout, where this is estimated.
  Vector2d Place(TimedPlace* given, int camera, const std::optional<Vector3d>& p_body,
                 double inverse_depth_per_m) const {
    constexpr double kStep_s = 1e-4;
    const RigidTransform& T_body_camera = geometry_.T_imu_camera[camera];
    const auto place = [&](double longer_s) {
      const TimedPlace timed = AsKnown(*given).WithReadoutLonger(longer_s);
      std::optional<Vector2d> at;
      if (p_body) at = AtMoment(timed, T_body_camera, motion_, *p_body);
      return at ? *at : AtMoment(timed, T_body_camera, motion_, inverse_depth_per_m);
    };
    if (estimates_readout_) {
      given->by_readout_per_s = (place(kStep_s) - place(-kStep_s)) / (2 * kStep_s);
    }
    return place(0);
  }

  const WindowState& window_;
  const StereoGeometry& geometry_;
  double readout_change_s_;
  bool estimates_readout_;
  BodyMotion motion_;
  RigidTransform T_world_body_;
  double usual_per_m_ = 0;  // inverse depth of what the frame shows
};

bool IsTimed(const FrameState& frame) {
  if (!frame.measurements.empty()) return !frame.measurements.begin()->second.timed.empty();
  return !frame.lines.empty() && !frame.lines.begin()->second.timed.empty();
}

}  // namespace

BodyMotion GetMotion(const FrameState& frame, const CalibrationState& calibration) {
  const double* imu = calibration.imu.data();
  const ImuCorrection correction = MakeCorrection(GetErrors(imu));
  const Eigen::Quaterniond R_body_imu = BodyFromImu(imu).rotation;
  const Eigen::Quaterniond R_body_world = frame.T_world_imu().rotation.conjugate();
  const FeltMotion& felt = frame.felt;
  // The moment is that of the exposure, as its time is estimated.
  const Vector3d rate_rad_s = felt.rate_rad_s + imu[kRowTimeOffset] * felt.rate_change_rad_s2;
  return {R_body_imu * (correction.gyro * rate_rad_s - frame.gyro_bias()),
          R_body_imu * (correction.gyro * felt.rate_change_rad_s2), R_body_world * frame.velocity(),
          R_body_imu * (correction.accel * felt.force_m_s2 - frame.accel_bias()) +
              R_body_world * Vector3d(0, 0, -kGravity_m_s2)};
}

void BringToStamp(const WindowState& window, const CostModel& model, FrameState* frame) {
  if (!IsTimed(*frame)) return;
  const FrameAtStamp at_stamp(window, model, *frame);
  for (auto& [id, point] : frame->measurements) at_stamp.Bring(id, &point);
  for (auto& [id, line] : frame->lines) at_stamp.Bring(id, &line);
}

void BringToStamps(const CostModel& model, WindowState* window) {
  for (auto& frame : window->frames) BringToStamp(*window, model, frame.get());
}

}  // namespace slcmap::odometry
