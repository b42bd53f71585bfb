#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/calibration/calibration.h"
#include "data/check/check.h"
#include "data/check/image_motion.h"
#include "data/check/row_alignment.h"
#include "data/check/step_lags.h"
#include "data/check/turn_alignment.h"
#include "data/check/view_geometry.h"
#include "data/core/math.h"
#include "data/source/recorded_source.h"

namespace slcmap::inline data {
namespace {

constexpr size_t kStretchSamples = 16, kLeastStretch = 3;  // samples; of a part, at least
constexpr int kLeastMatches = 60;                          // of a part
constexpr double kStretchGood = 0.8, kStretchGain = 0.2;   // shares that agree
constexpr double kKnocked_rad = 0.1 * kDegree, kKnockedClear = 6;

struct Agreeing {
  int matches = 0, agreeing = 0;

  double share() const { return matches == 0 ? 0 : 1.0 * agreeing / matches; }
  void Add(const Agreeing& other) {
    matches += other.matches;
    agreeing += other.agreeing;
  }
};

class IntervalFinder {
 public:
  IntervalFinder(const Sequence& sequence, const Progress& progress)
      : sequence_(sequence), source_(sequence), progress_(progress) {
    const size_t all = sequence.images.size(), samples = std::min(kStretchSamples, all);
    for (size_t i = 0; i < samples; ++i) pairs_.push_back((2 * i + 1) * all / (2 * samples));
    for (size_t i = 0; i < samples; ++i) {
      progress_.ReportOrStop(static_cast<double>(i) / static_cast<double>(samples));
      matches_.push_back(Match(pairs_[i], 0));
      agreeing_.push_back(FindAgreeing(matches_.back()));
    }
  }

  // Where a part that agrees meets one that does so less: the first sample of the second part.
  std::optional<size_t> Change() const {
    double best = 0;
    std::optional<size_t> change;
    for (size_t k = kLeastStretch; k + kLeastStretch <= pairs_.size(); ++k) {
      const Agreeing before = Sum({0, k}), after = Sum({k, pairs_.size()});
      const double likelihood =
          LogLikelihood(before) + LogLikelihood(after) - LogLikelihood(Sum({0, pairs_.size()}));
      const auto [less, more] = std::minmax({before.share(), after.share()});
      if (std::min(before.matches, after.matches) < kLeastMatches) continue;
      if (more < kStretchGood || less > more - kStretchGain || likelihood <= best) continue;
      best = likelihood;
      change = k;
    }
    return change;
  }

  Agreeing Sum(const IndexRange& range) const {
    Agreeing sum;
    for (size_t i = range.first; i < range.end; ++i) sum.Add(agreeing_[i]);
    return sum;
  }

  // Whether some part agrees and another does clearly less.
  bool Differs() const {
    double least = 1, most = 0;
    for (size_t k = 0; k + kLeastStretch <= pairs_.size(); ++k) {
      const Agreeing part = Sum({k, k + kLeastStretch});
      if (part.matches < kLeastMatches) continue;
      least = std::min(least, part.share());
      most = std::max(most, part.share());
    }
    return most >= kStretchGood && least <= most - kStretchGain;
  }

  // Of that pair with the right image of another.
  Agreeing Paired(size_t pair, int later) const { return FindAgreeing(Match(pair, later)); }

  RowAlignment Turned(const IndexRange& range) const {
    std::vector<RayPair> all;
    for (size_t i = range.first; i < range.end; ++i) {
      all.insert(all.end(), matches_[i].begin(), matches_[i].end());
    }
    return AlignRows(all, LeftRight(sequence_.rig), sequence_.rig.cameras[0].MiddleFocal_px());
  }

  const RecordedSource& source() const { return source_; }
  size_t pair(size_t sample) const { return pairs_[sample]; }
  size_t samples() const { return pairs_.size(); }

