// Whether states, slopes and landmarks are as far from the truth as their covariances claim.
// Landmarks are counted from the keyframes that their covariances refer to.
#include "odometry/window/solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <limits>
#include <map>

#include "data/core/math.h"
#include "odometry/window/estimator.h"
#include "odometry/window/marginalization.h"
#include "tests/odometry/window/line_runs.h"

namespace slcmap {
namespace {

using Eigen::MatrixXd;

bool NoneConstant(const double*) { return false; }

// What a speed and bias block is drawn to, with rows so nearly dependent and so large that the
// Hessian is singular by rounding, and the least damping is lost in it too.
class SingularSystem : public ::testing::Test {
 protected:
  SingularSystem() {
    prior_.blocks = {block_.data()};
    prior_.kinds = {kSpeedBiasKind};
    prior_.x_lin = {std::vector<double>(block_.begin(), block_.end())};
    prior_.jacobian.resize(1, kSpeedBiasSize);
    for (int i = 0; i < kSpeedBiasSize; ++i) prior_.jacobian(0, i) = kScale / (3 + 2 * i);
    prior_.residual = Eigen::VectorXd::Ones(1);
  }

  static constexpr double kScale = 1e23;
  SpeedBiasBlock block_{};
  Prior prior_;
  std::vector<Term> terms_;
};

TEST_F(SingularSystem, CannotBeSolvedWithLittleDampingButWithMore) {
  NormalEquations equations(terms_, prior_, NoneConstant);
  equations.Linearize();
  EXPECT_FALSE(equations.SolveDamped(1e4).has_value());
  ASSERT_TRUE(equations.SolveDamped(1).has_value());
  EXPECT_GT(*equations.SolveDamped(1), 0);
}

TEST_F(SingularSystem, IsRetriedWithMoreDamping) {
  const SolverSummary summary = Solve(&terms_, prior_, NoneConstant, {});
  EXPECT_TRUE(summary.usable);
  EXPECT_DOUBLE_EQ(summary.initial_cost, 0.5);
  EXPECT_LT(summary.final_cost, 1e-3);
}

// Its residual is finite where its Jacobian is not.
class WithoutJacobian final : public Factor {
 public:
  WithoutJacobian() : Factor(1, {kSpeedBiasKind}) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    residuals[0] = 1 + parameters[0][0];
    if (!jacobians || !jacobians[0]) return;
    std::fill_n(jacobians[0], kSpeedBiasSize, std::numeric_limits<double>::quiet_NaN());
  }
};

TEST(Solve, IsNotUsableWhereNoDampingHelpsAndLeavesTheBlocksAsTheyWere) {
  SpeedBiasBlock block{1, 2, 3};
  std::vector<Term> terms(1);
  terms[0].factor = std::make_unique<WithoutJacobian>();
  terms[0].blocks[0] = block.data();
  const SolverSummary summary = Solve(&terms, Prior(), NoneConstant, {});
  EXPECT_FALSE(summary.usable);
  EXPECT_EQ(block, (SpeedBiasBlock{1, 2, 3}));
  EXPECT_DOUBLE_EQ(summary.final_cost, summary.initial_cost);
}

// A minimum is found at once, and is one.
TEST(Solve, IsUsableAtAMinimum) {
  SpeedBiasBlock block{};
  Prior prior;
  prior.blocks = {block.data()};
  prior.kinds = {kSpeedBiasKind};
  prior.x_lin = {std::vector<double>(block.begin(), block.end())};
  prior.jacobian = Eigen::MatrixXd::Identity(kSpeedBiasSize, kSpeedBiasSize);
  prior.residual = Eigen::VectorXd::Zero(kSpeedBiasSize);
  std::vector<Term> terms;
  const SolverSummary summary = Solve(&terms, prior, NoneConstant, {});
  EXPECT_TRUE(summary.usable);
  EXPECT_EQ(summary.iterations, 1);
}

// Positive definite; the first `leading` pairs of columns know of the last six alone.
MatrixXd Arrow(int leading, int rest) {
  const int size = 2 * leading + rest;
  MatrixXd rows = MatrixXd::Zero(3 * size, size);
  rows.rightCols(rest).setRandom();
  for (int k = 0; k < leading; ++k) rows.block(6 * k, 2 * k, 6, 2).setRandom();
  return MatrixXd(rows.transpose() * rows) + MatrixXd::Identity(size, size);
}

MatrixXd Lower(const MatrixXd& matrix) { return matrix.triangularView<Eigen::Lower>(); }

TEST(FactorizeBlocks, IsTheCholeskyFactor) {
  const MatrixXd random = MatrixXd::Random(20, 9);
  const std::pair<std::vector<int>, MatrixXd> systems[] = {
      {{2, 2, 2, 2, 2}, Arrow(5, 0)},
      {{2, 2, 2, 2, 2}, Arrow(5, 7)},
      {{4, 2}, random.transpose() * random}};  // whose leading blocks know of each other
  for (const auto& [blocks, matrix] : systems) {
    MatrixXd factor = matrix;
    ASSERT_TRUE(FactorizeBlocks(blocks, &factor));
    EXPECT_LT((Lower(factor) - MatrixXd(matrix.llt().matrixL())).norm(), 1e-12 * matrix.norm());
  }
}

TEST(FactorizeBlocks, RefusesWhatIsNotPositiveDefinite) {
  MatrixXd in_block = Arrow(3, 4), in_rest = in_block;
  in_block(3, 3) = -1;
  EXPECT_FALSE(FactorizeBlocks({2, 2, 2}, &in_block));
  in_rest(8, 8) = -1;
  EXPECT_FALSE(FactorizeBlocks({2, 2, 2}, &in_rest));
}

using Eigen::VectorXd;

// r = A x + B y - c, of any two blocks of three numbers.
class LinearResidual final : public Factor {
 public:
  LinearResidual(const BlockKind& of_x, MatrixXd a, MatrixXd b, VectorXd c)
      : Factor(static_cast<int>(c.size()), {BlockKind{3, 3}, of_x}),
        a_(std::move(a)),
        b_(std::move(b)),
        c_(std::move(c)) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    using Eigen::Vector3d;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
    VectorXd::Map(residuals, rows()) =
        a_ * Vector3d::Map(parameters[1]) + b_ * Vector3d::Map(parameters[0]) - c_;
    if (!jacobians) return;
    if (jacobians[0]) RowMajor::Map(jacobians[0], rows(), 3) = b_;
    if (jacobians[1]) RowMajor::Map(jacobians[1], rows(), 3) = a_;
  }

