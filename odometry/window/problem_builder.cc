#include "odometry/window/problem_builder.h"

#include "odometry/residuals/imu_residual.h"
#include "odometry/residuals/zero_velocity_residual.h"

namespace slcmap {
namespace {

const double* Linearization(const std::optional<PoseBlock>& point) {
  return point ? point->data() : nullptr;
}

const double* Linearization(const std::optional<SpeedBiasBlock>& point) {
  return point ? point->data() : nullptr;
}

}  // namespace

void AddImuTerm(FrameState* from, FrameState* to, std::vector<Term>* terms) {
  Term term;
  term.factor = std::make_unique<ImuResidual>(to->from_previous.get());
  term.blocks = {from->pose.data(), from->speed_bias.data(), to->pose.data(),
                 to->speed_bias.data()};
  term.factor->SetLinearizationPoint(0, Linearization(from->pose_linearization));
  term.factor->SetLinearizationPoint(1, Linearization(from->speed_bias_linearization));
  term.factor->SetLinearizationPoint(2, Linearization(to->pose_linearization));
  term.factor->SetLinearizationPoint(3, Linearization(to->speed_bias_linearization));
  terms->push_back(std::move(term));
}

void AddZeroVelocityTerm(FrameState* frame, const CostModel& model, std::vector<Term>* terms) {
  Term term;
  term.factor = std::make_unique<ZeroVelocityResidual>(model.zero_velocity_sigma_m_s);
  term.blocks[0] = frame->speed_bias.data();
  terms->push_back(std::move(term));
}

void AddPointTerm(PointLandmark* landmark, FrameState* frame, const CostModel& model,
                  std::vector<Term>* terms) {
  FrameState* host = landmark->host();
  const StereoMeasurement& measurement = frame->measurements.at(landmark->id);
  Term term;
  term.loss = model.point_loss.get();
  if (frame == host) {
    term.factor = std::make_unique<HostPointResidual>(model.geometry, measurement);
    term.blocks[0] = landmark->point.data();
  } else {
    term.factor = std::make_unique<PointResidual>(&model.geometry, measurement);
    term.blocks = {host->pose.data(), frame->pose.data(), landmark->point.data()};
    term.factor->SetLinearizationPoint(0, Linearization(host->pose_linearization));
    term.factor->SetLinearizationPoint(1, Linearization(frame->pose_linearization));
  }
  terms->push_back(std::move(term));
}

void AddPointTerms(PointLandmark* landmark, const CostModel& model, std::vector<Term>* terms) {
  for (FrameState* frame : landmark->frames) AddPointTerm(landmark, frame, model, terms);
}

std::vector<Term> BuildTerms(WindowState* window, const CostModel& model) {
  std::vector<Term> terms;
  for (size_t i = 0; i < window->frames.size(); ++i) {
    FrameState* frame = window->frames[i].get();
    if (i > 0) AddImuTerm(window->frames[i - 1].get(), frame, &terms);
    if (frame->stands_still) AddZeroVelocityTerm(frame, model, &terms);
  }
  for (auto& [id, landmark] : window->landmarks) {
    if (landmark.triangulated) AddPointTerms(&landmark, model, &terms);
  }
  return terms;
}

}  // namespace slcmap
