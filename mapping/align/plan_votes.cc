#include "mapping/align/plan_votes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace slcmap::inline mapping {
namespace {

// Of the plan that is searched; grows with buildings that are larger than some 200 m.
constexpr double kVoteCell_m = 0.1;
constexpr int kMaxCandidates = 60;  // places that are looked at closely

constexpr double kQuarterTurn_rad = std::numbers::pi / 2;
constexpr int kMostCells = 2048;        // of a side of the plan
constexpr double kSameTurn_rad = 0.01;  // turns that one of is enough of
constexpr int kPlacesOfTurn = 30;
constexpr double kBetweenPlaces_m = 0.4;
constexpr int kHeightsOfPlace = 3;
constexpr double kHeightBin_m = 0.04, kBetweenHeights_m = 0.3, kLeastHeightShare = 0.5;
constexpr double kUprightDirection_z = 0.98, kLevelLine_z = 0.2;
constexpr double kAcross = 0.9;         // cosine between a normal or direction and its axis
constexpr float kUprightLineVotes = 2;  // against the other kinds

// Faces to +x, -x, +y and -y, upright lines, level ones along x and along y.
constexpr int kLayers = 7;
using PlanLayers = std::array<cv::Mat1f, kLayers>;

int LayerOfNormal(const Eigen::Vector3d& normal) {
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(normal[axis]) > kAcross) return 2 * axis + (normal[axis] < 0 ? 1 : 0);
  }
  return -1;
}

int LayerOfDirection(const Eigen::Vector3d& direction) {
  if (std::abs(direction.z()) > kUprightDirection_z) return 4;
  if (std::abs(direction.x()) > kAcross) return 5;
  return std::abs(direction.y()) > kAcross ? 6 : -1;
}

struct PlanBox {
  Eigen::Vector2d least = Eigen::Vector2d::Constant(1e9), most = Eigen::Vector2d::Constant(-1e9);

  void Add(const Eigen::Vector3d& p) {
    least = least.cwiseMin(p.head<2>());
    most = most.cwiseMax(p.head<2>());
  }
  Eigen::Vector2d size() const { return most - least; }
};

PlanBox BoundPoints(const AlignmentFeatures& features, const RigidTransform& turn) {
  PlanBox box;
  for (const SurfaceSample& surface : features.surfaces) box.Add(turn * surface.p_world);
  for (const LinePlace& line : features.lines) box.Add(turn * line.p_world);
  return box;
}

// What a map votes with, turned so that its headings are x and y.
class Plan {
 public:
  Plan(const AlignmentFeatures& features, const RigidTransform& turn, const PlanBox& box,
       const cv::Size& cells, double cell_m)
      : box_(box), cell_m_(cell_m) {
    for (cv::Mat1f& layer : layers_) layer = cv::Mat1f::zeros(cells);
    for (const SurfaceSample& surface : features.surfaces) {
      Add(LayerOfNormal(turn.rotation * surface.normal_world), turn * surface.p_world);
    }
    for (const LinePlace& line : features.lines) {
      Add(LayerOfDirection(turn.rotation * line.direction_world), turn * line.p_world);
    }
    // What is high must not outvote all else.
    for (cv::Mat1f& layer : layers_) cv::sqrt(layer, layer);
    layers_[4] *= kUprightLineVotes;
  }

  PlanLayers Spectra(bool blurred, const Progress& progress) const {
    PlanLayers spectra;
    for (int i = 0; i < kLayers; ++i) {
      progress.ReportOrStop(static_cast<double>(i) / kLayers);
      cv::Mat1f layer = layers_[i];
      if (blurred) cv::GaussianBlur(layers_[i], layer, {5, 5}, 1.0);
      cv::dft(layer, spectra[i]);
    }
    return spectra;
  }

 private:
  void Add(int layer, const Eigen::Vector3d& p) {
    if (layer < 0) return;
    const Eigen::Vector2d cell = (p.head<2>() - box_.least) / cell_m_;
    layers_[layer](static_cast<int>(cell.y()), static_cast<int>(cell.x())) += 1;
  }

  const PlanBox box_;
  const double cell_m_;
  PlanLayers layers_;
};

