#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "data/core/error.h"
#include "data/simulator/motion.h"

namespace slcmap::inline data {
namespace {

constexpr double kKnot_s = 0.025;    // short enough for the vibration of a drive
constexpr double kTurnBack_s = 3.0;  // for facing the start again
constexpr double kTwoPi = 2 * std::numbers::pi;

// A polyline whose corners are rounded by averaging along it.
class RoundedPath {
 public:
  RoundedPath(const std::vector<Eigen::Vector3d>& waypoints, double corner_m)
      : waypoints_(waypoints), corner_m_(corner_m) {
    along_m_.push_back(0);
    for (size_t i = 1; i < waypoints.size(); ++i) {
      along_m_.push_back(along_m_.back() + (waypoints[i] - waypoints[i - 1]).norm());
    }
  }

  double length_m() const { return along_m_.back(); }

  // The position at a distance along the path, which goes straight on beyond its ends, so that it
  // starts and ends exactly at a waypoint.
  Eigen::Vector3d At(double distance_m) const {
    constexpr int kHalfSamples = 16;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    for (int i = -kHalfSamples; i <= kHalfSamples; ++i) {
      const double u = static_cast<double>(i) / kHalfSamples;
      const double weight = (1 - u * u) * (1 - u * u);
      sum += weight * OnPolyline(distance_m + u * corner_m_);
      weights += weight;
    }
    return sum / weights;
  }

  // The direction of the path, of length one.
  Eigen::Vector3d Direction(double distance_m) const {
    return (At(distance_m + 0.25) - At(distance_m - 0.25)).normalized();
  }

 private:
  Eigen::Vector3d OnPolyline(double distance_m) const {
    const auto after = std::upper_bound(along_m_.begin() + 1, along_m_.end() - 1, distance_m);
    const auto i = static_cast<size_t>(after - along_m_.begin());
    const double u = (distance_m - along_m_[i - 1]) / (along_m_[i] - along_m_[i - 1]);
    return (1 - u) * waypoints_[i - 1] + u * waypoints_[i];
  }

  std::vector<Eigen::Vector3d> waypoints_;
  std::vector<double> along_m_;  // of each waypoint
  double corner_m_;
};

// A smooth random function of time of unit RMS: sinusoids of random frequency and phase.
class SmoothNoise {
 public:
  SmoothNoise(uint64_t seed, double lowest_hz, double highest_hz) {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> frequency_hz(lowest_hz, highest_hz), phase(0, kTwoPi);
    for (Wave& wave : waves_) {
      wave.omega_rad_s = kTwoPi * frequency_hz(generator);
      wave.phase_rad = phase(generator);
    }
  }

  double At(double t_s) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.omega_rad_s * t_s + wave.phase_rad);
    return sum * std::sqrt(2.0 / static_cast<double>(std::size(waves_)));
  }

 private:
  struct Wave {
    double omega_rad_s, phase_rad;
  };
  Wave waves_[8];
};

// A deviation from the way: in the camera's heading frame (x right, y down, z ahead), as rotation
// vector and as shift.
struct Deviation {
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
};

// Independent smooth noise for the six coordinates of a deviation.
class Noise6 {
 public:
  Noise6(uint64_t seed, double lowest_hz, double highest_hz) {
    for (uint64_t k = 0; k < 6; ++k) noises_.emplace_back(seed * 64 + k, lowest_hz, highest_hz);
  }
  Deviation At(double t_s, double rotation_rad, double shift_m) const {
    Deviation d;
    for (int k = 0; k < 3; ++k) {
      d.rotation_rad[k] = rotation_rad * noises_[k].At(t_s);
      d.shift_m[k] = shift_m * noises_[3 + k].At(t_s);
    }
    return d;
  }

 private:
  std::vector<SmoothNoise> noises_;
};

// Where the motion is along its path at a time, and which share of its full speed it has.
struct PathPlace {
  double distance_m;
  double speed_share;
};

class MotionMaker {
 public:
  MotionMaker(const MadeMotionOptions& options, const Rig& rig)
      : options_(options),
        rig_(rig),
        path_(options.waypoints_m, options.corner_m),
        slow_(options.seed * 2, 0.15, 0.8),
        fast_(options.seed * 2 + 1, 1.0, 3.5),
        drive_(options.seed * 2 + 1, 8.0, 13.0) {
    // A short way is covered at less than the full speed.
    speed_m_s_ = std::min(options.speed_m_s, path_.length_m() / options.ease_s);
    moving_s_ = path_.length_m() / speed_m_s_ + options.ease_s;
  }

