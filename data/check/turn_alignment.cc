#include "data/check/turn_alignment.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "data/check/step_lags.h"
#include "data/core/rigid_transform.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
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

namespace {

constexpr double kOffsetStep_s = 0.005;
constexpr size_t kMinTurns = 30;
constexpr double kTurnFloor_rad = 2e-4;  // of a turn's deviation, for what its residuals hide
constexpr double kMinRate_rad_s = 0.02;  // RMS about the mean, to tell anything
constexpr double kMaxShownNoise = 0.5;   // of the turn rate's variance
constexpr int kWeightRounds = 4, kAlignmentIterations = 8;
constexpr double kTurnLoss = 12;  // squared residual at which a turn counts half
constexpr double kBiasSigma_rad_s = 0.2;
constexpr double kUsualScaleError = 0.05;
// Clocks that are far apart.
constexpr double kFarOffset_s = 6, kFarStep_s = 0.01, kMinOverlap_s = 2;
constexpr double kFarExplained = 0.1;  // the share of the turns that may be left
constexpr double kFarElse = 0.05;      // what any other offset leaves at least, and
constexpr double kFarLead = 3;         // times what the best one leaves
constexpr double kFarApart_s = 0.4;    // from which on an offset is another one

// Turn rates of camera and gyroscope over the same steps, at one time offset.
struct Rates {
  std::vector<Eigen::Vector3d> camera, gyro;
  std::vector<double> weights;
};

// Second moments about the means.
struct Moments {
  Eigen::Matrix3d gyro_gyro = Eigen::Matrix3d::Zero(), gyro_camera = Eigen::Matrix3d::Zero();
  double camera = 0;  // variance
};

Moments ComputeMoments(const Rates& rates) {
  Eigen::Vector3d mean_camera = Eigen::Vector3d::Zero(), mean_gyro = Eigen::Vector3d::Zero();
  double total = 0;
  for (size_t i = 0; i < rates.weights.size(); ++i) {
    mean_camera += rates.weights[i] * rates.camera[i];
    mean_gyro += rates.weights[i] * rates.gyro[i];
    total += rates.weights[i];
  }
  mean_camera /= total;
  mean_gyro /= total;
  Moments moments;
  for (size_t i = 0; i < rates.weights.size(); ++i) {
    const Eigen::Vector3d camera = rates.camera[i] - mean_camera, gyro = rates.gyro[i] - mean_gyro;
    const double weight = rates.weights[i] / total;
    moments.gyro_gyro += weight * gyro * gyro.transpose();
    moments.gyro_camera += weight * gyro * camera.transpose();
    moments.camera += weight * camera.squaredNorm();
  }
  return moments;
}

// The linear map from gyroscope to camera that leaves least.
Eigen::Matrix3d BestMap(const Moments& moments) {
  Eigen::Matrix3d damped = moments.gyro_gyro;
  damped.diagonal().array() += 1e-6 * damped.trace() + 1e-15;
  return damped.ldlt().solve(moments.gyro_camera).transpose();
}

// Share of the camera's variance that `map` leaves.
double Unexplained(const Moments& moments, const Eigen::Matrix3d& map) {
  const double left = moments.camera - 2 * (map * moments.gyro_camera).trace() +
                      (map * moments.gyro_gyro * map.transpose()).trace();
  return std::max(0.0, left) / std::max(moments.camera, 1e-12);
}

double BestScale(const Moments& moments, const Eigen::Matrix3d& map) {
  const double size = (map * moments.gyro_gyro * map.transpose()).trace();
  return size <= 0 ? 1 : (map * moments.gyro_camera).trace() / size;
}

using Vector10d = Eigen::Matrix<double, 10, 1>;
using Matrix10d = Eigen::Matrix<double, 10, 10>;

// What is refined: turn of the camera = scales * map * turn of the gyroscope + bias * time.
struct Refined {
  double offset_s = 0;
  Eigen::Matrix3d map = Eigen::Matrix3d::Identity();  // to the camera
  Eigen::Vector3d bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d scales = Eigen::Vector3d::Ones();  // of the camera's axes

