#include "data/calibration/imu_calibration.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/LU>
#include <Eigen/SVD>

namespace slcmap::inline data {
namespace {

constexpr double kMinGain = 0.5, kMaxGain = 2;  // of an IMU that is calibrated at all

// A matrix of rows; `otherwise` where the key is absent.
Eigen::MatrixXd ReadMatrixRows(YamlSection* section, const char* key,
                               const Eigen::MatrixXd& otherwise) {
  std::vector<std::vector<double>> rows;
  section->Read(key, &rows);
  if (!section->Has(key)) return otherwise;
  Eigen::MatrixXd matrix(otherwise.rows(), otherwise.cols());
  bool fits = static_cast<Eigen::Index>(rows.size()) == matrix.rows();
  for (size_t r = 0; fits && r < rows.size(); ++r) {
    fits = static_cast<Eigen::Index>(rows[r].size()) == matrix.cols();
    for (size_t c = 0; fits && c < rows[r].size(); ++c) matrix(r, c) = rows[r][c];
  }
  if (fits) return matrix;
  throw CalibrationFault(*section, key,
                         fmt::format("found {} rows, expected {} rows of {}", rows.size(),
                                     matrix.rows(), matrix.cols()),
                         fmt::format("write {} rows of {} numbers as {}", matrix.rows(),
                                     matrix.cols(), KeyInFile(section->place(), key)));
}

Eigen::Matrix3d ReadMatrix(YamlSection* section, const char* key) {
  return ReadMatrixRows(section, key, Eigen::Matrix3d::Identity());
}

// What scale and axes make of a true value.
Eigen::Matrix3d ReadGain(YamlSection* section, const char* key) {
  const Eigen::Matrix3d gain = ReadMatrix(section, key);
  const Eigen::Vector3d gains = Eigen::JacobiSVD<Eigen::Matrix3d>(gain).singularValues();
  if (gains[0] <= kMaxGain && gains[2] >= kMinGain && gain.determinant() > 0) return gain;
  throw CalibrationFault(
      *section, key,
      fmt::format("found a matrix that scales by {:.3g} to {:.3g}{}, expected one near the "
                  "identity",
                  gains[2], gains[0], gain.determinant() < 0 ? " and mirrors" : ""),
      fmt::format("copy {} from the calibration anew, row by row; bring readings to m/s^2 and "
                  "rad/s first",
                  KeyInFile(section->place(), key)));
}

Eigen::Matrix3d ReadTurn(YamlSection* section, const char* key) {
  constexpr double kMaxError = 1e-3;
  const Eigen::Matrix3d turn = ReadMatrix(section, key);
  const double error = (turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error <= kMaxError && turn.determinant() > 0) return turn;
  throw CalibrationFault(*section, key,
                         fmt::format("found a matrix that is not a rotation, by {:.2g}", error),
                         fmt::format("copy {} from the calibration anew, row by row",
                                     KeyInFile(section->place(), key)));
}

// A gyroscope that feels forces.
void RefuseForces(YamlSection* section, const char* key) {
  const Eigen::Matrix3d felt = ReadMatrixRows(section, key, Eigen::Matrix3d::Zero());
  if (felt.isZero(0)) return;
  const double most_rad_s =
      kGravity_m_s2 * Eigen::JacobiSVD<Eigen::Matrix3d>(felt).singularValues()[0];
  throw CalibrationFault(
      *section, key,
      fmt::format("found a gyroscope that feels forces, by up to {:.2g} rad/s under gravity, "
                  "expected zeros: this is not modelled",
                  most_rad_s),
      fmt::format("write zeros as {}: then the gyroscope's bias has to follow it as the rig tilts",
                  KeyInFile(section->place(), key)));
}

void RefuseLeverArms(YamlSection* section) {
  for (const char* key : {"rx_i", "ry_i", "rz_i"}) {
    std::vector<double> lever_m;
    section->Read(key, &lever_m);
    for (const double x_m : lever_m) {
      if (x_m == 0) continue;
      throw CalibrationFault(
          *section, key,
          fmt::format("found an axis of the accelerometer that is {} m off, expected zeros: this "
                      "is not modelled",
                      fmt::join(lever_m, ", ")),
          fmt::format("calibrate with Kalibr's model scale-misalignment, or write zeros as {}",
                      KeyInFile(section->place(), key)));
    }
  }
}

// What an IMU reads is its gain times what an ideal one would read.
ImuCorrection FromGains(const Eigen::Matrix3d& accel, const Eigen::Matrix3d& gyro) {
  return {accel.inverse(), gyro.inverse()};
}

ImuCorrection ReadKalibrGains(YamlSection* imu) {
  YamlSection accel = imu->Section("accelerometers"), gyro = imu->Section("gyroscopes");
  const Eigen::Matrix3d accel_gain = ReadGain(&accel, "M");
  const ImuCorrection correction =
      FromGains(accel_gain, ReadGain(&gyro, "M") * ReadTurn(&gyro, "C_gyro_i"));
  RefuseForces(&gyro, "A");
  RefuseLeverArms(&accel);
  accel.Finish();
  gyro.Finish();
  return correction;
}

ImuCorrection ReadOpenVinsGains(YamlSection* imu) {
  const Eigen::Matrix3d accel_gain = ReadGain(imu, "Ta") * ReadTurn(imu, "R_IMUtoACC");
  const ImuCorrection correction =
      FromGains(accel_gain, ReadGain(imu, "Tw") * ReadTurn(imu, "R_IMUtoGYRO"));
  RefuseForces(imu, "Tg");
  return correction;
}

// Kalibr writes these with each of its models but `calibrated`.
void RequireWhatModelSays(YamlSection* imu) {
  std::string model;
  imu->Read("model", &model);
  if (model.rfind("scale-misalignment", 0) != 0) return;
  for (const char* key : {"accelerometers", "gyroscopes"}) {
    if (imu->Has(key) && imu->Section(key).Has("M")) continue;
    throw CalibrationFault(*imu, key, fmt::format("found no M, expected it as model is {}", model),
                           fmt::format("add {}, or write calibrated as {}",
                                       KeyInFile(imu->place(), key + std::string(".M")),
                                       KeyInFile(imu->place(), "model")));
  }
}

std::string KalibrRows(const Eigen::Matrix3d& m) {
  std::string text;
  for (int r = 0; r < 3; ++r) {
    text += fmt::format("    - [{}, {}, {}]\n", m(r, 0), m(r, 1), m(r, 2));
  }
  return text;
}

}  // namespace

ImuCorrection ReadImuCorrection(YamlSection* imu) {
  RequireWhatModelSays(imu);
  const ImuCorrection kalibr = ReadKalibrGains(imu), open_vins = ReadOpenVinsGains(imu);
  if (!IsIdentity(kalibr) && !IsIdentity(open_vins)) {
    throw CalibrationFault(*imu, "Ta",
                           "found beside Kalibr's accelerometers and gyroscopes, "
                           "expected one of the forms",
                           "leave either accelerometers and gyroscopes or Ta, Tw, R_IMUtoACC and "
                           "R_IMUtoGYRO in " +
                               imu->place());
  }
  return IsIdentity(kalibr) ? open_vins : kalibr;
}

bool IsIdentity(const ImuCorrection& correction) {
  return correction.accel.isIdentity(0) && correction.gyro.isIdentity(0);
}

std::string KalibrImuCorrection(const ImuCorrection& correction) {
  if (IsIdentity(correction)) return "";
  return "  model: scale-misalignment\n  accelerometers:\n    M:\n" +
         KalibrRows(correction.accel.inverse()) + "  gyroscopes:\n    M:\n" +
         KalibrRows(correction.gyro.inverse()) + "    C_gyro_i:\n" +
         KalibrRows(Eigen::Matrix3d::Identity()) + "    A:\n" + KalibrRows(Eigen::Matrix3d::Zero());
}

void Correct(const ImuCorrection& correction, std::vector<ImuSample>* samples) {
  if (IsIdentity(correction)) return;
  for (ImuSample& sample : *samples) {
    sample.angular_velocity_rad_s = correction.gyro * sample.angular_velocity_rad_s;
    sample.specific_force_m_s2 = correction.accel * sample.specific_force_m_s2;
  }
}

}  // namespace slcmap::data
