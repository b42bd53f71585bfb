// Calibrated rigs and trajectories.
#include <pybind11/stl/filesystem.h>
#include <spdlog/fmt/fmt.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>

#include "apps/evaluation/trajectory_metrics.h"
#include "apps/python/arrays.h"
#include "data/calibration/calibration.h"
#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/core/rigid_transform.h"
#include "data/io/trajectory.h"

namespace slcmap::inline python {
namespace {

using Matrices = std::vector<Eigen::Matrix4d>;

// n x 4 x 4.
py::array_t<double> ToMatrices(const std::vector<RigidTransform>& transforms) {
  py::array_t<double> array(
      {static_cast<py::ssize_t>(transforms.size()), py::ssize_t{4}, py::ssize_t{4}});
  double* to = array.mutable_data();
  for (const RigidTransform& transform : transforms) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = transform.Matrix();
    to = std::copy(matrix.data(), matrix.data() + 16, to);
  }
  return array;
}

Camera MakeCamera(int width_px, int height_px, const std::vector<double>& intrinsics,
                  const std::string& camera_model, const std::string& distortion_model,
                  const std::vector<double>& coefficients) {
  CameraFault fault;
  std::optional<Camera> camera =
      GetCamera({camera_model, distortion_model, intrinsics, coefficients}, &fault);
  if (!camera) {
    throw ConfigError(
        fmt::format("Camera: {}: found {}, expected {}", fault.key, fault.found, fault.expected));
  }
  camera->width_px = width_px;
  camera->height_px = height_px;
  camera->Check("Camera");
  return *camera;
}

// NaN where a point is not seen, or a pixel has no ray.
template <int To, int From, typename Map>
Eigen::Matrix<double, Eigen::Dynamic, To, Eigen::RowMajor> MapRows(
    const Eigen::Matrix<double, Eigen::Dynamic, From, Eigen::RowMajor>& rows, Map map) {
  Eigen::Matrix<double, Eigen::Dynamic, To, Eigen::RowMajor> mapped(rows.rows(), To);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const auto value = map(Eigen::Matrix<double, From, 1>(rows.row(i).transpose()));
    mapped.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    if (value) mapped.row(i) = value->transpose();
  }
  return mapped;
}

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Pixels = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

void AddCamera(py::module_& module) {
  py::class_<Camera>(module, "Camera", "A calibrated camera: x right, y down, z forward.")
      .def(py::init(&MakeCamera), py::arg("width_px"), py::arg("height_px"), py::arg("intrinsics"),
           py::arg("camera_model") = "pinhole", py::arg("distortion_model") = "none",
           py::arg("coefficients") = std::vector<double>(),
           "Numbers and names as Kalibr has them: intrinsics fx, fy, cx, cy in pixels, behind the "
           "numbers of the lens. Throws ConfigError.")
      .def_readonly("width_px", &Camera::width_px)
      .def_readonly("height_px", &Camera::height_px)
      .def_property_readonly("camera_model",
                             [](const Camera& c) { return DescribeCamera(c).camera_model; })
      .def_property_readonly("distortion_model",
                             [](const Camera& c) { return DescribeCamera(c).distortion_model; })
      .def_property_readonly("intrinsics",
                             [](const Camera& c) { return DescribeCamera(c).intrinsics; })
      .def_property_readonly("coefficients",
                             [](const Camera& c) { return DescribeCamera(c).coefficients; })
      .def_property_readonly(
          "K",
          [](const Camera& c) {
            return (Eigen::Matrix3d() << c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1)
                .finished();
          },
          "3 x 3, in pixels.")
      .def(
          "project",
          [](const Camera& c, const Points& points) {
            return MapRows<2, 3>(points, [&](const Eigen::Vector3d& p) { return c.Project(p); });
          },
          py::arg("points"), "n x 2 pixels of n x 3 points in the camera frame; NaN where none.")
      .def(
          "unproject",
          [](const Camera& c, const Pixels& pixels) {
            return MapRows<3, 2>(pixels, [&](const Eigen::Vector2d& p) { return c.Unproject(p); });
          },
          py::arg("pixels"), "n x 3 unit rays of n x 2 pixels; NaN where none.")
      .def("__repr__", [](const Camera& c) {
        const CameraWords words = DescribeCamera(c);
        return fmt::format("<slcmap.Camera {} x {} px, {} {}, fx {:.1f} px>", c.width_px,
                           c.height_px, words.camera_model, words.distortion_model, c.fx_px);
      });
}

