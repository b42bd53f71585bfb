// Units of the IMU, by gravity and by the agreement of gyroscope and accelerometer.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "data/angle_unit.h"
#include "data/check/check.h"
#include "data/imu_limits.h"

namespace slcmap {
namespace {

constexpr double kMean_s = 0.25;        // accelerometer readings averaged for a direction
constexpr double kBetween_s = 1.0;      // between two directions that are compared
constexpr double kMinGyro_deg = 5;      // error that makes the unit doubtful
constexpr double kMaxStuckShare = 0.5;  // of samples equal to the one before
constexpr double kMaxAbsurdShare = 0.1;
constexpr double kMaxHeld_s = 1;           // of one axis at one value, while the others change
constexpr double kMaxUsualTurn_rad_s = 2;  // median; a gyroscope in deg/s is above

// The mean specific force over kMean_s from sample `first`, and the next sample after it.
struct Direction {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  size_t centre = 0;
  size_t end = 0;
};

Direction MeanForce(const std::vector<ImuSample>& samples, size_t first) {
  Direction direction;
  size_t i = first;
  for (; i < samples.size() && ToSeconds(samples[i].stamp_ns - samples[first].stamp_ns) <= kMean_s;
       ++i) {
    direction.mean += samples[i].specific_force_m_s2;
  }
  direction.mean /= static_cast<double>(i - first);
  direction.centre = (first + i) / 2;
  direction.end = i;
  return direction;
}

// The median angle between gravity as measured and as turned there by the gyroscope, whose values
// are in units of `unit_rad_s`.
double GravityDrift_rad(const std::vector<ImuSample>& samples, double unit_rad_s) {
  std::vector<double> angles_rad;
  size_t first = 0;
  while (first < samples.size()) {
    const Direction before = MeanForce(samples, first);
    size_t second = before.end;
    while (second < samples.size() &&
           ToSeconds(samples[second].stamp_ns - samples[first].stamp_ns) < kBetween_s) {
      ++second;
    }
    if (second >= samples.size()) break;
    const Direction after = MeanForce(samples, second);
    Eigen::Quaterniond R_before_after = Eigen::Quaterniond::Identity();
    for (size_t i = before.centre; i < after.centre && i + 1 < samples.size(); ++i) {
      const double step_s = ToSeconds(samples[i + 1].stamp_ns - samples[i].stamp_ns);
      R_before_after =
          R_before_after * ExpRotation(samples[i].angular_velocity_rad_s * (unit_rad_s * step_s));
    }
    const Eigen::Vector3d turned = R_before_after * after.mean;
    angles_rad.push_back(std::atan2(before.mean.cross(turned).norm(), before.mean.dot(turned)));
    first = second;
  }
  return Median(angles_rad);
}

void CheckGravity(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::vector<double> norms;
  for (const ImuSample& sample : samples) norms.push_back(sample.specific_force_m_s2.norm());
  const double median_m_s2 = Median(norms);
  report->AddFigure("median size of the specific force", median_m_s2, "m/s^2");
  const std::string found =
      fmt::format("a median specific force of {:.3g}, expected about 9.81 m/s^2", median_m_s2);
  if (median_m_s2 > 0.8 && median_m_s2 < 1.25) {
    report->Fail("imu-units", found, "the accelerometer seems to be in g: multiply by 9.80665");
  } else if (median_m_s2 > 800 && median_m_s2 < 1250) {
    report->Fail("imu-units", found,
                 "the accelerometer seems to be in mg or cm/s^2: bring it to m/s^2");
  } else if (median_m_s2 < 0.8) {
    report->Fail("imu-gravity", found, "gravity seems to be removed: record the raw accelerometer");
  } else if (median_m_s2 < 7.5 || median_m_s2 > 13) {
    report->Fail("imu-gravity", found, "check the accelerometer's unit and scale");
  } else if (median_m_s2 < 9.3 || median_m_s2 > 10.4) {
    report->Warn("imu-gravity", found, "calibrate the accelerometer's scale and bias");
  }
}

void CheckGyroUnit(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::vector<double> rates;
  for (const ImuSample& sample : samples) rates.push_back(sample.angular_velocity_rad_s.norm());
  report->AddFigure("median turn rate", Median(rates), "rad/s");
  const double as_rad = GravityDrift_rad(samples, 1), as_deg = GravityDrift_rad(samples, kDegree);
  report->AddFigure("gyroscope against gravity, over 1 s", as_rad / kDegree, "deg");
  if (as_rad > kMinGyro_deg * kDegree && as_deg < 0.5 * as_rad &&
      Median(rates) > kMaxUsualTurn_rad_s) {
    report->Fail("imu-units",
                 fmt::format("gravity is off by {:.0f} deg each second if the gyroscope is in "
                             "rad/s, by {:.1f} if in deg/s",
                             as_rad / kDegree, as_deg / kDegree),
                 "the gyroscope seems to be in deg/s: multiply by pi / 180");
  }
}

void CheckStuck(const std::vector<ImuSample>& samples, CheckReport* report) {
  int64_t equal = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    equal += samples[i].angular_velocity_rad_s == samples[i - 1].angular_velocity_rad_s &&
             samples[i].specific_force_m_s2 == samples[i - 1].specific_force_m_s2;
  }
  const double share = static_cast<double>(equal) / static_cast<double>(samples.size());
  if (share < kMaxStuckShare) return;
  report->Warn("imu-stuck",
               fmt::format("{:.0f} % of the samples repeat the one before", 100 * share),
               "check the driver; a slower sensor that is read too often does this");
}

double Reading(const ImuSample& sample, int axis) {
  return axis < 3 ? sample.angular_velocity_rad_s[axis] : sample.specific_force_m_s2[axis - 3];
}

// The longest time that an axis keeps one value, and that value.
struct Held {
  double duration_s = 0;
  double value = 0;
};

constexpr double kHeldStep_s = 0.1;

Held LongestHeld(const std::vector<ImuSample>& samples, int axis) {
  Held longest;
  size_t first = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    // Equal readings on either side of a gap say nothing of what was in between.
    const bool gap = ToSeconds(samples[i].stamp_ns - samples[i - 1].stamp_ns) > kHeldStep_s;
    if (gap || Reading(samples[i], axis) != Reading(samples[first], axis)) first = i;
    const double duration_s = ToSeconds(samples[i].stamp_ns - samples[first].stamp_ns);
    if (duration_s > longest.duration_s) longest = {duration_s, Reading(samples[i], axis)};
  }
  return longest;
}