  MotionSpline Make(const Progress& progress) const {
    const double turn_s = FacesStart() ? kTurnBack_s : 0;
    const double duration_s = moving_s_ + turn_s + 2 * options_.stand_still_s;
    if (duration_s > kMaxMotion_s) {
      throw ConfigError(
          fmt::format("trajectory: found a way of {:.0f} m that lasts {:.0f} s at {} m/s, expected "
                      "at most {} s",
                      path_.length_m(), duration_s, speed_m_s_, kMaxMotion_s));
    }
    const int segments = static_cast<int>(std::ceil(duration_s / kKnot_s));
    std::vector<RigidTransform> control;
    for (int j = 0; j < segments + MotionSpline::kOrder - 1; ++j) {
      if (j % 64 == 0) progress.ReportOrStop(std::min(1.0, 1.0 * j / segments));
      control.push_back(PoseAt((j - 2) * kKnot_s));
    }
    return MotionSpline(kKnot_s, control);
  }

 private:
  bool FacesStart() const {
    const double gap_m = (options_.waypoints_m.front() - options_.waypoints_m.back()).norm();
    return options_.face_start && gap_m < 0.01;
  }

  PathPlace PlaceAt(double t_s) const {
    const double since_s = t_s - options_.stand_still_s, ease_s = options_.ease_s;
    const double eased_s =
        EasedTime(since_s, ease_s) - EasedTime(since_s - moving_s_ + ease_s, ease_s);
    const double step_s = 1e-3;
    const double later_s = EasedTime(since_s + step_s, ease_s) -
                           EasedTime(since_s + step_s - moving_s_ + ease_s, ease_s);
    return {speed_m_s_ * eased_s, (later_s - eased_s) / step_s};
  }

  // The heading, smoothed over time so that even a turn on the spot takes its time.
  Eigen::Quaterniond HeadingAt(double t_s) const {
    Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
    for (int i = -8; i <= 8; ++i) {
      const double weight = 1 - i * i / 81.0;
      ahead += weight * path_.Direction(PlaceAt(t_s + 0.05 * i).distance_m);
    }
    // On stairs, eyes and cameras follow the slope by half.
    ahead.z() *= options_.kind == MotionKind::kRobot ? 0.0 : 0.5;
    const Eigen::Quaterniond heading = CameraLookingAlong(ahead);
    const double turn_s = t_s - options_.stand_still_s - moving_s_;
    if (!FacesStart() || turn_s <= 0) return heading;
    const double u = std::min(1.0, turn_s / kTurnBack_s);
    return heading.slerp(u * u * u * (10 - 15 * u + 6 * u * u), HeadingAt(0));
  }

  RigidTransform PoseAt(double t_s) const {
    const PathPlace place = PlaceAt(t_s);
    Deviation d = DeviationAt(t_s, place);
    const Eigen::Quaterniond heading = HeadingAt(t_s);
    const RigidTransform T_world_camera(
        heading * ExpRotation(options_.shake * d.rotation_rad + Lean(t_s, heading)),
        path_.At(place.distance_m) + heading * (options_.shake * d.shift_m));
    return T_world_camera * rig_.T_imu_camera[0].Inverse();
  }

  Deviation DeviationAt(double t_s, const PathPlace& place) const {
    switch (options_.kind) {
      case MotionKind::kWalk:
        return StepDeviation(t_s, place);
      case MotionKind::kRobot:
        return drive_.At(t_s, 2e-4 * place.speed_share, 1e-4 * place.speed_share);
      case MotionKind::kFlight:
        return slow_.At(t_s, 0.02 * place.speed_share, 0.03 * place.speed_share);
    }
    return {};
  }

  // Steps lift the body twice a double step and sway it once; a hand is never quite still.
  Deviation StepDeviation(double t_s, const PathPlace& place) const {
    const double step_rad = kTwoPi * place.distance_m / 0.68;
    const double share = place.speed_share;
    Deviation d = fast_.At(t_s, 0.008 * (share + 0.03), 0.003 * (share + 0.03));
    const Deviation slow = slow_.At(t_s, 0.03 * share, 0.01 * share);
    d.rotation_rad += slow.rotation_rad;
    d.shift_m += slow.shift_m;
    d.shift_m.y() += share * 0.020 * std::cos(step_rad);
    d.shift_m.x() += share * 0.018 * std::sin(step_rad / 2);
    d.rotation_rad.x() += share * 0.010 * std::sin(step_rad + 0.4);
    d.rotation_rad.z() += share * 0.012 * std::sin(step_rad / 2 + 0.7);
    return d;
  }

