#include "odometry/window/problem_builder.h"

#include "odometry/residuals/general_line_residual.h"
#include "odometry/residuals/imu_residual.h"
#include "odometry/residuals/point_on_line_residual.h"
#include "odometry/residuals/structural_line_residual.h"
#include "odometry/residuals/zero_velocity_residual.h"

namespace slcmap {
namespace {

template <typename Block>
const double* Linearization(const std::optional<Block>& point) {
  return point ? point->data() : nullptr;
}

// Binds a block that may have a linearisation point.
template <typename Block>
void Bind(int index, Block* block, const std::optional<Block>& linearization, Term* term) {
  term->blocks[index] = block->data();
  term->factor->SetLinearizationPoint(index, Linearization(linearization));
}

void BindPose(int index, FrameState* frame, Term* term) {
  Bind(index, &frame->pose, frame->pose_linearization, term);
}

// Binds the heading (where the line has one) and the line itself; returns the next index.
int BindLine(int index, LineLandmark* line, Term* term) {
  if (line->heading) {
    Bind(index++, &line->heading->heading_rad, line->heading->linearization, term);
  }
  Bind(index++, &line->block, line->linearization, term);
  return index;
}

}  // namespace

void AddImuTerm(FrameState* from, FrameState* to, std::vector<Term>* terms) {
  Term term;
  term.factor = std::make_unique<ImuResidual>(to->from_previous.get());
  BindPose(0, from, &term);
  Bind(1, &from->speed_bias, from->speed_bias_linearization, &term);
  BindPose(2, to, &term);
  Bind(3, &to->speed_bias, to->speed_bias_linearization, &term);
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
    BindPose(0, host, &term);
    BindPose(1, frame, &term);
    term.blocks[2] = landmark->point.data();
  }
  terms->push_back(std::move(term));
}

void AddPointTerms(PointLandmark* landmark, const CostModel& model, std::vector<Term>* terms) {
  for (FrameState* frame : landmark->frames) AddPointTerm(landmark, frame, model, terms);
}

void AddLineTerm(LineLandmark* line, FrameState* frame, const CostModel& model,
                 std::vector<Term>* terms) {
  const StereoLineMeasurement& measurement = frame->lines.at(line->id);
  Term term;
  term.loss = model.line_loss.get();
  if (line->IsStructural()) {
    term.factor =
        std::make_unique<StructuralLineResidual>(&model.lines, line->structural(), measurement);
  } else {
    term.factor =
        std::make_unique<GeneralLineResidual>(&model.lines, line->anchor_world, measurement);
  }
  BindPose(0, frame, &term);
  BindLine(1, line, &term);
  terms->push_back(std::move(term));
}

void AddPointOnLineTerm(PointLandmark* landmark, LineLandmark* line, const CostModel& model,
                        std::vector<Term>* terms) {
  Term term;
  term.loss = model.point_on_line_loss.get();
  term.factor = std::make_unique<PointOnLineResidual>(&model.geometry, line->structural(),
                                                      model.point_on_line_sigma_m);
  BindPose(0, landmark->host(), &term);
  const int next = BindLine(1, line, &term);
  term.blocks[next] = landmark->point.data();
  terms->push_back(std::move(term));
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
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired) continue;
    for (FrameState* frame : line.frames) AddLineTerm(&line, frame, model, &terms);
    for (PointLandmark* landmark : PointsOf(line, window)) {
      AddPointOnLineTerm(landmark, &line, model, &terms);
    }
  }
  return terms;
}

}  // namespace slcmap