using NoiseMember = std::pair<const char*, double ImuNoise::*>;
constexpr NoiseMember kNoise[] = {{"gyro_noise_rad_s_sqrthz", &ImuNoise::gyro_noise_rad_s_sqrthz},
                                  {"gyro_walk_rad_s2_sqrthz", &ImuNoise::gyro_walk_rad_s2_sqrthz},
                                  {"accel_noise_m_s2_sqrthz", &ImuNoise::accel_noise_m_s2_sqrthz},
                                  {"accel_walk_m_s3_sqrthz", &ImuNoise::accel_walk_m_s3_sqrthz},
                                  {"rate_hz", &ImuNoise::rate_hz}};

// Read as a calibration is, within its ranges.
ImuNoise MakeNoise(const py::dict& numbers) {
  ImuNoise noise;
  YAML::Node node(YAML::NodeType::Map);
  for (const auto& [name, member] : kNoise) node[name] = noise.*member;
  for (const auto& [key, value] : numbers) {
    node[py::str(key).cast<std::string>()] = value.cast<double>();
  }
  YamlSection section(node, "imu_noise");
  ReadNoise(section,
            {kNoise[0].first, kNoise[1].first, kNoise[2].first, kNoise[3].first, kNoise[4].first},
            &noise);
  section.Finish();
  return noise;
}

Rig MakeRig(const std::vector<Camera>& cameras, const Matrices& T_imu_camera,
            double camera_time_offset_s, const py::dict& imu_noise, double right_time_offset_s,
            const std::vector<double>& readout_s) {
  if (cameras.empty() || T_imu_camera.size() != cameras.size()) {
    throw ConfigError(
        fmt::format("Rig: found {} cameras and {} T_imu_camera, expected one or more, and as many",
                    cameras.size(), T_imu_camera.size()));
  }
  if (!readout_s.empty() && readout_s.size() != cameras.size()) {
    throw ConfigError(fmt::format("Rig: found {} values of readout_s, expected one a camera: {}",
                                  readout_s.size(), cameras.size()));
  }
  if (!(std::abs(right_time_offset_s) <= kMaxRightOffset_s)) {
    throw ConfigError(
        fmt::format("Rig: right_time_offset_s: found {} s, expected at most {} s either way",
                    right_time_offset_s, kMaxRightOffset_s));
  }
  Rig rig;
  rig.Resize(cameras.size());
  for (size_t i = 0; i < cameras.size(); ++i) {
    rig.cameras[i] = cameras[i];
    rig.T_imu_camera[i] =
        RigidTransformFromMatrix(T_imu_camera[i], fmt::format("T_imu_camera[{}]", i));
  }
  rig.camera_time_offset_s = camera_time_offset_s;
  rig.imu_noise = MakeNoise(imu_noise);
  rig.right_time_offset_s = right_time_offset_s;
  for (size_t i = 0; i < readout_s.size(); ++i) {
    YAML::Node node(YAML::NodeType::Map);
    node[kReadoutKey] = readout_s[i];
    YamlSection camera(node, fmt::format("Rig: camera {}", i));
    rig.readout_s[i] = ReadReadout(camera);
  }
  CheckRig(rig, "Rig");
  return rig;
}

std::string DescribeRig(const Rig& rig) {
  const Camera& camera = rig.cameras[0];
  const double baseline_m =
      (rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1]).translation.norm();
  return fmt::format("<slcmap.Rig {} of {} x {} px{}, IMU at {:.0f} Hz>",
                     HasTwoCameras(rig) ? fmt::format("{} cameras", CameraCount(rig)) : "1 camera",
                     camera.width_px, camera.height_px,
                     HasTwoCameras(rig) ? fmt::format(", {:.4f} m apart", baseline_m) : "",
                     rig.imu_noise.rate_hz);
}