  // A multicopter's thrust points along its acceleration against gravity; its rig leans with it.
  Eigen::Vector3d Lean(double t_s, const Eigen::Quaterniond& heading) const {
    if (options_.kind != MotionKind::kFlight) return Eigen::Vector3d::Zero();
    constexpr double kStep_s = 0.1;
    const auto position = [&](double at_s) { return path_.At(PlaceAt(at_s).distance_m); };
    const Eigen::Vector3d acceleration_world =
        (position(t_s + kStep_s) - 2 * position(t_s) + position(t_s - kStep_s)) /
        (kStep_s * kStep_s);
    const Eigen::Vector3d a = heading.conjugate() * acceleration_world;
    return {-std::atan2(a.z(), kGravity_m_s2), 0, std::atan2(a.x(), kGravity_m_s2)};
  }

  const MadeMotionOptions& options_;
  const Rig& rig_;
  RoundedPath path_;
  Noise6 slow_, fast_, drive_;
  double speed_m_s_ = 0, moving_s_ = 0;
};

MotionKind KindFromName(const std::string& name, const std::string& place) {
  if (name == "walk") return MotionKind::kWalk;
  if (name == "robot") return MotionKind::kRobot;
  if (name == "flight") return MotionKind::kFlight;
  throw ConfigError(place + ".kind: found '" + name + "', expected walk, robot or flight");
}

}  // namespace

double EasedTime(double t_s, double ease_s) {
  if (t_s <= 0) return 0;
  // The integral of the smooth step 10 u^3 - 15 u^4 + 6 u^5.
  const double u = std::min(1.0, t_s / ease_s);
  return ease_s * u * u * u * u * (2.5 - 3 * u + u * u) + std::max(0.0, t_s - ease_s);
}

void MadeMotionOptions::Check(const std::string& place) const {
  const auto expect = [&](bool holds, const char* key, const char* expected) {
    if (!holds) throw ConfigError(place + "." + key + ": expected " + expected);
  };
  expect(waypoints_m.size() >= 2, "waypoints_m", "two waypoints or more");
  for (size_t i = 1; i < waypoints_m.size(); ++i) {
    expect((waypoints_m[i] - waypoints_m[i - 1]).norm() > 0.05, "waypoints_m",
           "neighbours more than 0.05 m apart");
  }
  for (size_t i = 2; i < waypoints_m.size(); ++i) {
    const Eigen::Vector3d before = (waypoints_m[i - 1] - waypoints_m[i - 2]).normalized();
    const Eigen::Vector3d after = (waypoints_m[i] - waypoints_m[i - 1]).normalized();
    expect(before.dot(after) > -0.94, "waypoints_m", "no turn of more than 160 degrees");
  }
  const auto expect_range = [&](const char* key, double value, double low, double high) {
    if (value >= low && value <= high) return;
    throw ConfigError(
        fmt::format("{}.{}: found {}, expected {} to {}", place, key, value, low, high));
  };
  for (const Eigen::Vector3d& p : waypoints_m) {
    for (const double coordinate_m : p) expect_range("waypoints_m", coordinate_m, -1000, 1000);
  }
  expect_range("speed_m_s", speed_m_s, 0.01, 20);
  expect_range("corner_m", corner_m, 0.01, 100);
  expect_range("stand_still_s", stand_still_s, 0, 3600);
  expect_range("ease_s", ease_s, 0.01, 100);
  expect_range("shake", shake, 0, 10);
}

void MadeMotionOptions::Read(YamlSection section) {
  std::string kind_name = "walk";
  std::vector<std::vector<double>> points;
  int seed_number = static_cast<int>(seed);
  section.Read("kind", &kind_name);
  section.Read("waypoints_m", &points);
  section.Read("speed_m_s", &speed_m_s);
  section.Read("corner_m", &corner_m);
  section.Read("stand_still_s", &stand_still_s);
  section.Read("ease_s", &ease_s);
  section.Read("shake", &shake);
  section.Read("face_start", &face_start);
  section.Read("seed", &seed_number);
  section.Finish();
  if (seed_number < 0) {
    throw ConfigError(
        fmt::format("{}.seed: found {}, expected zero or more", section.place(), seed_number));
  }
  kind = KindFromName(kind_name, section.place());
  seed = static_cast<uint64_t>(seed_number);
  waypoints_m.clear();
  for (const std::vector<double>& p : points) {
    if (p.size() != 3) {
      throw ConfigError(section.place() + ".waypoints_m: found a point of " +
                        std::to_string(p.size()) + " coordinates, expected 3");
    }
    waypoints_m.emplace_back(p[0], p[1], p[2]);
  }
  Check(section.place());
}

MotionSpline MakeMotion(const MadeMotionOptions& options, const Rig& rig,
                        const Progress& progress) {
  options.Check();
  return MotionMaker(options, rig).Make(progress);
}

}  // namespace slcmap::data