  // By a step over offset, rotation on the camera's side, bias and scales.
  void Move(const Vector10d& step) {
    offset_s += std::clamp(step[0], -0.02, 0.02);
    map = ExpRotation(step.segment<3>(1)).toRotationMatrix() * map;
    bias_rad_s += step.segment<3>(4);
    scales += step.tail<3>();
  }
};

struct Normals {
  Matrix10d H = Matrix10d::Zero();
  Vector10d g = Vector10d::Zero();
  double squares = 0, count = 0;                             // of whitened residuals, and turns
  Eigen::Vector3d turned_squares = Eigen::Vector3d::Zero();  // about the camera's axes

  // Of the step, by what the residuals scatter.
  Matrix10d Covariance() const {
    return H.inverse() * std::max(1.0, squares / std::max(3 * count - 10, 1.0));
  }
};

class Aligner {
 public:
  Aligner(const std::vector<ImageTurn>& turns, const std::vector<ImuSample>& imu,
          const Eigen::Quaterniond& R_imu_camera, double time_offset_s)
      : gyro_(imu), R_imu_camera_(R_imu_camera), claimed_s_(time_offset_s) {
    const int64_t furthest_ns = ToNanoseconds(kMaxAlignedOffset_s);
    const int64_t claimed_ns = ToNanoseconds(time_offset_s);
    for (const ImageTurn& turn : turns) {
      if (!gyro_.Covers(turn.from_ns + claimed_ns - furthest_ns,
                        turn.to_ns + claimed_ns + furthest_ns)) {
        continue;
      }
      turns_.push_back(turn);
      Eigen::Matrix3d covariance = turn.covariance;
      covariance.diagonal().array() += kTurnFloor_rad * kTurnFloor_rad;
      const double step_s = ToSeconds(turn.to_ns - turn.from_ns);
      covariances_.push_back(covariance);
      weights_.push_back(step_s * step_s / covariance.trace());
    }
  }

  TurnAlignment Align() {
    TurnAlignment alignment;
    if (turns_.size() < kMinTurns) return alignment;
    WeighDown();
    Compare(&alignment);
    const double noise = NoiseVariance();
    alignment.enough_motion =
        alignment.turn_rate_rad_s > kMinRate_rad_s &&
        noise < kMaxShownNoise * alignment.turn_rate_rad_s * alignment.turn_rate_rad_s;
    if (alignment.enough_motion) Refine(&alignment);
    return alignment;
  }

 private:
  Rates RatesAt(double time_offset_s) const {
    Rates rates;
    const int64_t offset_ns = ToNanoseconds(time_offset_s);
    for (const ImageTurn& turn : turns_) {
      const double step_s = ToSeconds(turn.to_ns - turn.from_ns);
      rates.camera.push_back(turn.turn_rad / step_s);
      rates.gyro.push_back(gyro_.Between(turn.from_ns + offset_ns, turn.to_ns + offset_ns) /
                           step_s);
    }
    rates.weights = weights_;
    return rates;
  }

  template <typename Visit>
  void ForEachOffset(Visit visit) const {
    const int steps = static_cast<int>(std::lround(kMaxAlignedOffset_s / kOffsetStep_s));
    for (int step = -steps; step <= steps; ++step) {
      const double offset_s = claimed_s_ + step * kOffsetStep_s;
      visit(offset_s, RatesAt(offset_s));
    }
  }

  double BestOffsetOfAnyMap() const {
    double best_s = claimed_s_, least = 2;
    ForEachOffset([&](double offset_s, const Rates& rates) {
      const Moments moments = ComputeMoments(rates);
      const double unexplained = Unexplained(moments, BestMap(moments));
      if (unexplained >= least) return;
      least = unexplained;
      best_s = offset_s;
    });
    return best_s;
  }