// Votes by shift, which wraps around.
cv::Mat1f Correlation(const PlanLayers& first, const PlanLayers& second, const Progress& progress) {
  cv::Mat1f sum(first[0].size(), 0.F), product;
  for (int i = 0; i < kLayers; ++i) {
    constexpr bool kConjugateSecond = true;
    progress.ReportOrStop(static_cast<double>(i) / kLayers);
    cv::mulSpectrums(first[i], second[i], product, 0, kConjugateSecond);
    sum += product;
  }
  cv::Mat1f votes;
  cv::dft(sum, votes, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  return votes;
}

struct PlanPeak {
  Eigen::Vector2i shift = Eigen::Vector2i::Zero();  // cells
  float votes = 0;
};

// The shifts with most votes of all around them, some apart; those above `most` stand for what is
// behind zero.
std::vector<PlanPeak> FindPeaks(const cv::Mat1f& votes, const Eigen::Vector2i& most, int apart,
                                const std::function<bool(const Eigen::Vector2i&)>& is_allowed) {
  cv::Mat1f highest, wrapped;
  const int border = apart;
  cv::copyMakeBorder(votes, wrapped, border, border, border, border, cv::BORDER_WRAP);
  cv::dilate(wrapped, highest, cv::Mat::ones(2 * apart + 1, 2 * apart + 1, CV_8U));
  std::vector<PlanPeak> peaks;
  for (int row = 0; row < votes.rows; ++row) {
    for (int column = 0; column < votes.cols; ++column) {
      if (votes(row, column) < highest(row + border, column + border)) continue;
      const Eigen::Vector2i shift(column <= most.x() ? column : column - votes.cols,
                                  row <= most.y() ? row : row - votes.rows);
      if (is_allowed(shift)) peaks.push_back({shift, votes(row, column)});
    }
  }
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const PlanPeak& a, const PlanPeak& b) { return a.votes > b.votes; });
  if (peaks.size() > kPlacesOfTurn) peaks.resize(kPlacesOfTurn);
  return peaks;
}

// By bins of height: what faces up, what faces down, and level lines.
std::array<std::map<int, double>, 3> CountHeights(const AlignmentFeatures& features) {
  std::array<std::map<int, double>, 3> kinds;
  const auto add = [&](size_t kind, double z_m) {
    kinds[kind][static_cast<int>(std::floor(z_m / kHeightBin_m))] += 1;
  };
  for (const SurfaceSample& surface : features.surfaces) {
    if (std::abs(surface.normal_world.z()) < kAcross) continue;
    add(surface.normal_world.z() > 0 ? 0 : 1, surface.p_world.z());
  }
  for (const LinePlace& line : features.lines) {
    if (std::abs(line.direction_world.z()) < kLevelLine_z) add(2, line.p_world.z());
  }
  for (std::map<int, double>& bins : kinds) {
    for (auto& [bin, count] : bins) count = std::sqrt(count);
  }
  return kinds;
}

double Wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

}  // namespace

std::vector<PlanTurn> FindTurns(const AlignmentFeatures& first, const AlignmentFeatures& second,
                                const AlignmentOptions& options) {
  std::vector<PlanTurn> turns;
  for (const double to_rad : first.headings_rad) {
    for (const double from_rad : second.headings_rad) {
      for (int quarters = 0; quarters < 4; ++quarters) {
        const double yaw_rad = Wrapped(to_rad - from_rad + quarters * kQuarterTurn_rad);
        if (options.start &&
            std::abs(Wrapped(yaw_rad - options.start->yaw_rad)) > kStartReachYaw_rad) {
          continue;
        }
        const auto is_same = [&](const PlanTurn& turn) {
          return std::abs(Wrapped(turn.yaw_rad - yaw_rad)) < kSameTurn_rad;
        };
        if (std::none_of(turns.begin(), turns.end(), is_same)) turns.push_back({yaw_rad, to_rad});
      }
    }
  }
  return turns;
}

std::vector<double> FindHeights(const AlignmentFeatures& first, const AlignmentFeatures& second,
                                const AlignmentOptions& options) {
  const auto ours = CountHeights(first), theirs = CountHeights(second);
  std::map<int, double> votes;  // by shift, of bins that meet or are next to each other
  for (size_t kind = 0; kind < ours.size(); ++kind) {
    for (const auto& [to, here] : ours[kind]) {
      for (const auto& [from, there] : theirs[kind]) {
        votes[to - from] += here * there;
        for (const int beside : {-1, 1}) votes[to - from + beside] += 0.5 * here * there;
      }
    }
  }
  std::vector<std::pair<double, double>> sums;
  for (const auto& [shift, sum] : votes) {
    const double shift_m = shift * kHeightBin_m;
    const bool is_allowed =
        !options.start || std::abs(shift_m - options.start->p_world.z()) <= kStartReachUp_m;
    if (is_allowed) sums.emplace_back(sum, shift_m);
  }
  std::ranges::stable_sort(sums, std::greater(), &std::pair<double, double>::first);
  std::vector<double> shifts_m;
  for (const auto& [sum, shift_m] : sums) {
    if (sum < kLeastHeightShare * sums.front().first || shifts_m.size() == kHeightsOfPlace) break;
    const bool is_near = std::ranges::any_of(shifts_m, [shift_m = shift_m](double other_m) {
      return std::abs(other_m - shift_m) < kBetweenHeights_m;
    });
    if (!is_near) shifts_m.push_back(shift_m);
  }
  return shifts_m;
}