 private:
  static double LogLikelihood(const Agreeing& seen) {
    const auto part = [&](int count) {
      return count == 0 ? 0 : count * std::log(static_cast<double>(count) / seen.matches);
    };
    return part(seen.agreeing) + part(seen.matches - seen.agreeing);
  }

  std::vector<RayPair> Match(size_t pair, int later) const {
    return MatchPair(source_, sequence_.rig, pair, later);
  }

  std::vector<double> Rows_px(const std::vector<RayPair>& matches) const {
    const RigidTransform T_left_right = LeftRight(sequence_.rig);
    std::vector<double> rows_px;
    for (const RayPair& rays : matches) {
      const Eigen::Vector3d right = T_left_right.rotation * rays.second;
      const Eigen::Vector3d normal = T_left_right.translation.cross(right).normalized();
      rows_px.push_back(std::abs(normal.dot(rays.first)) *
                        sequence_.rig.cameras[0].MiddleFocal_px());
    }
    return rows_px;
  }

  Agreeing FindAgreeing(const std::vector<RayPair>& matches) const {
    const std::vector<double> rows_px = Rows_px(matches);
    const auto agree =
        std::ranges::count_if(rows_px, [](double row_px) { return row_px < kAgree_px; });
    return {static_cast<int>(matches.size()), static_cast<int>(agree)};
  }

