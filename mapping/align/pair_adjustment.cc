#include "mapping/align/pair_adjustment.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <map>
#include <utility>

namespace slcmap::inline mapping {

using Eigen::Vector3d;

Eigen::Vector4d ComputeOff(const AlignedPair& pair, const std::vector<PlacedMap>& placed) {
  const RigidTransform& T_pair = pair.found->T_first_second;
  const RigidTransform T =
      placed[pair.first].T_group_map.Inverse() * placed[pair.second].T_group_map;
  const Vector3d& centre = pair.found->information.centre_first;
  Eigen::Vector4d off;
  off << ComputeYaw(T_pair.Inverse() * T), T * (T_pair.Inverse() * centre) - centre;
  return off;
}

namespace {

class PairAdjustment {
 public:
  PairAdjustment(const std::vector<const AlignedPair*>& pairs, const std::vector<std::size_t>& maps)
      : pairs_(pairs) {
    for (std::size_t i = 0; i < maps.size(); ++i) column_[maps[i]] = static_cast<int>(4 * i) - 4;
  }

  // The first map stays.
  void Solve(std::vector<PlacedMap>* placed) const {
    constexpr int kSteps = 5;
    for (int step = 0; step < kSteps; ++step) Move(placed);
  }

 private:
  using Jacobian = Eigen::Matrix4d;  // of turn and translation of a map

  void Move(std::vector<PlacedMap>* placed) const {
    const auto size = static_cast<Eigen::Index>(4 * (column_.size() - 1));
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    for (const AlignedPair* pair : pairs_) Add(*pair, *placed, &normal, &gradient);
    const Eigen::VectorXd step = normal.ldlt().solve(-gradient);
    if (!step.allFinite()) return;
    for (const auto& [map, column] : column_) {
      if (column < 0) continue;
      RigidTransform& T = (*placed)[map].T_group_map;
      T = LevelTransform(ComputeYaw(T) + step(column), T.translation + step.segment<3>(column + 1));
    }
  }

  void Add(const AlignedPair& pair, const std::vector<PlacedMap>& placed, Eigen::MatrixXd* normal,
           Eigen::VectorXd* gradient) const {
    const Eigen::Vector4d residual = ComputeOff(pair, placed);
    const Eigen::Matrix4d weight = Weight(*pair.found);
    const Eigen::Matrix3d R_first =
        placed[pair.first].T_group_map.rotation.toRotationMatrix().transpose();
    const RigidTransform& T_second = placed[pair.second].T_group_map;
    const Vector3d centre = pair.found->information.centre_first;
    const Vector3d p = pair.found->T_first_second.Inverse() * centre;
    Jacobian by_first = Jacobian::Zero(), by_second = Jacobian::Zero();
    by_first(0, 0) = -1, by_second(0, 0) = 1;
    by_first.block<3, 1>(1, 0) = -Vector3d::UnitZ().cross(centre + residual.tail<3>());
    by_first.block<3, 3>(1, 1) = -R_first;
    by_second.block<3, 1>(1, 0) = R_first * Vector3d::UnitZ().cross(T_second.rotation * p);
    by_second.block<3, 3>(1, 1) = R_first;
    const std::pair<int, const Jacobian*> parts[] = {{column_.at(pair.first), &by_first},
                                                     {column_.at(pair.second), &by_second}};
    for (const auto& [row, by_row] : parts) {
      if (row < 0) continue;
      gradient->segment<4>(row) += by_row->transpose() * weight * residual;
      for (const auto& [column, by_column] : parts) {
        if (column < 0) continue;
        normal->block<4, 4>(row, column) += by_row->transpose() * weight * *by_column;
      }
    }
  }

  // Maps bend besides what an alignment knows of itself.
  static Eigen::Matrix4d Weight(const MapAlignment& found) {
    Eigen::Matrix4d covariance = found.information.of_turn_and_shift.inverse();
    if (!covariance.allFinite()) covariance.setZero();
    const double shift_m2 = kMapSigma_m * kMapSigma_m;
    covariance.diagonal() +=
        Eigen::Vector4d(kMapSigma_rad * kMapSigma_rad, shift_m2, shift_m2, shift_m2);
    return covariance.inverse();
  }

  const std::vector<const AlignedPair*>& pairs_;
  std::map<std::size_t, int> column_;  // of a map's turn; the first has none
};

}  // namespace

void AdjustPairs(const std::vector<const AlignedPair*>& pairs, const std::vector<std::size_t>& maps,
                 std::vector<PlacedMap>* placed) {
  PairAdjustment(pairs, maps).Solve(placed);
}

AlignedPair AlignTwo(const ComparedMap& first, const ComparedMap& second,
                     const std::optional<RigidTransform>& T_on_earth, const Progress& progress) {
  AlignmentOptions options;
  if (T_on_earth) options.start = {T_on_earth->translation, ComputeYaw(*T_on_earth)};
  AlignedPair pair;
  try {
    pair.found = AlignMaps(first, second, options, progress);
  } catch (const AlignmentError& error) {
    pair.reason = error.what();
    if (T_on_earth) pair.reason += "; looked for it near where their control points place them";
    pair.places = error.places();
  }
  return pair;
}

}  // namespace slcmap::mapping
