#include "mapping/given_poses/given_poses.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <map>
#include <utility>

#include "data/error.h"
#include "data/quantile.h"
#include "mapping/given_poses/pose_adjustment.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

// The length of the median of each pair of views.
std::vector<double> OffOfPairs_px(const std::vector<PoseMatch>& matches, const Views& views,
                                  const Rig& rig) {
  std::map<std::pair<size_t, size_t>, std::pair<std::vector<double>, std::vector<double>>> of_pairs;
  for (const PoseMatch& match : matches) {
    const auto off_px = OffMatch_px(match, views, rig);
    if (!off_px) continue;
    auto& [x, y] = of_pairs[{match.from, match.to}];
    x.push_back(off_px->x());
    y.push_back(off_px->y());
  }
  std::vector<double> lengths_px;
  for (auto& [pair, of_pair] : of_pairs) {
    lengths_px.push_back(std::hypot(Quantile(of_pair.first, 0.5), Quantile(of_pair.second, 0.5)));
  }
  return lengths_px;
}

void SetMoves(const Views& given, const Views& adjusted, GivenPoseFigures* figures) {
  double moved2 = 0, turned2 = 0;
  for (size_t i = 0; i < given.size(); ++i) {
    const RigidTransform move = given[i].T_world_imu.Inverse() * adjusted[i].T_world_imu;
    moved2 += move.translation.squaredNorm();
    turned2 += std::pow(Eigen::AngleAxisd(move.rotation).angle(), 2);
  }
  const auto count = static_cast<double>(given.size());
  figures->moved_m = std::sqrt(moved2 / count);
  figures->turned_rad = std::sqrt(turned2 / count);
}

}  // namespace

std::optional<AdjustedViews> AdjustGivenViews(const Views& given, const ViewImages& images,
                                              const GivenPoseOptions& options,
                                              const Progress& progress) {
  constexpr double kPoints = 0.5, kMatched = 0.9;  // shares of the time: of all, of a round
  options.Check();
  if (!options.adjust) return std::nullopt;
  AdjustedViews adjusted{given, {}};
  GivenPoseFigures& figures = adjusted.figures;
  figures.views = std::ssize(given);
  const std::vector<std::vector<ViewPoint>> points =
      PointsOfViews(given, images, options, progress.Part(0, kPoints));
  const Progress moving = progress.Part(kPoints, 1);
  for (int round = 0; round < options.rounds; ++round) {
    const Progress part =
        moving.Part(1.0 * round / options.rounds, 1.0 * (round + 1) / options.rounds);
    const std::vector<PoseMatch> matches =
        MatchViews(adjusted.views, points, images, options, part.Part(0, kMatched));
    const std::vector<double> given_px = OffOfPairs_px(matches, given, images.rig());
    if (given_px.empty()) return std::nullopt;
    figures.given_off_px = Quantile(given_px, 0.5);
    if (figures.given_off_px <= options.good_px) return std::nullopt;
    adjusted.views =
        AdjustViews(given, adjusted.views, matches, images.rig(), options, part.Part(kMatched, 1));
    figures.pairs = std::ssize(given_px);
    figures.points = std::ssize(matches);
    figures.off_px = Quantile(OffOfPairs_px(matches, adjusted.views, images.rig()), 0.5);
  }
  SetMoves(given, adjusted.views, &figures);
  return adjusted;
}

std::optional<GivenPoseFigures> AdjustGivenPoses(const ViewImages& images,
                                                 const GivenPoseOptions& options, OdometryRun* run,
                                                 const Progress& progress) {
  Views given;
  for (const Keyframe& keyframe : run->keyframes) {
    given.push_back({keyframe.stamp_ns, keyframe.segment, keyframe.T_world_imu});
  }
  try {
    const auto adjusted = AdjustGivenViews(given, images, options, progress);
    if (!adjusted) return std::nullopt;
    for (size_t i = 0; i < given.size(); ++i) {
      run->keyframes[i].T_world_imu = adjusted->views[i].T_world_imu;
    }
    const GivenPoseFigures& figures = adjusted->figures;
    spdlog::info(
        "poses were moved to agree with the images: by {:.1f} mm and {:.2f} degrees (RMS of {} "
        "views); points of {} pairs of views were {:.2f} px off, now {:.2f} px",
        1e3 * figures.moved_m, figures.turned_rad * 180 / M_PI, figures.views, figures.pairs,
        figures.given_off_px, figures.off_px);
    return figures;
  } catch (const StoppedError&) {
    spdlog::debug("the adjustment of poses was interrupted");
    return std::nullopt;
  }
}

}  // namespace slcmap
