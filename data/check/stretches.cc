#include "data/check/stretches.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "data/angle_unit.h"
#include "data/calibration.h"
#include "data/check/left_right.h"
#include "data/check/row_alignment.h"
#include "data/source/asl_source.h"

namespace slcmap {
namespace {

constexpr size_t kStretchSamples = 16, kLeastStretch = 3;  // samples; of a part, at least
constexpr int kLeastMatches = 60;                          // of a part
constexpr double kStretchGood = 0.8, kStretchGain = 0.2;   // shares that agree
constexpr double kStretchAgree_px = 2.5;
constexpr double kKnocked_rad = 0.1 * kDegree, kKnockedClear = 6;

struct Agreeing {
  int matches = 0, agreeing = 0;

  double share() const { return matches == 0 ? 0 : 1.0 * agreeing / matches; }
  void Add(const Agreeing& other) {
    matches += other.matches;
    agreeing += other.agreeing;
  }
};

// A stretch of the samples, [first, end).
struct SampleRange {
  size_t first, end;
};

class StretchFinder {
 public:
  StretchFinder(const Sequence& sequence, const Progress& progress)
      : sequence_(sequence), source_(sequence), progress_(progress) {
    const size_t all = sequence.images.size(), samples = std::min(kStretchSamples, all);
    for (size_t i = 0; i < samples; ++i) pairs_.push_back((2 * i + 1) * all / (2 * samples));
    for (size_t i = 0; i < samples; ++i) {
      progress_.ReportOrStop(static_cast<double>(i) / static_cast<double>(samples));
      matches_.push_back(Match(pairs_[i], 0));
      agreeing_.push_back(AgreeingOf(matches_.back()));
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

  Agreeing Sum(const SampleRange& range) const {
    Agreeing sum;
    for (size_t i = range.first; i < range.end; ++i) sum.Add(agreeing_[i]);
    return sum;
  }

  // With the right images of pairs that are so many later.
  Agreeing Shifted(const SampleRange& range, int later) const {
    Agreeing sum;
    for (size_t i = range.first; i < range.end; ++i) sum.Add(AgreeingOf(Match(pairs_[i], later)));
    return sum;
  }

  RowAlignment Turned(const SampleRange& range) const {
    std::vector<RayPair> all;
    for (size_t i = range.first; i < range.end; ++i) {
      all.insert(all.end(), matches_[i].begin(), matches_[i].end());
    }
    return AlignRows(all, LeftRight(sequence_.rig), sequence_.rig.cameras[0].MiddleFocal_px());
  }

  // The first pair of the second part, between the samples on either side of the change: where the
  // right images of other pairs begin (or cease, where `later_first`) to agree better.
  size_t FirstShifted(size_t change, int later, bool later_first) const {
    size_t low = pairs_[change - 1], high = pairs_[change];
    while (high - low > 1) {
      const size_t middle = (low + high) / 2;
      const bool shifted = MedianRow_px(Match(middle, later)) < MedianRow_px(Match(middle, 0));
      (shifted != later_first ? high : low) = middle;
    }
    return high;
  }

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
      rows_px.push_back(std::abs(normal.dot(rays.first)) * sequence_.rig.cameras[0].MiddleFocal_px());
    }
    return rows_px;
  }

  double MedianRow_px(const std::vector<RayPair>& matches) const {
    return matches.empty() ? 1e9 : Median(Rows_px(matches));
  }

  Agreeing AgreeingOf(const std::vector<RayPair>& matches) const {
    const std::vector<double> rows_px = Rows_px(matches);
    const auto agree = std::ranges::count_if(
        rows_px, [](double row_px) { return row_px < kStretchAgree_px; });
    return {static_cast<int>(matches.size()), static_cast<int>(agree)};
  }