 private:
  MatrixXd a_, b_;
  VectorXd c_;
};

// Of three columns two that are independent, in units far apart.
MatrixXd DependentColumns(int rows) {
  std::srand(3);
  MatrixXd a = MatrixXd::Random(rows, 3);
  a.col(2) = 1e7 * (a.col(0) - 0.5 * a.col(1));
  a.col(1) *= 1e-6;
  return a;
}

// What is left of y where x is eliminated by any means: |P (B y - c)|^2, P the projection off A.
void ExpectNothingLostOrInvented(const BlockKind& of_x, bool drop) {
  constexpr int kRows = 8;
  std::srand(4);
  const MatrixXd b = MatrixXd::Random(kRows, 3);
  const VectorXd c = VectorXd::Random(kRows);
  for (const MatrixXd& a : {DependentColumns(kRows), MatrixXd(MatrixXd::Zero(kRows, 3)),
                            MatrixXd(MatrixXd::Random(kRows, 3))}) {
    std::array<double, 3> x{}, y{};
    std::vector<Term> terms;
    terms.push_back(
        {std::make_unique<LinearResidual>(of_x, a, b, c), nullptr, {y.data(), x.data()}});
    const Prior prior =
        Marginalize(terms, Prior(), drop ? std::vector<double*>{x.data()} : std::vector<double*>{});
    ASSERT_EQ(prior.blocks, std::vector<double*>{y.data()});

    MatrixXd scaled = a;
    for (int k = 0; k < 3; ++k) scaled.col(k) /= std::max(a.col(k).norm(), 1e-300);
    const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeThinU);
    const Eigen::Index rank = (svd.singularValues().array() > 1e-9).count();
    const MatrixXd u = svd.matrixU().leftCols(rank);
    const MatrixXd off = MatrixXd::Identity(kRows, kRows) - u * u.transpose();
    const MatrixXd information = b.transpose() * off * b;
    EXPECT_LT((prior.jacobian.transpose() * prior.jacobian - information).norm(), 1e-9) << rank;
    EXPECT_LT((prior.jacobian.transpose() * prior.residual + b.transpose() * off * c).norm(), 1e-9)
        << rank;
  }
}