namespace {

// A shift of less than the sum of both plans is told from one the other way round.
cv::Size CellsFor(const PlanBox& first, const PlanBox& second, double cell_m) {
  const Eigen::Vector2d size = (first.size() + second.size()) / cell_m;
  return {cv::getOptimalDFTSize(static_cast<int>(size.x()) + 4),
          cv::getOptimalDFTSize(static_cast<int>(size.y()) + 4)};
}

std::vector<AlignmentCandidate> ListCandidates(const PlanTurn& turn, const AlignmentFeatures& first,
                                               const AlignmentFeatures& second,
                                               const std::vector<double>& shifts_up_m,
                                               const AlignmentOptions& options,
                                               const Progress& progress) {
  const RigidTransform straight = LevelTransform(-turn.heading_rad, Eigen::Vector3d::Zero());
  const RigidTransform turned =
      LevelTransform(turn.yaw_rad - turn.heading_rad, Eigen::Vector3d::Zero());
  const PlanBox first_box = BoundPoints(first, straight), second_box = BoundPoints(second, turned);
  const double extent_m = (first_box.size() + second_box.size()).maxCoeff();
  const double cell_m = std::max(kVoteCell_m, extent_m / kMostCells);
  const cv::Size cells = CellsFor(first_box, second_box, cell_m);
  const PlanLayers ours =
      Plan(first, straight, first_box, cells, cell_m).Spectra(true, progress.Part(0.2, 0.5));
  const PlanLayers theirs =
      Plan(second, turned, second_box, cells, cell_m).Spectra(false, progress.Part(0.5, 0.8));
  const auto translation = [&](const Eigen::Vector2i& shift) -> Eigen::Vector3d {
    const Eigen::Vector2d t = cell_m * shift.cast<double>() + first_box.least - second_box.least;
    return straight.rotation.conjugate() * Eigen::Vector3d(t.x(), t.y(), 0);
  };
  const auto is_allowed = [&](const Eigen::Vector2i& shift) {
    return !options.start ||
           (translation(shift) - options.start->p_world).head<2>().norm() <= kStartReach_m;
  };
  std::vector<AlignmentCandidate> candidates;
  const int apart = std::max(1, static_cast<int>(std::lround(kBetweenPlaces_m / cell_m)));
  const Eigen::Vector2i most = (first_box.size() / cell_m).array().ceil().cast<int>();
  const cv::Mat1f votes = Correlation(ours, theirs, progress.Part(0.8, 0.9));
  progress.ReportOrStop(0.9);
  for (const PlanPeak& peak : FindPeaks(votes, most, apart, is_allowed)) {
    for (const double up_m : shifts_up_m) {
      Eigen::Vector3d shift = translation(peak.shift);
      shift.z() = up_m;
      candidates.push_back({LevelTransform(turn.yaw_rad, shift), peak.votes});
    }
  }
  return candidates;
}

}  // namespace

std::vector<AlignmentCandidate> FindCandidates(const AlignmentFeatures& first,
                                               const AlignmentFeatures& second,
                                               const AlignmentOptions& options,
                                               const Progress& progress) {
  const std::vector<double> shifts_up_m = FindHeights(first, second, options);
  std::vector<AlignmentCandidate> all;
  const std::vector<PlanTurn> turns = FindTurns(first, second, options);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const double from = static_cast<double>(i), count = static_cast<double>(turns.size());
    const auto candidates = ListCandidates(turns[i], first, second, shifts_up_m, options,
                                           progress.Part(from / count, (from + 1) / count));
    all.insert(all.end(), candidates.begin(), candidates.end());
  }
  std::stable_sort(
      all.begin(), all.end(),
      [](const AlignmentCandidate& a, const AlignmentCandidate& b) { return a.votes > b.votes; });
  if (static_cast<int>(all.size()) > kMaxCandidates) all.resize(kMaxCandidates);
  return all;
}

}  // namespace slcmap::mapping
