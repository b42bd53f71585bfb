#include "data/simulator/rigs.h"

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "data/angle_unit.h"
#include "data/calibration.h"
#include "data/error.h"

namespace slcmap {
namespace {

class Normal {
 public:
  explicit Normal(uint64_t seed) : generator_(seed) {}
  double Draw(double sigma) { return sigma * normal_(generator_); }
  Eigen::Vector3d Draw3(double sigma) {
    const double x = Draw(sigma), y = Draw(sigma);
    return {x, y, Draw(sigma)};
  }
  RigidTransform DrawTransform(double sigma_rad, double sigma_m) {
    const Eigen::Quaterniond rotation = ExpRotation(Draw3(sigma_rad));
    return {rotation, Draw3(sigma_m)};
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

// What an ideal reading becomes: the first axis is kept, the others are off_rad off the right
// angle.
Eigen::Matrix3d AxesOff(double off_rad, Normal* normal) {
  const double sign = normal->Draw(1) < 0 ? -1 : 1;
  const double towards_rad = std::numbers::pi * normal->Draw(1);
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  axes.row(1) << sign * std::sin(off_rad), std::cos(off_rad), 0;
  axes.row(2) << std::sin(off_rad) * std::cos(towards_rad),
      std::sin(off_rad) * std::sin(towards_rad), std::cos(off_rad);
  return axes;
}

// The folder config/ beside an installed program, or that of the sources.
std::string ConfigFolder() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share/slcmap/config";
  return fs::is_directory(installed, error) ? installed.string() : SLCMAP_CONFIG_FOLDER;
}

}  // namespace

Rig ReadSimulatedRig(const std::string& name_or_path) {
  const std::string named = ConfigFolder() + "/rigs/" + name_or_path + ".yaml";
  std::error_code error;
  const std::string path = std::filesystem::exists(named, error) ? named : name_or_path;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw ConfigError("rig: found '" + name_or_path + "', expected euroc, tumvi or a file");
  }
  Warnings warnings;
  return ReadKalibrCalibration(path, path, &warnings).rig;
}

ImuModel ImuModelFromName(const std::string& name) {
  if (name == "adis16448") return {{1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3, 200}, 0.02, 0.05};
  if (name == "bmi160") return {{1.6e-4, 2.2e-5, 2.8e-3, 8.6e-4, 200}, 0.01, 0.06};
  if (name == "phone") return {{3.0e-4, 3.0e-5, 4.0e-3, 1.0e-3, 200}, 0.01, 0.10};
  if (name == "perfect") return {{1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3, 200}, 0, 0, false};
  throw ConfigError("imu: found '" + name + "', expected adis16448, bmi160, phone or perfect");
}

ImuCorrection MisreadingImu(double accel_scale, double gyro_scale, double axes_deg, uint64_t seed) {
  Normal normal(seed);
  const double off_rad = axes_deg * kDegree;
  const Eigen::Matrix3d accel = (1 + accel_scale) * AxesOff(off_rad, &normal);
  const Eigen::Quaterniond turn = ExpRotation(off_rad * normal.Draw3(1).normalized());
  const Eigen::Matrix3d gyro =
      (1 + gyro_scale) * AxesOff(off_rad, &normal) * turn.toRotationMatrix();
  return {accel.inverse(), gyro.inverse()};
}

Rig Miscalibrated(const Rig& rig, double scale, uint64_t seed) {
  Normal normal(seed);
  Rig wrong = rig;
  const RigidTransform mounting = normal.DrawTransform(0.3 * kDegree * scale, 0.003 * scale);
  for (int c = 0; c < 2; ++c) {
    const double focal = 1 + normal.Draw(0.003 * scale);
    wrong.cameras[c].fx_px *= focal;
    wrong.cameras[c].fy_px *= focal;
    wrong.cameras[c].cx_px += normal.Draw(1.5 * scale);
    wrong.cameras[c].cy_px += normal.Draw(1.5 * scale);
    wrong.T_imu_camera[c] = mounting * rig.T_imu_camera[c];
  }
  wrong.T_imu_camera[1] =
      wrong.T_imu_camera[1] * normal.DrawTransform(0.05 * kDegree * scale, 0.0003 * scale);
  return wrong;
}

}  // namespace slcmap