  // Turns that no linear map explains count less: features followed wrongly.
  void WeighDown() {
    const std::vector<double> weights = weights_;
    for (int round = 0; round < kWeightRounds; ++round) {
      const Rates rates = RatesAt(BestOffsetOfAnyMap());
      const Eigen::Matrix3d map = BestMap(ComputeMoments(rates));
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      double total = 0;
      for (size_t i = 0; i < weights_.size(); ++i) {
        mean += weights_[i] * (rates.camera[i] - map * rates.gyro[i]);
        total += weights_[i];
      }
      mean /= total;
      std::vector<double> residuals;
      for (size_t i = 0; i < weights_.size(); ++i) {
        residuals.push_back((rates.camera[i] - map * rates.gyro[i] - mean).norm() *
                            std::sqrt(weights[i]));
      }
      const double scale = 2 * Median(residuals) + 1e-12;
      for (size_t i = 0; i < weights_.size(); ++i) {
        weights_[i] = weights[i] / (1 + std::pow(residuals[i] / scale, 2));
      }
    }
  }

  // What the images' own noise adds to the variance of their turn rate.
  double NoiseVariance() const {
    double sum = 0, total = 0;
    for (size_t i = 0; i < turns_.size(); ++i) {
      const double step_s = ToSeconds(turns_[i].to_ns - turns_[i].from_ns);
      sum += weights_[i] * covariances_[i].trace() / (step_s * step_s);
      total += weights_[i];
    }
    return sum / total;
  }

  std::vector<AxisChange> Candidates() const {
    std::vector<AxisChange> changes = AxisChanges();
    const Eigen::Matrix3d R = R_imu_camera_.toRotationMatrix();
    changes.insert(changes.begin() + 1, {R * R, "inverted"});
    return changes;
  }

  void Compare(TurnAlignment* alignment) const {
    const Eigen::Matrix3d R_camera_imu = R_imu_camera_.conjugate().toRotationMatrix();
    const std::vector<AxisChange> changes = Candidates();
    alignment->claimed.unexplained = alignment->best.unexplained = 1e9;
    ForEachOffset([&](double offset_s, const Rates& rates) {
      const Moments moments = ComputeMoments(rates);
      alignment->turn_rate_rad_s = std::sqrt(moments.camera);
      alignment->unexplained =
          std::min(alignment->unexplained, Unexplained(moments, BestMap(moments)));
      for (const AxisChange& change : changes) {
        const Eigen::Matrix3d map = R_camera_imu * change.matrix;
        Improve({change, 1, offset_s, Unexplained(moments, map)}, alignment);
        const double scale = BestScale(moments, map);
        if (scale <= 0) continue;
        const TurnFit scaled = {change, scale, offset_s, Unexplained(moments, scale * map)};
        if (scaled.unexplained < alignment->best.unexplained) alignment->best = scaled;
      }
    });
  }

  static void Improve(const TurnFit& fit, TurnAlignment* alignment) {
    if (fit.change.IsNone() && fit.unexplained < alignment->claimed.unexplained) {
      alignment->claimed = fit;
    }
    if (fit.unexplained < alignment->best.unexplained) alignment->best = fit;
  }