// In two steps, between which the estimate has moved on from where the prior was linearised.
TEST(Marginalize, OfAPriorAndTermsIsTheSchurComplementOfAllThatWasSaid) {
  constexpr int kRows = 8;
  std::srand(6);
  std::array<double, 3> x{}, z{}, y{};
  Prior prior;
  MatrixXd information = MatrixXd::Zero(3, 3);
  VectorXd of_zero = VectorXd::Zero(3);  // the gradient at y = 0
  for (std::array<double, 3>* dropped : {&x, &z}) {
    const MatrixXd a = MatrixXd::Random(kRows, 3), b = MatrixXd::Random(kRows, 3);
    const VectorXd c = VectorXd::Random(kRows);
    const MatrixXd gain = a.colPivHouseholderQr().solve(MatrixXd::Identity(kRows, kRows));
    const MatrixXd off = MatrixXd::Identity(kRows, kRows) - a * gain;
    information += b.transpose() * off * b;
    of_zero -= b.transpose() * off * c;
    std::vector<Term> terms;
    terms.push_back({std::make_unique<LinearResidual>(BlockKind{3, 3}, a, b, c),
                     nullptr,
                     {y.data(), dropped->data()}});
    prior = Marginalize(terms, prior, {dropped->data()});
    y = {0.3, -0.2, 0.1};
  }
  ASSERT_EQ(prior.blocks, std::vector<double*>{y.data()});
  const VectorXd residual = prior.residual + prior.jacobian * prior.Difference(prior.blocks.data());
  const VectorXd gradient = of_zero + information * Eigen::Vector3d::Map(y.data());
  EXPECT_LT((prior.jacobian.transpose() * prior.jacobian - information).norm(), 1e-9);
  EXPECT_LT((prior.jacobian.transpose() * residual - gradient).norm(), 1e-9);
}

TEST(MarginalizeRankDeficient, StatesAndPointsTakeOnlyWhatSpeaksOfThem) {
  ExpectNothingLostOrInvented(BlockKind{3, 3}, true);
  ExpectNothingLostOrInvented(kPointKind, false);
}

// States of as many numbers as a point: only points are eliminated.
TEST(LinearResidual, StatesOfThreeNumbersAreSolvedAsStates) {
  std::srand(5);
  const Eigen::Vector3d true_x(1, 2, 3), true_y(10, 20, 30);
  const MatrixXd a = MatrixXd::Random(8, 3), b = MatrixXd::Random(8, 3);
  std::array<double, 3> x{}, y{};
  std::vector<Term> terms;
  terms.push_back(
      {std::make_unique<LinearResidual>(BlockKind{3, 3}, a, b, VectorXd(a * true_x + b * true_y)),
       nullptr,
       {y.data(), x.data()}});
  const SolverSummary summary = Solve(&terms, Prior(), [](const double*) { return false; },
                                      {.max_iterations = 50, .function_tolerance = 1e-15});
  ASSERT_TRUE(summary.usable);
  EXPECT_LT((Eigen::Vector3d::Map(x.data()) - true_x).norm(), 1e-4);
  EXPECT_LT((Eigen::Vector3d::Map(y.data()) - true_y).norm(), 1e-4);
}

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A mean of normalised squared errors, each over its freedoms: 1 where the claims are honest.
struct Nees {
  double sum = 0;
  int count = 0;
  void Add(double chi2, int freedoms) {
    // A landmark that is wrong as a whole is no matter of its covariance.
    sum += std::min(chi2 / freedoms, 25.0);
    ++count;
  }
  double Mean() const { return sum / count; }
};

// What the simulation of one run says of its landmarks' claims.
class Judge {
 public:
  // Notes the hosts of the landmarks that are in the window.
  void Look(const WindowState& window) {
    for (const auto& [id, landmark] : window.landmarks) {
      if (landmark.triangulated) host_[id] = landmark.host()->id;
    }
  }

  // Along the ray of the host.
  void JudgePoints(const SimulatedRun& run, Nees* nees) const {
    for (const Landmark& landmark : run.run.landmarks) {
      const RigidTransform estimate = Estimate(run, host_.at(landmark.id));
      const RigidTransform off = estimate * Truth(run, host_.at(landmark.id)).Inverse();
      const Vector3d camera = (estimate * run.rig.T_imu_camera[0]).translation;
      const Vector3d ray = (landmark.p_world - camera).normalized();
      const Vector3d truth = off * run.landmarks_world[static_cast<size_t>(landmark.id)];
      nees->Add(std::pow(ray.dot(landmark.p_world - truth) / landmark.sigma_m, 2), 1);
    }
  }