  const Sequence& sequence_;
  const RecordedSource source_;
  const Progress progress_;
  std::vector<size_t> pairs_;
  std::vector<std::vector<RayPair>> matches_;
  std::vector<Agreeing> agreeing_;
};

double Since_s(const Sequence& sequence, size_t pair) {
  return ToSeconds(sequence.images[pair].stamp_ns - sequence.images.front().stamp_ns);
}

// Pairs [first, end) whose right images are those of pairs so many later, and whose left ones were
// taken so many later than their stamps say.
struct LagPiece {
  size_t first, end;
  int later, late;
};

std::vector<LagPiece> LagPieces(const IntervalFinder& finder, const Sequence& sequence,
                                const Progress& progress) {
  const Rig& rig = sequence.rig;
  const ImageSteps left = FollowSteps(finder.source(), 0, progress),
                   right = FollowSteps(finder.source(), 1, progress);
  const std::vector<int> lags = FindLags(left, right, 0.5 / rig.cameras[0].MiddleFocal_px());
  const ImageSteps gyro = StepsOfGyro(finder.source().info().pair_stamps_ns, rig, sequence.imu);
  std::vector<LagPiece> pieces;
  for (size_t i = 0; i < lags.size(); ++i) {
    if (!pieces.empty() && pieces.back().later == lags[i]) {
      ++pieces.back().end;
    } else {
      pieces.push_back({i, i + 1, lags[i], 0});
    }
  }
  if (pieces.size() < 2) return {};
  for (LagPiece& piece : pieces) piece.late = LateBy(left, gyro, piece.first, piece.end);
  ++pieces.back().end;  // there is one pair more than steps
  return pieces;
}

// Whether rows agree better in what is paired anew.
bool RowsConfirm(const IntervalFinder& finder, const std::vector<LagPiece>& pieces) {
  constexpr size_t kPairsOfPiece = 6;
  constexpr double kLeastGain = 0.1;
  Agreeing given, mended;
  for (const LagPiece& piece : pieces) {
    for (size_t i = 0; i < kPairsOfPiece && piece.later != 0; ++i) {
      const size_t pair =
          piece.first + (2 * i + 1) * (piece.end - piece.first) / (2 * kPairsOfPiece);
      given.Add(finder.Paired(pair, 0));
      mended.Add(finder.Paired(pair, piece.later));
    }
  }
  return mended.matches >= kLeastMatches && mended.share() >= kStretchGood &&
         mended.share() >= given.share() + kLeastGain;
}

// Without the images beside a change, which may be of either side.
std::vector<PairPiece> PairPieces(const std::vector<LagPiece>& pieces,
                                  const std::vector<StereoEntry>& images) {
  std::vector<PairPiece> kept;
  for (const LagPiece& piece : pieces) {
    const size_t first = piece.first + (piece.first > 0 ? 1 : 0);
    const size_t end = piece.end - (piece.end < images.size() ? 1 : 0);
    if (first >= end) continue;
    kept.push_back(
        {images[first].stamp_ns, images[end - 1].stamp_ns, piece.later, piece.late, true});
  }
  return kept;
}

void UsePieces(std::vector<PairPiece> pieces, Sequence* sequence) {
  sequence->images = PairedAnew(pieces, sequence->images);
  sequence->opened.pieces = std::move(pieces);
}

// "cam1 loses a frame" and the like, where a piece begins.
std::string SlipWords(const LagPiece& before, const LagPiece& piece,
                      const std::vector<std::string>& cameras) {
  const std::array<int, 2> lost = {piece.late - before.late,
                                   piece.late - piece.later - before.late + before.later};
  std::string words;
  for (size_t camera = 0; camera < 2; ++camera) {
    if (lost[camera] == 0) continue;
    words += fmt::format("{}{} {} {} of {}", words.empty() ? "" : ", and ", std::abs(lost[camera]),
                         std::abs(lost[camera]) == 1 ? "frame" : "frames",
                         lost[camera] > 0 ? "lost" : "too many", cameras[camera]);
  }
  return words;
}

// Right images of other pairs that mend what does not agree. False where none do.
bool MendSlips(const IntervalFinder& finder, const Progress& progress, Sequence* sequence,
               CheckReport* report) {
  const std::vector<LagPiece> pieces = LagPieces(finder, *sequence, progress);
  if (pieces.empty() || !RowsConfirm(finder, pieces)) return false;
  std::string found, words;
  std::vector<double> values;
  for (size_t i = 0; i < pieces.size(); ++i) {
    const LagPiece& piece = pieces[i];
    values.insert(values.end(), {static_cast<double>(piece.first), static_cast<double>(piece.later),
                                 static_cast<double>(piece.late)});
    if (i == 0 && piece.later == 0) continue;
    found += fmt::format("; from pair {} ({:.2f} s, {}) {}", piece.first,
                         Since_s(*sequence, piece.first), sequence->images[piece.first].left_path,
                         piece.later == 0
                             ? std::string("they are in step again")
                             : fmt::format("the right images are those {} rows further {}",
                                           std::abs(piece.later), piece.later > 0 ? "down" : "up"));
    if (i > 0) {
      found += " (" + SlipWords(pieces[i - 1], piece, sequence->CameraNames()) + ")";
    }
    words += fmt::format("{}from pair {} on with the right images {} later", i == 0 ? "" : ", ",
                         piece.first, piece.later);
  }
  report->Warn("synchronisation", "left and right images are out of step" + found,
               "pair images by their true stamps, not by count; they are paired anew for this run");
  report->corrections.push_back({kRightShiftCorrection, values, words});
  UsePieces(PairPieces(pieces, sequence->images), sequence);
  return true;
}

// Whether the left camera keeps its place to the IMU where the right one is turned by `turn_rad`
// against it: between the parts before and after a pair.
bool KeepsLeft(const Sequence& sequence, size_t at, double turn_rad, const Progress& progress) {
  Rig rig = sequence.rig;
  rig.Resize(1);
  Sequence left = sequence;
  left.rig = rig;
  const RecordedSource source(left);
  const auto align = [&](const IndexRange& part) {
    return AlignTurns(FollowImages(source, rig, {part}, progress).turns, sequence.imu,
                      rig.T_imu_camera[0].rotation, rig.camera_time_offset_s);
  };
  const size_t most = 400;  // pairs on either side
  const TurnAlignment before = align({at - std::min(at, most), at});
  const TurnAlignment after = align({at, std::min(at + most, sequence.images.size())});
  if (!before.enough_motion || !after.enough_motion) return false;
  const Eigen::Vector3d change_rad =
      LogRotation(after.R_imu_camera * before.R_imu_camera.conjugate());
  const double sigma_rad =
      std::hypot(before.rotation_sigma_rad.norm(), after.rotation_sigma_rad.norm());
  return change_rad.norm() < 0.5 * turn_rad && sigma_rad < 0.25 * turn_rad;
}

// A camera that was turned by a knock: where the left one has kept its place it goes on by itself,
// else that part is left out.
void LeaveOutKnocked(const IntervalFinder& finder, size_t change, const Progress& progress,
                     Sequence* sequence, CheckReport* report) {
  const IndexRange before{0, change}, after{change, finder.samples()};
  const bool first_good = finder.Sum(before).share() > finder.Sum(after).share();
  const IndexRange &good = first_good ? before : after, &part = first_good ? after : before;
  const RowAlignment rows = finder.Turned(part), of_good = finder.Turned(good);
  const double given = finder.Sum(part).share();
  const Eigen::Vector3d turn_rad = rows.turn_rad - of_good.turn_rad;
  const Eigen::Vector3d sigma_rad =
      (rows.turn_sigma_rad.cwiseAbs2() + of_good.turn_sigma_rad.cwiseAbs2()).cwiseSqrt();
  const bool is_clear =
      (turn_rad.array().abs() > (kKnockedClear * sigma_rad).array().max(kKnocked_rad)).any();
  if (!is_clear || rows.agreeing_share < std::max(kStretchGood, given + kStretchGain)) return;
  const size_t at = first_good ? finder.pair(change - 1) + 1 : finder.pair(change);
  const bool keeps_left = KeepsLeft(*sequence, at, turn_rad.norm(), progress);
  const size_t first = first_good ? 0 : at, end = first_good ? at : sequence->images.size();
  const std::string words =
      fmt::format("{}airs {} to {} of {}", keeps_left ? "right images of p" : "p", first, end - 1,
                  sequence->images.size());
  const Eigen::Vector3d turn = turn_rad / kDegree;
  report->Warn(
      "knocked",
      fmt::format("left and right images agree with the calibration {} about pair {} ({:.2f} s) "
                  "only: {:.0f} % of the features {}, {:.0f} % with {} turned by ({:.2f}, {:.2f}, "
                  "{:.2f}) degrees",
                  first_good ? "up to" : "from", at, Since_s(*sequence, at), 100 * given,
                  first_good ? "after" : "before", 100 * rows.agreeing_share,
                  keeps_left ? "the right camera" : "the right camera against the left one",
                  turn.x(), turn.y(), turn.z()),
      fmt::format("fasten the cameras and calibrate them anew; {} are used, the others left out",
                  words));
  report->corrections.push_back(
      {kStretchCorrection, {static_cast<double>(first), static_cast<double>(end)}, words});
  std::vector<PairPiece> kept;
  for (const auto& [from, to] : {IndexRange{0, at}, IndexRange{at, sequence->images.size()}}) {
    const bool is_good = from == first;
    if (!is_good && !keeps_left) continue;
    kept.push_back(
        {sequence->images[from].stamp_ns, sequence->images[to - 1].stamp_ns, 0, 0, is_good});
  }
  UsePieces(std::move(kept), sequence);
}

}  // namespace

void MendIntervals(Sequence* sequence, const Progress& progress, CheckReport* report) {
  if (!IsStereo(sequence->rig) || sequence->images.size() < 2 * kStretchSamples) return;
  const IntervalFinder finder(*sequence, progress);
  if (!finder.Differs() || MendSlips(finder, progress, sequence, report)) return;
  const std::optional<size_t> change = finder.Change();
  if (change) LeaveOutKnocked(finder, *change, progress, sequence, report);
}

Sequence SelectPairs(Sequence sequence) {
  if (!IsStereo(sequence.rig)) return sequence;
  std::erase_if(sequence.images, [](const StereoEntry& pair) { return pair.right_path.empty(); });
  return sequence;
}

}  // namespace slcmap::data
