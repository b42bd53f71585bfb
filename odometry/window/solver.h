// Minimises terms and a prior over the parameter blocks they bind, by normal equations with the
// points eliminated.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "odometry/window/marginalization.h"
#include "odometry/window/problem.h"

namespace slcmap::inline odometry {

// Turns the lower triangle of a symmetric positive definite matrix into its Cholesky factor L. Of
// the leading blocks, of the sizes given, only those rows are worked on that are not zero: lines
// that meet few poses and no other line cost next to nothing. Zeros may be anywhere; they decide on
// the cost alone. The upper triangle is not looked at. False where the matrix is not positive
// definite.
bool FactorizeBlocks(const std::vector<int>& leading_sizes, Eigen::MatrixXd* matrix);

// The normal equations of a window's cost, with the points eliminated.

class NormalEquations {
 public:
  // All must outlive this.
  NormalEquations(const std::vector<Term>& terms, const Prior& prior,
                  const std::function<bool(const double*)>& is_constant);

  // Half the robustified sum of squares at the blocks' current values.
  double Cost() const;

  // Builds the equations at the blocks' current values. Robust losses enter as weights.
  void Linearize();

  // Solves with a damping of diag(H) / radius. Returns the decrease of the cost that the linear
  // model predicts, zero at a minimum; nothing where the system cannot be solved. There is then no
  // solution to apply.
  std::optional<double> SolveDamped(double radius);

  // What the equations that were built last know of the states, without damping, the points
  // eliminated. Empty before Linearize().
  StateInformation Information();

  // Moves the blocks by the last solution; Undo() takes that back.
  void Apply();
  void Undo();

 private:
  struct Unknown {
    double* block = nullptr;
    BlockKind kind;
    int tangent = 0;
    int offset = 0;  // in the reduced system, lines first that the prior does not bind; of a point:
                     // index into points_
    bool is_point = false;
  };
  // One term's blocks: indices into unknowns_, -1 where constant.
  struct Binding {
    std::array<int, Factor::kMaxBlocks> unknown{};
  };
  // What the terms of one point say of it and of the states (rows: x, y, lambda).
  struct PointSystem {
    int unknown = 0;
    Eigen::Matrix3d hessian, inverse;
    Eigen::Vector3d gradient, step;
    std::vector<std::pair<int, int>> states;  // unknown, first column in `cross`
    Eigen::Matrix3Xd cross;
  };

  void Meet(double* block, const BlockKind& kind,
            const std::function<bool(const double*)>& is_constant);
  // Lines first that are not among the so many unknowns that the prior binds.
  void PlaceUnknowns(size_t bound);
  void AddPriorHessian();
  void AddTerm(const Term& term, const Binding& binding);
  int CrossColumn(PointSystem* point, int unknown) const;
  void Eliminate(PointSystem* point, double radius, Eigen::MatrixXd* hessian,
                 Eigen::VectorXd* gradient);
  Eigen::VectorXd PriorDifference() const;
  std::optional<double> PredictedDecrease(double radius) const;

  const std::vector<Term>& terms_;
  const Prior& prior_;
  std::vector<Binding> bindings_;
  std::unordered_map<const double*, int> index_;  // only looked up
  std::vector<Unknown> unknowns_;                 // in the order in which they were met
  std::vector<PointSystem> points_;
  std::vector<int> prior_unknowns_;  // of the prior's blocks, and where their columns start
  std::vector<int> prior_columns_;
  Eigen::MatrixXd prior_hessian_, hessian_;  // lower triangles
  Eigen::VectorXd gradient_, step_;
  std::vector<double> before_;      // the blocks before Apply()
  int total_ = 0;                   // size of the reduced system
  std::vector<int> leading_sizes_;  // of its first blocks, the lines that the prior does not bind
};

struct SolverOptions {
  int max_iterations = 6;
  double function_tolerance = 1e-4;  // relative change of the cost at which it stops
};

struct SolverSummary {
  // False where the cost is not finite, or a linear system could not be solved however much it was
  // damped. The blocks are then where the last step that lowered the cost has left them.
  bool usable = false;
  int iterations = 0;  // steps that were tried
  double initial_cost = 0, final_cost = 0;
};

// Moves every block that is not constant, by Levenberg-Marquardt on the normal equations (trust
// region and stopping as in Ceres). Points are eliminated first, by their Schur complement.
//
// The terms are Ceres' cost functions, losses and manifolds, but not its solver: the prior is one
// dense term over all states and lines of the window, whose normal matrix is constant here and
// would be built anew, block by block, in each of Ceres' iterations. One thread, and no limit on
// time: the result depends on the input alone.
//
// `information` becomes what the last system says of the states, where it is wanted and there was
// one.
SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options, StateInformation* information = nullptr);

}  // namespace slcmap::odometry
