// What no odometry can know stays unknown: position, and the heading of the world, however many
// states and lines were marginalised where the estimates were off.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <map>

#include "odometry/window/estimator.h"
#include "tests/odometry/window/line_runs.h"

namespace slcmap {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

using Shifted = Eigen::Matrix<double, 3, 4>;

// How a point of the world moves by three shifts and a turn about the vertical.
Shifted MovedPoint(const Vector3d& p_world) {
  Shifted moved;
  moved << Eigen::Matrix3d::Identity(), Vector3d::UnitZ().cross(p_world);
  return moved;
}

// How a vector of the world turns.
Shifted MovedVector(const Vector3d& v_world) {
  Shifted moved = Shifted::Zero();
  moved.col(3) = Vector3d::UnitZ().cross(v_world);
  return moved;
}

MatrixXd MovedPose(const double* block) {
  const RigidTransform pose = PoseFromBlock(block);
  MatrixXd moved(6, 4);
  moved.topRows<3>() = MovedPoint(pose.translation);
  moved.bottomRows<3>().setZero();
  moved.block<3, 1>(3, 3) = pose.rotation.conjugate() * Vector3d::UnitZ();
  return moved;
}

MatrixXd MovedSpeed(const double* block) {
  MatrixXd moved = MatrixXd::Zero(9, 4);
  moved.topRows<3>() = MovedVector(Vector3d::Map(block));
  return moved;
}

// About a constant anchor; the axes of horizontal lines turn with their heading, those of vertical
// ones stay.
MatrixXd MovedStructural(const StructuralLine& line, double heading_rad, const double* block) {
  const Matrix32d across = AxesAcross(line.axis, heading_rad);
  const Vector3d p_world = CrossingPoint(line, heading_rad, block);
  Shifted moved = MovedPoint(p_world);
  if (line.HasHeading()) moved -= MovedVector(p_world - line.anchor_world);
  const Vector2d ray(std::cos(block[0]), std::sin(block[0])), normal(-ray.y(), ray.x());
  MatrixXd of_block(2, 4);
  of_block.row(0) = block[1] * normal.transpose() * across.transpose() * moved;
  of_block.row(1) = -block[1] * block[1] * ray.transpose() * across.transpose() * moved;
  return of_block;
}

// Counted from axes that turn with the heading; of vertical lines, from those of the world.
MatrixXd MovedShared(const SharedDeviation& shared) {
  MatrixXd moved = MatrixXd::Zero(2, 4);
  if (!shared.heading) moved.col(3) << -shared.off_rad[1], shared.off_rad[0];
  return moved;
}

// By differences: the line is moved, and its block found again.
MatrixXd MovedGeneral(const Vector3d& anchor_world, const double* block) {
  constexpr double kStep = 1e-5;
  const PointAndDirection line = GeneralLineFromBlock(anchor_world, block);
  const Shifted point = MovedPoint(line.point_world), turn = MovedVector(line.direction_world);
  MatrixXd moved(4, 4);
  for (int freedom = 0; freedom < 4; ++freedom) {
    std::array<Eigen::Vector4d, 2> by;
    for (int side = 0; side < 2; ++side) {
      const double step = side == 0 ? -kStep : kStep;
      const GeneralLineBlock at =
          GeneralLineThrough(anchor_world, line.point_world + step * point.col(freedom),
                             line.direction_world + step * turn.col(freedom));
      BlockMinus(kGeneralLineKind, at.data(), block, by[side].data());
    }
    moved.col(freedom) = (by[1] - by[0]) / (2 * kStep);
  }
  return moved;
}

// The unobservable directions of a window's blocks (tangents x 4), at their linearisation points or
// as they are.
class Unobservable {
 public:
  Unobservable(const WindowState& window, bool at_linearization) : first_(at_linearization) {
    for (const auto& frame : window.frames) {
      of_[frame->pose.data()] = MovedPose(At(frame->pose, frame->pose_linearization));
      of_[frame->speed_bias.data()] =
          MovedSpeed(At(frame->speed_bias, frame->speed_bias_linearization));
    }
    for (const HeadingState& heading : window.headings) {
      of_[heading.heading_rad.data()] = Eigen::RowVector4d(0, 0, 0, 1);
    }
    for (const SharedDeviation& shared : window.shared_deviations) {
      of_[shared.off_rad.data()] = MovedShared(shared);
    }
    for (const SlopeState& slope : window.slopes) {
      MatrixXd moved = MatrixXd::Zero(2, 4);
      moved(0, 3) = 1;
      of_[slope.angles_rad.data()] = moved;
    }
    for (const auto& [id, line] : window.lines) {
      const double* block = At(line.block, line.linearization);
      if (!line.IsExact()) {
        of_[line.block.data()] = MovedGeneral(line.anchor_world, block);
        continue;
      }
      const double heading_rad =
          line.heading ? *At(line.heading->heading_rad, line.heading->linearization) : 0;
      of_[line.block.data()] = MovedStructural(line.structural(), heading_rad, block);
    }
  }
  // Of a block with so many freedoms; the rig's calibration moves with nothing.
  MatrixXd Of(const double* block, const BlockKind& kind) const {
    return kind.is_calibration ? MatrixXd::Zero(kind.tangent_size, 4) : of_.at(block);
  }

