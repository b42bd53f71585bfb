#include "mapping/external_poses/pose_reading.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "data/core/math.h"
#include "mapping/external_poses/pose_changes.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kSparse_s = 0.25;  // more between poses

// A reading, and how well it does.
struct Tried {
  PoseForm form;  // with offset and scale
  int64_t offset_ns = 0;
  double scale = 1, scale_sigma = INFINITY;
  PoseOff off;
};

// Rows read in one way. Poses are those of the sensor, and so are the steps: scaled, its lever on
// the IMU would be too.
// The movements of a sensor at T_imu_sensor.
std::vector<BodyStep> StepsOfSensor(std::vector<BodyStep> steps,
                                    const RigidTransform& T_imu_sensor) {
  for (BodyStep& step : steps) {
    step.T_from_to = T_imu_sensor.Inverse() * step.T_from_to * T_imu_sensor;
  }
  return steps;
}

std::vector<Reading> ListReadings(const PoseTable& table, const PoseForm& given,
                                  const std::vector<BodyStep>& steps,
                                  const std::optional<RigidTransform>& T_imu_camera) {
  const bool is_scalar_first =
      given.quaternion.empty() ? table.is_scalar_first : given.quaternion.starts_with("wxyz");
  std::vector<Reading> readings;
  const auto add = [&](PoseForm form) {
    const bool is_known = std::ranges::any_of(readings, [&](const Reading& known) {
      return known.form.of == form.of && known.form.quaternion == form.quaternion;
    });
    if (is_known || (form.IsOfCamera() && !T_imu_camera)) return;
    PoseForm plain;
    plain.of = form.IsInverse() ? "world-in-imu" : "imu";
    plain.quaternion = form.quaternion;
    readings.push_back({form, CollectPoses(table, plain, std::nullopt),
                        form.IsOfCamera() ? StepsOfSensor(steps, *T_imu_camera) : steps});
  };
  const std::string order = is_scalar_first ? "wxyz" : "xyzw",
                    other = is_scalar_first ? "xyzw" : "wxyz";
  const std::string conjugated = "-conjugated";
  // As given first, and those that are most alike to it before others.
  std::vector<std::string> quaternions = {given.quaternion,
                                          given.IsConjugated() ? order : order + conjugated};
  if (!table.is_matrix) {
    quaternions.push_back(other);
    quaternions.push_back(other + conjugated);
  }
  for (const std::string& quaternion : quaternions) {
    for (const std::string& of : {given.of, std::string("imu"), std::string("camera"),
                                  std::string("world-in-camera"), std::string("world-in-imu")}) {
      PoseForm form = given;
      form.quaternion = quaternion;
      form.of = of;
      add(form);
    }
  }
  return readings;
}

Tried Try(const Reading& reading, int64_t offset_ns, double given_scale) {
  Tried tried;
  tried.form = reading.form;
  tried.offset_ns = offset_ns;
  const std::vector<StepPair> pairs = PairsAt(reading.poses, reading.steps, offset_ns);
  const double scale = EstimateScale(pairs, &tried.scale_sigma);
  // Steps that did not move tell no scale.
  tried.scale = std::isfinite(tried.scale_sigma) && scale > 1e-4 ? scale : given_scale;
  tried.off = ComputePoseOffsets(pairs, tried.scale);
  return tried;
}

int Covered(const Trajectory& poses, const std::vector<BodyStep>& steps, int64_t offset_ns) {
  return static_cast<int>(PairsAt(poses, steps, offset_ns).size());
}

