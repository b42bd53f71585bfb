#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "data/file.h"
#include "data/simulator/inexact_building.h"

namespace slcmap {
namespace {

// Root mean squares, each value counted by its weight.
class RootMeanSquare {
 public:
  void Add(double value, double weight) {
    sum_ += weight * value * value;
    weight_ += weight;
  }
  double Value() const { return weight_ > 0 ? std::sqrt(sum_ / weight_) : 0; }

 private:
  double sum_ = 0, weight_ = 0;
};

std::string BodyRows(const Scene& scene) {
  std::string rows =
      "body,kind,is_fitting,wing,foot_x_m,foot_y_m,foot_z_m,yaw_deg,lean_x_deg,lean_y_deg,"
      "own_yaw_deg,own_lean_x_deg,own_lean_y_deg\n";
  for (const BodyDeviation& row : scene.inexact->bodies) {
    const SceneBody& body = scene.bodies[row.body];
    rows += fmt::format(
        "{},{},{:d},{},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", row.body,
        body.kind, body.is_fitting, body.wing, row.foot_world.x(), row.foot_world.y(),
        row.foot_world.z(), row.yaw_deg, row.lean_deg.x(), row.lean_deg.y(), row.own_yaw_deg,
        row.own_lean_deg.x(), row.own_lean_deg.y());
  }
  return rows;
}

std::string EdgeRows(const InexactTruth& truth) {
  std::string rows = "edge,body,axis,wing,length_m,turn_1_deg,turn_2_deg,bend_mm\n";
  for (const EdgeDeviation& edge : truth.edges) {
    rows += fmt::format("{},{},{},{},{:.4f},{:.5f},{:.5f},{:.3f}\n", edge.edge, edge.body,
                        edge.axis, edge.wing, edge.length_m, edge.turn_deg.x(), edge.turn_deg.y(),
                        1e3 * edge.bend_m);
  }
  return rows;
}

std::string Summary(const InexactTruth& truth) {
  RootMeanSquare along[3];
  double bend_m = 0;
  for (const EdgeDeviation& edge : truth.edges) {
    bend_m = std::max(bend_m, edge.bend_m);
    if (edge.axis < 0) continue;
    along[edge.axis].Add(edge.turn_deg.x(), 0.5 * edge.length_m);
    along[edge.axis].Add(edge.turn_deg.y(), 0.5 * edge.length_m);
  }
  return fmt::format(
      "amount: {}\nseed: {}\nmax_displacement_m: {:.5f}\n# of edges from the axes of their wings, "
      "in either direction across: root mean square by length\nedges_along_x_deg: {:.4f}\n"
      "edges_along_y_deg: {:.4f}\nedges_upright_deg: {:.4f}\nmax_bend_m: {:.5f}\n",
      truth.options.amount, truth.options.seed, truth.max_displacement_m, along[0].Value(),
      along[1].Value(), along[2].Value(), bend_m);
}

}  // namespace

void WriteDeviations(const std::string& folder, const Scene& scene) {
  WriteFile(folder + "/inexact.yaml", Summary(*scene.inexact));
  WriteFile(folder + "/deviations.csv", BodyRows(scene));
  WriteFile(folder + "/edge_deviations.csv", EdgeRows(*scene.inexact));
}

}  // namespace slcmap