 private:
  template <typename Block>
  const double* At(const Block& block, const std::optional<Block>& linearization) const {
    return first_ && linearization ? linearization->data() : block.data();
  }
  bool first_;
  std::map<const double*, MatrixXd> of_;
};

// Largest share of the terms' Jacobians that sees position or heading, relative to their size.
double SeenByTerms(const SlidingWindow& window, bool at_linearization) {
  const Unobservable directions(window.state(), at_linearization);
  double worst = 0;
  for (const FixedTerm& term : FixedTerms(window.state(), window.model())) {
    const Factor& factor = *term.factor;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    std::vector<RowMajor> jacobians;
    std::array<double*, Factor::kMaxBlocks> outputs{};
    for (int k = 0; k < factor.blocks(); ++k) {
      jacobians.emplace_back(factor.rows(), factor.tangent_size(k));
    }
    for (int k = 0; k < factor.blocks(); ++k) outputs[k] = jacobians[k].data();
    Eigen::VectorXd r(factor.rows());
    factor.Linearize(term.blocks.data(), r.data(), outputs.data());
    MatrixXd seen = MatrixXd::Zero(factor.rows(), 4);
    double scale = 0;
    for (int k = 0; k < factor.blocks(); ++k) {
      scale = std::max(scale, jacobians[k].norm());
      if (factor.kind(k).is_point) continue;  // relative to its host
      seen += jacobians[k] * directions.Of(term.blocks[k], factor.kind(k));
    }
    worst = std::max(worst, seen.norm() / (1 + scale));
  }
  return worst;
}

// The prior's information on the shifts and the turn of the world.
Eigen::Vector4d KnownByPrior(const WindowState& window) {
  const Unobservable directions(window, true);
  const Prior& prior = window.prior;
  MatrixXd moved(prior.TangentTotal(), 4);
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    moved.middleRows(prior.TangentOffset(static_cast<int>(k)), prior.kinds[k].tangent_size) =
        directions.Of(prior.blocks[k], prior.kinds[k]);
  }
  return (prior.jacobian * moved).colwise().squaredNorm();
}

// The prior of a segment's first frame: 1 mm and 0.1 mrad.
constexpr double kFirstShift = 1e6, kFirstTurn = 1e8;

struct Tested {
  std::string name;
  Method method;
  bool exact;  // lines are exactly along their axes
  double sloped_share;
  double limit;  // of what terms see
};

SimulatedRunOptions NoisyRun(const Tested& tested) {
  SimulatedRunOptions options = NoisyLines(tested.method, 7, 12);
  SetPixelSigma(1, &options);
  if (tested.exact) options.odometry.building_deviation.start_sigma_rad = 0;
  if (!tested.exact) options.lines->deviation_rad = 0.003;
  if (tested.method == Method::kPointsLines) options.lines->general_share = 0.3;
  if (tested.sloped_share > 0) {
    options.lines->sloped_share = tested.sloped_share;
    // Or the slope is found when the run is nearly over.
    options.duration_s = 20;
    SetPixelSigma(0.4, &options);
  }
  return options;
}

class FirstEstimatesTest : public ::testing::TestWithParam<Tested> {
 protected:
  // After each keyframe whose window's prior speaks of lines, where there are some.
  void ForEachPrior(const std::function<void(const SlidingWindow&)>& check) {
    int64_t last_id = -1;
    RunOnSimulatedTracks(NoisyRun(GetParam()), nullptr, [&](Estimator* estimator) {
      const WindowState& window = estimator->window().state();
      if (window.frames.size() < 8 || !window.frames[2]->pose_linearization) return;
      if (window.frames.back()->id == last_id) return;
      last_id = window.frames.back()->id;
      ++checked_;
      for (const auto& [id, line] : window.lines) lines_ += line.linearization.has_value();
      for (const SlopeState& slope : window.slopes) slopes_ += slope.linearization.has_value();
      check(estimator->window());
    });
    EXPECT_GT(checked_, 15);
    EXPECT_GT(lines_, 10 * checked_);
    if (GetParam().sloped_share > 0) {
      EXPECT_GT(slopes_, 4);
    }
  }
  int checked_ = 0, lines_ = 0, slopes_ = 0;
};

TEST_P(FirstEstimatesTest, NeitherThePriorNorATermKnowsPositionOrHeading) {
  double as_they_are = 0;
  ForEachPrior([&](const SlidingWindow& window) {
    const Eigen::Vector4d known = KnownByPrior(window.state());
    EXPECT_LT(known.head<3>().maxCoeff(), kFirstShift * (1 + 1e-4));
    EXPECT_LT(known[3], kFirstTurn * (1 + 1e-4));
    EXPECT_LT(SeenByTerms(window, true), GetParam().limit);
    as_they_are = std::max(as_they_are, SeenByTerms(window, false));
  });
  // What the directions at the current estimates would see: the difference that this is about.
  EXPECT_GT(as_they_are, 1e-5);
}

// A point beside a vertical line sees the turn by its distance from the line, in standard
// deviations: their difference stands in the world's axes. It is nothing beside the 1e8 of the
// first prior, and does not change the cost. So does the direction of a vertical line that is not
// quite upright.
constexpr double kOfVerticals = 1e-2;

INSTANTIATE_TEST_SUITE_P(
    Methods, FirstEstimatesTest,
    ::testing::Values(Tested{"pointslines", Method::kPointsLines, false, 0, 1e-6},
                      Tested{"structural_exact", Method::kStructural, true, 0, 1e-6},
                      Tested{"slc_sloped", Method::kSlc, false, 0.4, kOfVerticals}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace slcmap