  // What a turn of the images says of the state, where the gyroscope covers it.
  void AddTurn(size_t i, const Refined& state, Normals* normals) const {
    const ImageTurn& turn = turns_[i];
    const int64_t offset_ns = ToNanoseconds(state.offset_s);
    const int64_t from_ns = turn.from_ns + offset_ns, to_ns = turn.to_ns + offset_ns;
    if (!gyro_.Covers(from_ns, to_ns)) return;
    const double step_s = ToSeconds(turn.to_ns - turn.from_ns);
    const Eigen::Vector3d turned = state.map * gyro_.Between(from_ns, to_ns);
    const Eigen::Vector3d e =
        turn.turn_rad - state.scales.cwiseProduct(turned) - state.bias_rad_s * step_s;
    Eigen::Matrix<double, 3, 10> J;  // of what is predicted
    J.col(0) = state.scales.cwiseProduct(state.map * (gyro_.RateAt(to_ns) - gyro_.RateAt(from_ns)));
    J.middleCols<3>(1) = -(state.scales.asDiagonal() * Skew(turned));  // Exp(d) map
    J.middleCols<3>(4) = step_s * Eigen::Matrix3d::Identity();
    J.middleCols<3>(7) = turned.asDiagonal();
    const Eigen::Matrix3d information = covariances_[i].inverse();
    const double square = e.dot(information * e);
    const double weight = 1 / (1 + square / kTurnLoss);
    normals->H += weight * J.transpose() * information * J;
    normals->g += weight * J.transpose() * information * e;
    normals->squares += weight * square;
    normals->count += weight;
    normals->turned_squares += turned.cwiseAbs2();
  }

  Normals NormalsAt(const Refined& state) const {
    Normals normals;
    for (size_t i = 0; i < turns_.size(); ++i) AddTurn(i, state, &normals);
    for (int k = 4; k < 7; ++k) {
      normals.H(k, k) += std::pow(kBiasSigma_rad_s, -2);
      normals.g[k] -= state.bias_rad_s[k - 4] * std::pow(kBiasSigma_rad_s, -2);
    }
    normals.H.diagonal().array() += 1e-9;
    return normals;
  }

  // Gauss-Newton, robust; not enough motion where that fails.
  void Refine(TurnAlignment* alignment) const {
    const TurnFit& fit = alignment->best;
    Refined state;
    state.map = R_imu_camera_.conjugate().toRotationMatrix() * fit.change.matrix;
    state.offset_s = fit.time_offset_s;
    state.scales.setConstant(fit.scale);
    Normals normals;
    for (int iteration = 0; iteration < kAlignmentIterations; ++iteration) {
      normals = NormalsAt(state);
      const Vector10d step = normals.H.ldlt().solve(normals.g);
      alignment->enough_motion = step.allFinite();
      if (!alignment->enough_motion) return;
      state.Move(step);
    }
    const Matrix10d covariance = normals.Covariance();
    alignment->enough_motion = covariance.allFinite() && covariance.diagonal().minCoeff() >= 0;
    if (!alignment->enough_motion) return;
    Describe(state, covariance, alignment);
    AddLeaks(normals.turned_squares, &alignment->scale_sigmas);
  }

  // Images take a little of a turn about one axis for one about another: a level robot, which turns
  // about a single one, tells nothing of the others.
  static void AddLeaks(const Eigen::Vector3d& turned_squares, Eigen::Vector3d* scale_sigmas) {
    constexpr double kLeak = 0.002;  // of the turn, a tenth of a degree
    for (int axis = 0; axis < 3; ++axis) {
      const double own = turned_squares[axis];
      const double leaked = kLeak * std::sqrt((turned_squares.sum() - own) / std::max(own, 1e-12));
      (*scale_sigmas)[axis] = std::hypot((*scale_sigmas)[axis], leaked);
    }
  }

  static void Describe(const Refined& state, const Matrix10d& covariance,
                       TurnAlignment* alignment) {
    const TurnFit& fit = alignment->best;
    alignment->time_offset_s = state.offset_s;
    alignment->time_offset_sigma_s = std::sqrt(covariance(0, 0));
    // map = R_camera_imu, times the change where that is no rotation.
    const Eigen::Matrix3d rotation =
        fit.change.IsRotation() ? state.map
                                : Eigen::Matrix3d(state.map * fit.change.matrix.transpose());
    alignment->R_imu_camera = Eigen::Quaterniond(Eigen::Matrix3d(rotation.transpose()));
    alignment->rotation_sigma_rad =
        (rotation.transpose() * covariance.block<3, 3>(1, 1) * rotation).diagonal().cwiseSqrt();
    // Scales that differ between the axes are the images', not the gyroscope's.
    const double scale = std::abs(fit.scale - 1) < kUsualScaleError ? 1 : fit.scale;
    alignment->camera_from_gyro = scale * state.map;
    alignment->camera_bias_rad_s = -scale * state.bias_rad_s.cwiseQuotient(state.scales);
    alignment->scales = state.scales;
    alignment->scale_sigmas = covariance.diagonal().tail<3>().cwiseSqrt();
  }