Rig LoadRig(const std::filesystem::path& path) {
  return WithoutLock([&] {
    Warnings warnings;
    return ReadCalibration(path.string(), &warnings).rig;
  });
}

void AddRigClass(py::module_& module) {
  py::class_<Rig>(module, "Rig",
                  "Cameras, the left one of a pair before the right one, and an IMU.")
      .def(py::init(&MakeRig), py::arg("cameras"), py::arg("T_imu_camera"),
           py::arg("camera_time_offset_s") = 0.0, py::arg("imu_noise") = py::dict(),
           py::arg("right_time_offset_s") = 0.0, py::arg("readout_s") = std::vector<double>{},
           "T_imu_camera: a 4 x 4 matrix a camera. A stamp on the IMU's clock is the camera's plus "
           "the offset. Of cameras that are not triggered together, the right image is taken so "
           "much after the left one; readout_s of a rolling shutter is from the first row to the "
           "last, a camera. Throws ConfigError and DataError.")
      .def_static(
          "load", &LoadRig, py::arg("path"),
          "Of a Kalibr camera chain, or of a folder with sensor.yaml files. Throws DataError.")
      .def(
          "save",
          [](const Rig& rig, const std::filesystem::path& path) {
            WriteKalibrCalibration(path.string(), rig);
          },
          py::arg("path"), "As a Kalibr camera chain with the IMU in it. Throws OutputError.")
      .def_property_readonly("cameras",
                             [](const Rig& rig) {
                               return std::vector<Camera>(rig.cameras.begin(),
                                                          rig.cameras.begin() + CameraCount(rig));
                             })
      .def_property_readonly(
          "T_imu_camera",
          [](const Rig& rig) {
            return ToMatrices(
                {rig.T_imu_camera.begin(), rig.T_imu_camera.begin() + CameraCount(rig)});
          },
          "n x 4 x 4, metres: p_imu = T_imu_camera[i] p_camera.")
      .def_property_readonly(
          "imu_noise",
          [](const Rig& rig) {
            py::dict noise;
            for (const auto& [name, member] : kNoise) noise[name] = rig.imu_noise.*member;
            return noise;
          },
          "Continuous densities, with their units in the keys, and rate_hz.")
      .def_readonly("camera_time_offset_s", &Rig::camera_time_offset_s)
      .def_readonly("right_time_offset_s", &Rig::right_time_offset_s)
      .def_readonly("readout_s", &Rig::readout_s, "A camera each, seconds; 0 of a global shutter.")
      .def("__repr__", &DescribeRig);
}

Trajectory MakeTrajectory(const std::vector<int64_t>& stamps_ns, const Points& positions,
                          const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>& wxyz) {
  const auto count = static_cast<Eigen::Index>(stamps_ns.size());
  if (positions.rows() != count || wxyz.rows() != count) {
    throw ConfigError(
        fmt::format("Trajectory: found {} stamps, {} positions, {} quaternions, expected as many",
                    count, positions.rows(), wxyz.rows()));
  }
  Trajectory poses;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Quaterniond q(wxyz(i, 0), wxyz(i, 1), wxyz(i, 2), wxyz(i, 3));
    const int64_t stamp_ns = stamps_ns[static_cast<size_t>(i)];
    const bool is_next = poses.empty() || poses.back().stamp_ns < stamp_ns;
    if (!is_next || !positions.row(i).allFinite() || !(std::abs(q.norm() - 1) < 1e-3)) {
      throw ConfigError(
          fmt::format("Trajectory: row {}: found a stamp, position or quaternion that cannot be, "
                      "expected rising "
                      "stamps, finite positions and quaternions of length 1",
                      i));
    }
    poses.push_back({stamp_ns, {q.normalized(), positions.row(i).transpose()}});
  }
  return poses;
}

std::vector<RigidTransform> Transforms(const PyTrajectory& trajectory) {
  std::vector<RigidTransform> transforms;
  for (const StampedPose& pose : trajectory.poses) transforms.push_back(pose.T_world_imu);
  return transforms;
}