// Offsets at which poses are at many of the steps: near the given one, and where it has few or
// `is_far`, anywhere.
std::vector<int64_t> OffsetsToTry(const Trajectory& poses, const std::vector<BodyStep>& steps,
                                  int64_t given_ns, bool is_far) {
  constexpr int64_t kStep_ns = 20'000'000, kNear_ns = 500'000'000;
  constexpr size_t kMostFar = 4000;
  std::vector<int64_t> offsets_ns = {given_ns};
  const bool is_sparse = MedianPeriod_s(poses) > kSparse_s;
  const bool has_few = is_far || Covered(poses, steps, given_ns) <
                                     std::max<int64_t>(kLeastSteps, std::ssize(steps) / 2);
  if (is_sparse) {  // only where stamps meet
    for (size_t i = 0; i < std::min<size_t>(steps.size(), 5); ++i) {
      for (const StampedPose& pose : poses) {
        const int64_t offset_ns = steps[i].from_ns - pose.stamp_ns;
        if (has_few || std::abs(offset_ns - given_ns) < 4 * kNear_ns)
          offsets_ns.push_back(offset_ns);
      }
    }
  } else {
    for (int64_t near_ns = -kNear_ns; near_ns <= kNear_ns; near_ns += kStep_ns) {
      offsets_ns.push_back(given_ns + near_ns);
    }
  }
  if (has_few && !is_sparse) {
    const int64_t from_ns = steps.front().from_ns - poses.back().stamp_ns,
                  to_ns = steps.back().to_ns - poses.front().stamp_ns;
    const int64_t step_ns = std::max<int64_t>(kStep_ns, (to_ns - from_ns) / kMostFar);
    for (int64_t at_ns = from_ns; at_ns <= to_ns; at_ns += step_ns) offsets_ns.push_back(at_ns);
  }
  return offsets_ns;
}

// The offset of the least cost near one, to half a millisecond.
void RefineOffset(const Reading& reading, Tried* best) {
  if (MedianPeriod_s(reading.poses) > kSparse_s) return;
  for (int64_t step_ns = 10'000'000; step_ns >= 500'000; step_ns /= 2) {
    for (const int64_t at_ns : {best->offset_ns - step_ns, best->offset_ns + step_ns}) {
      const Tried tried = Try(reading, at_ns, best->scale);
      if (tried.off.cost < best->off.cost && 10 * tried.off.steps >= 9 * best->off.steps)
        *best = tried;
    }
  }
}

// With the true poses of V1_01, whose images are a second apart and hard to match, a tenth of both
// is left.
bool Explains(const PoseOff& off, const PoseReading& moved) {
  return off.steps >= kLeastSteps && off.turn_rad < std::max(0.012, 0.2 * moved.moved_rad) &&
         off.way_m < std::max(0.04, 0.25 * moved.moved_m);
}

// Scales that have a reason, where one is near.
double Rounded(double scale, double sigma) {
  const double near = std::clamp(2 * sigma / scale, 0.015, 0.04);
  for (const double known : {0.001, 0.01, 0.0254, 0.1, 0.3048, 0.5, 2.0, 10.0, 100.0, 1000.0}) {
    if (std::abs(scale / known - 1) < near) return known;
  }
  const double unit = std::pow(10, std::floor(std::log10(scale)) - 3);  // four digits
  return std::round(scale / unit) * unit;
}