  const GyroIntegral gyro_;
  const Eigen::Quaterniond R_imu_camera_;
  const double claimed_s_;
  std::vector<ImageTurn> turns_;
  std::vector<Eigen::Matrix3d> covariances_;
  std::vector<double> weights_;
};

// Rates of the turns that the gyroscope covers at an offset.
Rates CoveredRates(const std::vector<ImageTurn>& turns, const GyroIntegral& gyro,
                   double time_offset_s) {
  Rates rates;
  const int64_t offset_ns = ToNanoseconds(time_offset_s);
  for (const ImageTurn& turn : turns) {
    const int64_t from_ns = turn.from_ns + offset_ns, to_ns = turn.to_ns + offset_ns;
    if (!gyro.Covers(from_ns, to_ns)) continue;
    const double step_s = ToSeconds(to_ns - from_ns);
    rates.camera.push_back(turn.turn_rad / step_s);
    rates.gyro.push_back(gyro.Between(from_ns, to_ns) / step_s);
    rates.weights.push_back(step_s * step_s /
                            (turn.covariance.trace() + 3 * kTurnFloor_rad * kTurnFloor_rad));
  }
  return rates;
}

}  // namespace

std::optional<double> FindFarOffset(const std::vector<ImageTurn>& turns,
                                    const std::vector<ImuSample>& imu,
                                    const Eigen::Quaterniond& R_imu_camera, double time_offset_s) {
  const GyroIntegral gyro(imu);
  const Eigen::Matrix3d R_camera_imu = R_imu_camera.conjugate().toRotationMatrix();
  std::vector<std::pair<double, double>> left;  // offset, share of the turns that it leaves
  const int steps = static_cast<int>(std::lround(kFarOffset_s / kFarStep_s));
  for (int step = -steps; step <= steps; ++step) {
    const double offset_s = time_offset_s + step * kFarStep_s;
    const Rates rates = CoveredRates(turns, gyro, offset_s);
    if (rates.weights.size() < kMinTurns) continue;
    const double step_s = ToSeconds(turns.front().to_ns - turns.front().from_ns);
    if (static_cast<double>(rates.weights.size()) * step_s < kMinOverlap_s) continue;
    const Moments moments = ComputeMoments(rates);
    if (std::sqrt(moments.camera) < kMinRate_rad_s) continue;
    left.emplace_back(offset_s, Unexplained(moments, R_camera_imu));
  }
  const auto by_share = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto best = std::min_element(left.begin(), left.end(), by_share);
  if (best == left.end() || best->second > kFarExplained) return std::nullopt;
  // Clocks that agree, whatever else keeps turns from being aligned.
  if (std::abs(best->first - time_offset_s) <= kMaxAlignedOffset_s) return std::nullopt;
  const bool others = std::any_of(left.begin(), left.end(), [&](const auto& other) {
    return std::abs(other.first - best->first) > kFarApart_s &&
           other.second < std::max(kFarElse, kFarLead * best->second);
  });
  return others ? std::nullopt : std::optional(best->first);
}

TurnAlignment AlignTurns(const std::vector<ImageTurn>& turns, const std::vector<ImuSample>& imu,
                         const Eigen::Quaterniond& R_imu_camera, double time_offset_s) {
  return Aligner(turns, imu, R_imu_camera, time_offset_s).Align();
}

}  // namespace slcmap::data