// Axes that are dead, or freeze for a while. Where all six do, the sensor is stuck as a whole.
void CheckHeldAxes(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::array<Held, 6> held;
  for (int axis = 0; axis < 6; ++axis) held[axis] = LongestHeld(samples, axis);
  const auto too_long = [](const Held& axis) { return axis.duration_s > kMaxHeld_s; };
  if (std::all_of(held.begin(), held.end(), too_long)) return;
  for (const bool gyro : {true, false}) {
    std::string words;
    for (int axis = gyro ? 0 : 3; axis < (gyro ? 3 : 6); ++axis) {
      if (!too_long(held[axis])) continue;
      words += fmt::format("{}{} is {} for {:.1f} s", words.empty() ? "" : ", ", "xyz"[axis % 3],
                           held[axis].value, held[axis].duration_s);
    }
    if (words.empty()) continue;
    const std::string sensor = gyro ? "gyroscope" : "accelerometer";
    report->Fail(gyro ? "gyro-dead" : "accel-dead",
                 fmt::format("the {}'s {}, while the IMU's other axes change", sensor, words),
                 fmt::format("check the {}'s driver and the columns of imu0/data.csv: an axis that "
                             "is dead or frozen is of no use",
                             sensor));
  }
}

// Turn rates of the size of gravity beside forces without it.
void CheckColumns(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::vector<double> rates, forces;
  for (const ImuSample& sample : samples) {
    rates.push_back(sample.angular_velocity_rad_s.norm());
    forces.push_back(sample.specific_force_m_s2.norm());
  }
  const double rate = Median(rates), force = Median(forces);
  if (rate < 9.3 || rate > 10.4 || force > 5) return;
  report->Fail("imu-columns",
               fmt::format("a median turn rate of {:.3g} and a median specific force of {:.3g}, "
                           "expected about 9.81 m/s^2 of the latter",
                           rate, force),
               "the columns of gyroscope and accelerometer seem to be swapped: imu0/data.csv "
               "holds the gyroscope's first");
}

// Values such as a driver delivers that lost its place in the stream.
void CheckValues(const std::vector<ImuSample>& samples, CheckReport* report) {
  const auto absurd = [](const ImuSample& sample) { return !IsPlausible(sample); };
  const auto first = std::find_if(samples.begin(), samples.end(), absurd);
  if (first == samples.end()) return;
  const auto count = std::count_if(first, samples.end(), absurd);
  const std::string found =
      fmt::format("{} of {} samples beyond {} rad/s or {} m/s^2, the first at {:.3f} s", count,
                  samples.size(), kMaxGyro_rad_s, kMaxAccel_m_s2, ToSeconds(first->stamp_ns));
  const std::string remedy = "check the IMU's driver, cable and units; such samples are dropped";
  if (static_cast<double>(count) > kMaxAbsurdShare * static_cast<double>(samples.size())) {
    report->Fail("imu-values", found, remedy);
  } else {
    report->Warn("imu-values", found, remedy);
  }
}

}  // namespace

void CheckImu(const std::vector<ImuSample>& samples, CheckReport* report) {
  CheckStuck(samples, report);
  CheckHeldAxes(samples, report);
  CheckColumns(samples, report);
  if (!report->Usable()) return;  // what follows would take them for something else
  CheckValues(samples, report);
  CheckGravity(samples, report);
  CheckGyroUnit(samples, report);
}

}  // namespace slcmap
