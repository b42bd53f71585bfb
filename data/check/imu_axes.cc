#include "data/check/imu_axes.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>

#include "data/rigid_transform.h"

namespace slcmap {
namespace {

constexpr char kLetters[] = "xyz";

// What is read as each axis: "y, -x, z" is the reading of a sensor turned about z.
std::string ReadingsInWords(const Eigen::Matrix3d& matrix) {
  std::string words;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (matrix(row, column) == 0) continue;
      words += fmt::format("{}{}{}", words.empty() ? "" : ", ", matrix(row, column) < 0 ? "-" : "",
                           kLetters[column]);
    }
  }
  return words;
}

std::string InWords(const Eigen::Matrix3d& matrix) {
  const Eigen::Vector3d diagonal = matrix.diagonal();
  const int moved = static_cast<int>((diagonal.array() == 0).count());
  if (moved == 0) {
    std::string words;
    for (int axis = 0; axis < 3; ++axis) {
      if (diagonal[axis] < 0) {
        words += fmt::format("{}{}", words.empty() ? "" : " and ", kLetters[axis]);
      }
    }
    if (words.empty()) return "";
    return (diagonal.sum() == -3 ? std::string("all axes") : words) + " negated";
  }
  if (moved == 2 && matrix.minCoeff() == 0) {  // two change places, all with their sign
    Eigen::Index stays = 0;
    diagonal.maxCoeff(&stays);
    return fmt::format("{} and {} swapped", kLetters[stays == 0 ? 1 : 0],
                       kLetters[stays == 2 ? 1 : 2]);
  }
  return "x, y, z read as " + ReadingsInWords(matrix);
}

// Plain ones come first.
int Complexity(const Eigen::Matrix3d& matrix) {
  const int negated = static_cast<int>((matrix.array() < 0).count());
  const int moved = static_cast<int>((matrix.diagonal().array() == 0).count());
  return (negated == 3 && moved == 0 ? 1 : negated) + 4 * moved;
}

std::vector<AxisChange> MakeAxisChanges() {
  std::vector<AxisChange> changes;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) matrix(row, order[row]) = (signs >> row & 1) != 0 ? -1 : 1;
      changes.push_back({matrix, InWords(matrix)});
    }
  } while (std::next_permutation(order.begin(), order.end()));
  std::stable_sort(changes.begin(), changes.end(), [](const AxisChange& a, const AxisChange& b) {
    return Complexity(a.matrix) < Complexity(b.matrix);
  });
  return changes;
}

}  // namespace

const std::vector<AxisChange>& AxisChanges() {
  static const std::vector<AxisChange> changes = MakeAxisChanges();
  return changes;
}

}  // namespace slcmap
