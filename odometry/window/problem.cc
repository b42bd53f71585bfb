#include "odometry/window/problem.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "odometry/factors/factor.h"
#include "odometry/factors/imu_factor.h"
#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"

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

}  // namespace slcmap::odometry
