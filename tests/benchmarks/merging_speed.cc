// CPU time of merging lines, which one thread does, by their number: edges of a building whose
// floor grows with them, each seen several times.
//
//   merging_speed [--lines N] [--copies N]
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <random>

#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_merging.h"

namespace slcmap {
namespace {

constexpr double kSigma_m = 0.003, kStorey_m = 3;
constexpr double kFloorPerEdge_m2 = 0.5;  // as of an office: some 30 in a room of 15 m2

// Edges on a grid of 5 cm, so that no two are one, and how often each was found.
class Building {
 public:
  Building(int edges, int copies, uint64_t seed)
      : random_(seed), side_m_(std::sqrt(kFloorPerEdge_m2 * edges)) {
    for (int edge = 0; edge < edges; ++edge) AddEdge(copies);
  }

  std::vector<TrackedLine> lines;

 private:
  double Grid(double extent_m) {
    constexpr double kGrid_m = 0.05;
    std::uniform_int_distribution<int64_t> cell(0, static_cast<int64_t>(extent_m / kGrid_m));
    return kGrid_m * static_cast<double>(cell(random_));
  }

  void AddEdge(int copies) {
    std::uniform_real_distribution<double> length_m(0.3, 3);
    std::uniform_int_distribution<int> axis(0, 2);
    std::normal_distribution<double> off_m(0, kSigma_m);
    TrackedLine edge;
    edge.axis = axis(random_);
    edge.line.point_world = {Grid(side_m_), Grid(side_m_), Grid(kStorey_m)};
    edge.line.direction_world = Eigen::Vector3d::Unit(edge.axis);
    edge.intervals = {{0, length_m(random_)}};
    edge.fit.across = ComputeAcross(edge.line.direction_world);
    edge.fit.covariance =
        Eigen::Vector4d(kSigma_m * kSigma_m, kSigma_m * kSigma_m, 1e-8, 1e-8).asDiagonal();
    edge.fit.views = 5;
    for (int copy = 0; copy < copies; ++copy) {
      TrackedLine& line = lines.emplace_back(edge);
      for (int across = 1; across < 3; ++across) {
        line.line.point_world[(edge.axis + across) % 3] += off_m(random_);
      }
    }
  }

  std::mt19937_64 random_;
  double side_m_;
};

void Measure(int lines, int copies) {
  std::vector<TrackedLine> all = Building(lines / copies, copies, 1).lines;
  const double n = static_cast<double>(all.size());
  const std::clock_t begin = std::clock();
  const size_t merged = MergeLines(std::move(all)).size();
  const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("%9.0f lines of %7d edges: %7.3f s, %6.1f ns per n log2 n, merged to %zu\n", n,
              lines / copies, cpu_s, 1e9 * cpu_s / (n * std::log2(n)), merged);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  int lines = 1'000'000, copies = 5;
  CLI::App app("Time of merging lines");
  app.add_option("--lines", lines, "at most")->check(CLI::Range(1000, 100'000'000));
  app.add_option("--copies", copies, "of each edge")->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);
  for (int n = lines; n >= 10'000; n /= 4) slcmap::Measure(n, copies);
  return 0;
}