py::array_t<double> Quaternions(const PyTrajectory& trajectory) {
  std::vector<Eigen::Vector4d> rows;
  for (const StampedPose& pose : trajectory.poses) {
    const Eigen::Quaterniond& q = pose.T_world_imu.rotation;
    rows.emplace_back(q.w(), q.x(), q.y(), q.z());
  }
  return ToArray(rows);
}

std::string DescribeTrajectory(const PyTrajectory& trajectory) {
  const Trajectory& poses = trajectory.poses;
  const double span_s =
      poses.empty() ? 0 : ToSeconds(poses.back().stamp_ns - poses.front().stamp_ns);
  return fmt::format("<slcmap.Trajectory {} poses, {:.2f} s, {:.2f} m>", poses.size(), span_s,
                     MeasurePathLength_m(poses));
}

// evo, a program that compares trajectories, where it is installed.
py::object ToEvo(const py::object& trajectory) {
  py::dict columns;
  columns["positions_xyz"] = trajectory.attr("positions");
  columns["orientations_quat_wxyz"] = trajectory.attr("quaternions_wxyz");
  columns["timestamps"] = py::object(trajectory.attr("stamps_ns")) * py::float_(1e-9);
  return py::module_::import("evo.core.trajectory").attr("PoseTrajectory3D")(**columns);
}

void AddTrajectory(py::module_& module) {
  py::class_<PyTrajectory>(module, "Trajectory", "Poses of the IMU in the world, by stamp.")
      .def(py::init([](const std::vector<int64_t>& stamps_ns, const Points& positions,
                       const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>& wxyz) {
             return PyTrajectory{MakeTrajectory(stamps_ns, positions, wxyz)};
           }),
           py::arg("stamps_ns"), py::arg("positions"), py::arg("quaternions_wxyz"),
           "n, n x 3 metres, n x 4. Throws ConfigError.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) {
            return WithoutLock([&] { return PyTrajectory{ReadTrajectory(path.string())}; });
          },
          py::arg("path"), "Of a TUM or EuRoC file. Throws DataError.")
      .def(
          "save_tum",
          [](const PyTrajectory& trajectory, const std::filesystem::path& path) {
            WriteTumTrajectory(path.string(), trajectory.poses);
          },
          py::arg("path"), "As slcmap itself writes it. Throws OutputError.")
      .def_property_readonly(
          "stamps_ns",
          [](const py::object& self) {
            return Column(self.cast<const PyTrajectory&>().poses, &StampedPose::stamp_ns, self);
          },
          "n, int64.")
      .def_property_readonly(
          "positions",
          [](const py::object& self) {
            const auto place = [](const StampedPose& pose) -> const Eigen::Vector3d& {
              return pose.T_world_imu.translation;
            };
            return Column(self.cast<const PyTrajectory&>().poses, place, self);
          },
          "n x 3, metres, in the world.")
      .def_property_readonly("quaternions_wxyz", &Quaternions, "n x 4.")
      .def_property_readonly(
          "T_world_imu",
          [](const PyTrajectory& trajectory) { return ToMatrices(Transforms(trajectory)); },
          "n x 4 x 4.")
      .def(
          "at",
          [](const PyTrajectory& trajectory, int64_t stamp_ns) -> py::object {
            const auto pose = PoseAt(trajectory.poses, stamp_ns);
            return pose ? py::cast(Eigen::Matrix4d(pose->Matrix())) : py::none();
          },
          py::arg("stamp_ns"), "4 x 4, between its neighbours; None outside, or in a gap of 0.5 s.")
      .def("to_evo", &ToEvo, "evo's PoseTrajectory3D; needs evo.")
      .def("__len__", [](const PyTrajectory& trajectory) { return trajectory.poses.size(); })
      .def("__repr__", &DescribeTrajectory);
}

}  // namespace

void AddTypes(py::module_& module) {
  AddCamera(module);
  AddRigClass(module);
  AddTrajectory(module);
}

}  // namespace slcmap::python