std::string DescribeReading(const PoseForm& given, const PoseForm& found, bool is_scalar_first,
                            const std::optional<RigidTransform>& T_imu_camera) {
  std::vector<std::string> words;
  const std::string before =
      given.quaternion.empty() ? (is_scalar_first ? "wxyz" : "xyzw") : given.quaternion;
  const std::string after = found.quaternion.empty() ? before : found.quaternion;
  if (before.substr(0, 4) != after.substr(0, 4)) {
    words.push_back(fmt::format("the quaternions are in the order {}, not {}", after.substr(0, 4),
                                before.substr(0, 4)));
  }
  if (given.IsConjugated() != found.IsConjugated()) {
    words.emplace_back(found.IsConjugated()
                           ? "the quaternions are conjugated (each is the inverse rotation)"
                           : "the quaternions are not conjugated");
  }
  if (given.IsOfCamera() != found.IsOfCamera() && T_imu_camera) {
    words.push_back(fmt::format(
        "the poses are those of the {}, not of the {} ({:.1f} degrees and {:.3f} m from it)",
        found.IsOfCamera() ? "left camera" : "IMU", given.IsOfCamera() ? "left camera" : "IMU",
        kDegreesPerRadian * LogRotation(T_imu_camera->rotation).norm(),
        T_imu_camera->translation.norm()));
  }
  if (given.IsInverse() != found.IsInverse()) {
    words.emplace_back(found.IsInverse()
                           ? "the poses are inverse (the world's in the sensor's frame)"
                           : "the poses are not inverse (they are the sensor's in the world)");
  }
  if (found.scale != given.scale) {
    words.push_back(
        fmt::format("lengths are {:.4g} times what they should be", given.scale / found.scale));
  }
  if (found.offset_s != given.offset_s) {
    const double late_s = given.offset_s - found.offset_s;
    words.push_back(std::abs(late_s) < 10
                        ? fmt::format("the stamps are {:.0f} ms {}", 1e3 * std::abs(late_s),
                                      late_s > 0 ? "late" : "early")
                        : fmt::format("the stamps have another start, {:.3f} s {}",
                                      std::abs(late_s), late_s > 0 ? "later" : "earlier"));
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

// What of offset and scale is more than the noise of the steps.
void Settle(const PoseForm& given, const Reading& reading, Tried* best) {
  constexpr double kLeastOffset_s = 0.015, kLeastScale = 0.025, kSigmas = 4, kClear = 0.85;
  constexpr double kLeastGain = 0.15;                    // of an offset, in standard deviations
  constexpr double kMoreTurn = 1.3, kNoTurn_rad = 2e-4;  // that speaks against one
  constexpr double kLeastWay_m = 0.005;                  // less is what a rig that stands is off
  constexpr double kScaleGain = 0.65;  // of what ways are off; drift is not mended by a scale
  const int64_t given_ns = std::llround(given.offset_s * 1e9);
  const Tried at_given = Try(reading, given_ns, given.scale);
  const bool has_poses =
      2 * at_given.off.steps >= best->off.steps && at_given.off.steps >= kLeastSteps;
  // What few steps that are far off gain is no offset.
  const auto median = [](const PoseOff& off) {
    return off.turn_rad / kTurnSigma_rad + off.way_m / kWaySigma_m;
  };
  // Between poses positions are less noisy, so that half an interval seems to gain; turns do not.
  const bool turns_worse = best->off.turn_rad > kMoreTurn * at_given.off.turn_rad + kNoTurn_rad;
  if (has_poses && (turns_worse || median(best->off) > median(at_given.off) ||
                    std::abs(ToSeconds(best->offset_ns - given_ns)) < kLeastOffset_s ||
                    best->off.cost > kClear * at_given.off.cost ||
                    at_given.off.cost - best->off.cost < kLeastGain)) {
    *best = at_given;
  }
  best->form = reading.form;
  if (best->offset_ns != given_ns)
    best->form.offset_s = std::round(ToSeconds(best->offset_ns) * 1e3) / 1e3;
  std::vector<double> ways_m;
  for (const BodyStep& step : reading.steps) ways_m.push_back(step.T_from_to.translation.norm());
  const double relative = best->scale / given.scale;
  const std::vector<StepPair> pairs = PairsAt(reading.poses, reading.steps, best->offset_ns);
  const bool is_scaled =
      std::isfinite(best->scale_sigma) && std::abs(relative - 1) > kLeastScale &&
      Quantile(ways_m, 0.5) * std::abs(relative - 1) > kLeastWay_m &&
      std::abs(best->scale - given.scale) > kSigmas * best->scale_sigma &&
      best->off.way_m < kScaleGain * ComputePoseOffsets(pairs, given.scale).way_m;
  best->form.scale = is_scaled ? Rounded(best->scale, best->scale_sigma) : given.scale;
  best->off = ComputePoseOffsets(pairs, best->form.scale);
}

// Of all readings at all offsets the best, where enough of `most` steps have poses, and which it
// is.
std::optional<std::pair<Tried, size_t>> FindBest(const std::vector<Reading>& readings,
                                                 const std::vector<int64_t>& offsets_ns, int most,
                                                 double given_scale) {
  constexpr double kClearlyBetter = 0.9;  // than a plainer one
  std::optional<std::pair<Tried, size_t>> best;
  for (size_t i = 0; i < readings.size(); ++i) {
    std::optional<Tried> of_reading;
    for (const int64_t offset_ns : offsets_ns) {
      const Tried tried = Try(readings[i], offset_ns, given_scale);
      if (3 * tried.off.steps < 2 * most) continue;
      if (!of_reading || tried.off.cost < of_reading->off.cost) of_reading = tried;
    }
    if (!of_reading) continue;
    RefineOffset(readings[i], &*of_reading);
    spdlog::debug(
        "poses read as {} {}: {:.2f} degrees, {:.3f} m off, cost {:.2f}, offset {:.3f} s, "
        "scale {:.4f}",
        readings[i].form.of, readings[i].form.quaternion,
        kDegreesPerRadian * of_reading->off.turn_rad, of_reading->off.way_m, of_reading->off.cost,
        ToSeconds(of_reading->offset_ns), of_reading->scale);
    if (best && of_reading->off.cost > kClearlyBetter * best->first.off.cost) continue;
    best = {*of_reading, i};
  }
  return best;
}

bool AreTurnedAlike(const PoseTable& table) {
  return std::ranges::all_of(table.rows, [&](const PoseRow& row) {
    return row.quaternion == table.rows.front().quaternion;
  });
}

void SetMoved(const std::vector<BodyStep>& steps, PoseReading* result) {
  std::vector<double> turns_rad, ways_m;
  for (const BodyStep& step : steps) {
    turns_rad.push_back(LogRotation(step.T_from_to.rotation).norm());
    ways_m.push_back(step.T_from_to.translation.norm());
  }
  result->moved_rad = Quantile(turns_rad, 0.5);
  result->moved_m = Quantile(ways_m, 0.5);
}

// Of many offsets those at which the rig turned and went as much as the poses do, whatever they are
// of: a walk straight on hardly turns.
std::vector<int64_t> LikelyByMotion(const std::vector<int64_t>& offsets_ns,
                                    const std::vector<Reading>& readings, int most) {
  constexpr size_t kMost = 100;
  if (offsets_ns.size() <= kMost) return offsets_ns;
  std::vector<std::pair<double, int64_t>> costs;
  for (const Reading* reading : {&readings.front(), &readings.back()}) {  // of either order
    for (const int64_t offset_ns : offsets_ns) {
      double sum = 0;
      const std::vector<StepPair> pairs = PairsAt(reading->poses, reading->steps, offset_ns);
      if (3 * std::ssize(pairs) < 2 * most) continue;
      double scale_sigma = 0;
      const double scale = EstimateScale(pairs, &scale_sigma);
      for (const StepPair& pair : pairs) {
        const double apart_rad = LogRotation(pair.known.T_from_to.rotation).norm() -
                                 LogRotation(pair.posed.rotation).norm();
        const double apart_m =
            pair.known.T_from_to.translation.norm() - scale * pair.posed.translation.norm();
        // Apart: of poses that are read in a wrong way, turns tell the clock all the same.
        sum += std::min(kMostStepSigmas, std::abs(apart_rad) / kTurnSigma_rad) +
               std::min(kMostStepSigmas, std::abs(apart_m) / kWaySigma_m);
      }
      costs.emplace_back(sum / static_cast<double>(pairs.size()), offset_ns);
    }
  }
  std::ranges::sort(costs);
  std::vector<int64_t> likely;
  for (size_t i = 0; i < std::min(kMost, costs.size()); ++i) likely.push_back(costs[i].second);
  return likely;
}

// The best reading near the given offset or, where none explains the poses there, at any. Nothing
// where too few steps have poses.
std::optional<std::pair<Tried, size_t>> Search(const std::vector<Reading>& readings,
                                               const PoseForm& given, PoseReading* result) {
  const int64_t given_ns = std::llround(given.offset_s * 1e9);
  result->given =
      ComputePoseOffsets(PairsAt(readings[0].poses, readings[0].steps, given_ns), given.scale);
  std::optional<std::pair<Tried, size_t>> best;
  for (const bool is_far : {false, true}) {
    const std::vector<int64_t> offsets_ns =
        OffsetsToTry(readings[0].poses, readings[0].steps, given_ns, is_far);
    int most = 0;
    for (const int64_t offset_ns : offsets_ns) {
      most = std::max(most, Covered(readings[0].poses, readings[0].steps, offset_ns));
    }
    if (most < kLeastSteps) return std::nullopt;
    result->is_judged = true;
    const auto found =
        FindBest(readings, LikelyByMotion(offsets_ns, readings, most), most, given.scale);
    if (!found) return std::nullopt;
    const bool explains = Explains(found->first.off, *result);
    if (!is_far || explains) best = found;
    if (explains) break;
  }
  // Of readings that both fit the figures say little: the given one stands.
  if (best->second != 0 && Explains(result->given, *result) &&
      best->first.off.cost > kMuchBetter * result->given.cost) {
    best = {Try(readings[0], given_ns, given.scale), 0};
    RefineOffset(readings[0], &best->first);
  }
  return best;
}

// Of IMU and camera, otherwise as given.
std::vector<Reading> ReadingsToTurn(std::vector<Reading> readings, const PoseForm& given) {
  std::erase_if(readings, [&](const Reading& reading) {
    return reading.form.quaternion != given.quaternion ||
           reading.form.IsInverse() != given.IsInverse();
  });
  return readings;
}

// Of poses that a reading explains.
void ReportForm(const std::string& words, const std::string& who, PoseReading* result) {
  result->agrees = words.empty();
  if (result->agrees) return;
  result->words = fmt::format("{} (by {} {}", words, result->best.steps, who);
  if (result->given.steps >= kLeastSteps) {
    result->words += fmt::format(
        ": in the median the rig turns by {:.1f} degrees and moves {:.2f} m, of which the poses "
        "are off by {:.1f} degrees and {:.3f} m, then by {:.1f} degrees and {:.3f} m",
        kDegreesPerRadian * result->moved_rad, result->moved_m,
        kDegreesPerRadian * result->given.turn_rad, result->given.way_m,
        kDegreesPerRadian * result->best.turn_rad, result->best.way_m);
  }
  result->words += ")";
  if (!result->change.empty()) result->words += "; besides, " + result->change;
}

// Of poses that none explains.
void ReportUnexplained(const std::string& cause, bool is_known, const std::string& who,
                       PoseReading* result) {
  constexpr double kWrong_rad = 0.05, kWrong = 0.4, kWrong_m = 0.1, kWrongWay = 0.6;
  const PoseOff& off = result->given;
  const bool is_wrong = is_known || off.steps < kLeastSteps ||
                        (off.turn_rad > kWrong_rad && off.turn_rad > kWrong * result->moved_rad) ||
                        (off.way_m > kWrong_m && off.way_m > kWrongWay * result->moved_m);
  result->agrees = !is_wrong;
  if (!is_wrong) return;
  result->words = fmt::format(
      "{} (by {} {}: in the median the rig turns by {:.1f} degrees and moves {:.2f} m, of which "
      "the poses are off by {:.1f} degrees and {:.2f} m)",
      cause, off.steps, who, kDegreesPerRadian * result->moved_rad, result->moved_m,
      kDegreesPerRadian * off.turn_rad, off.way_m);
}

}  // namespace

PoseReading ClassifyReading(const PoseTable& table, const PoseForm& given,
                            const std::vector<BodyStep>& steps,
                            const std::optional<RigidTransform>& T_imu_camera,
                            const std::string& who) {
  constexpr double kFits = 1;  // in standard deviations
  PoseReading result;
  result.form = given;
  if (std::ssize(steps) < kLeastSteps) return result;
  SetMoved(steps, &result);
  const std::vector<Reading> readings = ListReadings(table, given, steps, T_imu_camera);
  const auto found = Search(readings, given, &result);
  if (!found) return result;
  auto [best, of_best] = *found;
  Settle(given, readings[of_best], &best);
  result.best = best.off;
  result.form = best.form;
  result.is_explained = Explains(result.best, result);
  std::string of_axes;
  if (!result.is_explained || result.best.cost > kFits) {
    of_axes = WordsOfOtherAxes(ReadingsToTurn(readings, given), given, result.best);
  }
  if (result.is_explained && of_axes.empty()) {
    const Reading& reading = readings[of_best];
    result.change =
        WordsOfChange(PairsAt(reading.poses, reading.steps, best.offset_ns), best.form.scale, who);
    ReportForm(DescribeReading(given, result.form, table.is_scalar_first, T_imu_camera), who,
               &result);
    return result;
  }
  result.is_explained = false;
  result.form = given;
  const std::string cause = !of_axes.empty()        ? of_axes
                            : AreTurnedAlike(table) ? "their rotations are all the same: positions "
                                                      "alone"
                                                    : "they fit by no reading that is known";
  ReportUnexplained(cause, !of_axes.empty(), who, &result);
  return result;
}

}  // namespace slcmap::mapping