  const Sequence& sequence_;
  const AslSource source_;
  const Progress progress_;
  std::vector<size_t> pairs_;
  std::vector<std::vector<RayPair>> matches_;
  std::vector<Agreeing> agreeing_;
};

// Pairs [first, end) with the right images of pairs so many later; those without one go.
void ShiftRight(size_t first, size_t end, int later, std::vector<StereoEntry>* images) {
  std::vector<StereoEntry> shifted;
  for (size_t i = 0; i < images->size(); ++i) {
    StereoEntry entry = (*images)[i];
    const auto from = static_cast<std::ptrdiff_t>(i) + (i >= first && i < end ? later : 0);
    if (from < 0 || from >= std::ssize(*images)) continue;
    entry.right_path = (*images)[static_cast<size_t>(from)].right_path;
    shifted.push_back(entry);
  }
  *images = std::move(shifted);
}

double Since_s(const Sequence& sequence, size_t pair) {
  return ToSeconds(sequence.images[pair].stamp_ns - sequence.images.front().stamp_ns);
}

// Right images of other pairs that mend the part that does not agree. False where none do.
bool MendSlip(const StretchFinder& finder, size_t change, Sequence* sequence, CheckReport* report) {
  const SampleRange before{0, change}, after{change, finder.samples()};
  const bool first_good = finder.Sum(before).share() > finder.Sum(after).share();
  const SampleRange& part = first_good ? after : before;
  const double given = finder.Sum(part).share();
  double best = std::max(kStretchGood, given + kStretchGain);
  int later = 0;
  for (const int tried : {1, -1, 2, -2, 3, -3}) {
    const Agreeing shifted = finder.Shifted(part, tried);
    if (shifted.matches < kLeastMatches || shifted.share() <= best) continue;
    best = shifted.share();
    later = tried;
  }
  if (later == 0) return false;
  const size_t first = finder.FirstShifted(change, later, !first_good);
  const std::string words = fmt::format(
      "right images of {} pair {} {} pair {} ({:.2f} s)", std::abs(later) == 1 ? "the" : fmt::format("the {}.", std::abs(later)),
      later > 0 ? "after" : "before", first_good ? "from" : "before", first, Since_s(*sequence, first));
  report->Warn("synchronisation",
               fmt::format("left and right images are out of step {} pair {} ({:.2f} s, {}): {:.0f} "
                           "% of the features agree there as paired, {:.0f} % with the right "
                           "images {} {}",
                           first_good ? "from" : "up to", first, Since_s(*sequence, first),
                           sequence->images[first].left_path, 100 * given, 100 * best,
                           std::abs(later), later > 0 ? "further down" : "further up"),
               fmt::format("pair images by their true stamps, not by count: a frame of {} is lost "
                           "there; it is paired anew for this run",
                           (later > 0) == first_good ? "cam0, or one of cam1 is twice there," : "cam1"));
  report->corrections.push_back(
      {kRightShiftCorrection, {static_cast<double>(first), static_cast<double>(later)}, words});
  ShiftRight(first_good ? first : 0, first_good ? sequence->images.size() : first, later,
             &sequence->images);
  return true;
}

// A right camera that was turned by a knock: what does not agree is left out.
void LeaveOutKnocked(const StretchFinder& finder, size_t change, Sequence* sequence,
                     CheckReport* report) {
  const SampleRange before{0, change}, after{change, finder.samples()};
  const bool first_good = finder.Sum(before).share() > finder.Sum(after).share();
  const SampleRange& part = first_good ? after : before;
  const RowAlignment rows = finder.Turned(part);
  const double given = finder.Sum(part).share();
  bool is_clear = false;
  for (int axis = 0; axis < 3; ++axis) {
    is_clear = is_clear || std::abs(rows.turn_rad[axis]) >
                               std::max(kKnocked_rad, kKnockedClear * rows.turn_sigma_rad[axis]);
  }
  if (!is_clear || rows.agreeing_share < std::max(kStretchGood, given + kStretchGain)) return;
  const size_t first = first_good ? 0 : finder.pair(change);
  const size_t end = first_good ? finder.pair(change - 1) + 1 : sequence->images.size();
  const size_t at = first_good ? end : first;
  const std::string words = fmt::format("pairs {} to {} of {}", first, end - 1,
                                        sequence->images.size());
  const Eigen::Vector3d turn = rows.turn_rad / kDegree;
  report->Warn(
      "knocked",
      fmt::format("left and right images agree with the calibration {} about pair {} ({:.2f} s) "
                  "only: {:.0f} % of the features {}, {:.0f} % with the right camera turned by "
                  "({:.2f}, {:.2f}, {:.2f}) degrees",
                  first_good ? "up to" : "from", at, Since_s(*sequence, at), 100 * given,
                  first_good ? "after" : "before", 100 * rows.agreeing_share, turn.x(), turn.y(),
                  turn.z()),
      fmt::format("fasten the cameras and calibrate them anew; {} are used, the others left out",
                  words));
  report->corrections.push_back(
      {kStretchCorrection, {static_cast<double>(first), static_cast<double>(end)}, words});
  const auto begin = sequence->images.begin();
  sequence->images = std::vector<StereoEntry>(begin + static_cast<std::ptrdiff_t>(first),
                                              begin + static_cast<std::ptrdiff_t>(end));
}

}  // namespace

void MendStretches(Sequence* sequence, const Progress& progress, CheckReport* report) {
  if (!IsStereo(sequence->rig) || sequence->images.size() < 2 * kStretchSamples) return;
  const StretchFinder finder(*sequence, progress);
  const std::optional<size_t> change = finder.Change();
  if (!change || MendSlip(finder, *change, sequence, report)) return;
  LeaveOutKnocked(finder, *change, sequence, report);
}

}  // namespace slcmap