  // Across the line at its middle, counted from the last keyframe that saw it.
  void JudgeLines(const SimulatedRun& run, Nees* nees) const {
    for (const Line& line : run.run.lines) {
      const RigidTransform off =
          Estimate(run, line.last_keyframe) * Truth(run, line.last_keyframe).Inverse();
      const SimulatedEdge& edge = run.edges[static_cast<size_t>(line.id)];
      const Vector3d start = off * edge.start_world, end = off * edge.end_world;
      const Vector3d normal = (line.end_world - line.start_world).normalized();
      const Vector3d middle = 0.5 * (line.start_world + line.end_world);
      const double along = normal.dot(middle - start) / normal.dot(end - start);
      const Vector3d error = start + along * (end - start) - middle;
      const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(line.covariance_m2);
      EXPECT_LT(eigen.eigenvalues()[0], 1e-6 * eigen.eigenvalues()[2]);
      const Vector2d off_axes = eigen.eigenvectors().rightCols<2>().transpose() * error;
      nees->Add(off_axes.cwiseAbs2().dot(eigen.eigenvalues().tail<2>().cwiseInverse()), 2);
    }
  }

 private:
  static const Keyframe& Find(const SimulatedRun& run, int64_t id) {
    return *std::find_if(run.run.keyframes.begin(), run.run.keyframes.end(),
                         [&](const Keyframe& keyframe) { return keyframe.id == id; });
  }
  static RigidTransform Estimate(const SimulatedRun& run, int64_t id) {
    return Find(run, id).T_world_imu;
  }
  static RigidTransform Truth(const SimulatedRun& run, int64_t id) {
    return run.motion->PoseAt(ToSeconds(Find(run, id).stamp_ns));
  }
  std::map<int64_t, int64_t> host_;
};

struct Claims {
  const char* name;
  Method method;
  double deviation_rad, sloped_share;
};

SimulatedRunOptions NoisyBuilding(const Claims& claims, uint64_t seed) {
  SimulatedRunOptions options = NoisyLines(claims.method, seed);
  options.lines->deviation_rad = claims.deviation_rad;
  if (claims.method == Method::kPointsLines) options.lines->general_share = 0.3;
  if (claims.sloped_share > 0) AddStairs(claims.sloped_share, &options);
  if (claims.deviation_rad > 0) options.lines->max_lines = 40;
  return options;
}

class CovarianceTest : public ::testing::TestWithParam<Claims> {};

TEST_P(CovarianceTest, IsWhatTheErrorsAre) {
  Nees pose, all, slope, points, lines;
  for (const uint64_t seed : {21, 22, 23, 24, 25, 26}) {
    Judge judge;
    const SimulatedRun run = RunOnSimulatedTracks(
        NoisyBuilding(GetParam(), seed), nullptr,
        [&](Estimator* estimator) { judge.Look(estimator->window().state()); });
    pose.Add(run.final_pose_nees, 6);
    all.Add(run.final_nees, 15);
    if (GetParam().sloped_share > 0) {
      EXPECT_GT(run.final_slope_nees, 0) << "it is known";
      slope.Add(run.final_slope_nees, 2);
    }
    judge.JudgePoints(run, &points);
    judge.JudgeLines(run, &lines);
  }
  // The means of six are known to 0.24 and 0.15.
  EXPECT_GT(pose.Mean(), 0.5);
  EXPECT_LT(pose.Mean(), 1.67);
  EXPECT_GT(all.Mean(), 0.6);
  EXPECT_LT(all.Mean(), 1.47);
  ASSERT_GT(points.count, 500);
  EXPECT_GT(points.Mean(), 0.75);
  EXPECT_LT(points.Mean(), 1.3);
  if (GetParam().sloped_share > 0) {
    EXPECT_LT(slope.Mean(), 2.75);
  }
  if (!UsesLines(GetParam().method)) return;
  ASSERT_GT(lines.count, 100);
  EXPECT_GT(lines.Mean(), 0.6);
  EXPECT_LT(lines.Mean(), 1.5);
}

INSTANTIATE_TEST_SUITE_P(Methods, CovarianceTest,
                         ::testing::Values(Claims{"points", Method::kPoints, 0, 0},
                                           Claims{"pointslines", Method::kPointsLines, 0, 0},
                                           Claims{"structural", Method::kStructural, 0, 0},
                                           Claims{"slc_off", Method::kSlc, 0.3 * kDegree, 0},
                                           Claims{"slc_crooked", Method::kSlc, 1 * kDegree, 0},
                                           Claims{"slc_sloped", Method::kSlc, 0.1 * kDegree, 0.3}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace slcmap
