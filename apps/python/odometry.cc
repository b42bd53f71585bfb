// Odometry that is fed live.
#include "odometry/odometry.h"

#include <pybind11/stl/filesystem.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <optional>

#include "apps/evaluation/trajectory_metrics.h"
#include "apps/python/arrays.h"
#include "data/core/error.h"
#include "mapping/options.h"
#include "odometry/run/verdict.h"

namespace slcmap::inline python {
namespace {

using Stamps = py::array_t<int64_t, py::array::c_style | py::array::forcecast>;
using Vectors = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::string DescribeArray(const py::array& array) {
  return fmt::format("{} of shape {}", std::string(py::str(array.dtype())),
                     std::string(py::str(array.attr("shape"))));
}

// A camera of the rig's, by its index; one that it does not have takes no image. A copy: odometry
// may still need it when a camera's driver writes the next image over it.
cv::Mat ToMat(const char* name, const Rig& rig, size_t camera, const py::object& image) {
  if (image.is_none() && camera > 0) return {};
  if (camera >= static_cast<size_t>(CameraCount(rig))) {
    throw ConfigError(fmt::format("{}: found an image of camera {}, expected those of {}", name,
                                  camera, CameraCount(rig)));
  }
  const int rows_px = rig.cameras[camera].height_px, columns_px = rig.cameras[camera].width_px;
  const auto array = py::array::ensure(image);
  if (!array || !array.dtype().is(py::dtype::of<uint8_t>()) || array.ndim() != 2 ||
      array.shape(0) != rows_px || array.shape(1) != columns_px) {
    throw ConfigError(fmt::format(
        "{}: found {}, expected uint8 of shape ({}, {}): grey, rows x columns of the "
        "rig's camera",
        name, array && !image.is_none() ? DescribeArray(array) : "no array", rows_px, columns_px));
  }
  const auto rows = py::array_t<uint8_t, py::array::c_style>::ensure(array);
  return cv::Mat(rows_px, columns_px, CV_8U, const_cast<uint8_t*>(rows.data())).clone();
}

// Of any type of whole numbers that fit.
Stamps ToStamps(const py::object& stamps) {
  const py::array given = py::array::ensure(stamps);
  const char kind = !given ? '-' : given.size() == 0 ? 'i' : given.dtype().kind();
  if (kind != 'i' && kind != 'u') {
    throw ConfigError(fmt::format("add_imu: found stamps of {}, expected whole nanoseconds",
                                  given ? DescribeArray(given) : "no array"));
  }
  Stamps stamps_ns = Stamps::ensure(given);
  // The cast makes negative ones of those that are too large.
  const auto is_negative = [](int64_t stamp_ns) { return stamp_ns < 0; };
  if (kind == 'u' &&
      std::any_of(stamps_ns.data(), stamps_ns.data() + stamps_ns.size(), is_negative)) {
    throw ConfigError("add_imu: found stamps of 2^63 or more, expected nanoseconds that fit int64");
  }
  return stamps_ns;
}

class LiveOdometry {
  // Cameras and IMU may come from two threads.
  template <typename Work>
  auto Alone(Work work) {
    return WithoutLock([&] {
      const std::lock_guard lock(mutex_);
      return work();
    });
  }

 public:
  LiveOdometry(const Rig& rig, const OdometryOptions& options, int threads)
      : rig_(rig), method_(MethodName(options.method)), odometry_(rig, options, threads) {}

  // One sample, or n.
  void AddImu(const py::object& stamps, const Vectors& gyro, const Vectors& accel) {
    const Stamps stamps_ns = ToStamps(stamps);
    const py::ssize_t count = stamps_ns.size();
    if (stamps_ns.ndim() > 1 || gyro.size() != 3 * count || accel.size() != 3 * count) {
      throw ConfigError(fmt::format(
          "add_imu: found {} stamps, gyro {}, accel {}, expected a stamp and 3 numbers each, or n "
          "and n x 3",
          count, DescribeArray(gyro), DescribeArray(accel)));
    }
    const int64_t* stamp_ns = stamps_ns.data();
    const double *w = gyro.data(), *f = accel.data();
    Alone([&] {
      for (py::ssize_t i = 0; i < count; ++i, w += 3, f += 3) {
        odometry_.AddImu({stamp_ns[i], {w[0], w[1], w[2]}, {f[0], f[1], f[2]}});
      }
    });
  }

  std::optional<OnlineState> AddStereo(int64_t stamp_ns, const py::object& left,
                                       const py::object& right,
                                       const std::vector<py::object>& others) {
    StereoImage image{stamp_ns, ToMat("left", rig_, 0, left), ToMat("right", rig_, 1, right)};
    for (const py::object& other : others) {
      image.others.push_back(ToMat("others", rig_, 2 + image.others.size(), other));
    }
    return Take(Alone([&] { return odometry_.AddStereo(image); }));
  }

  std::optional<OnlineState> Finish() {
    return Take(Alone([&] { return odometry_.Finish(); }));
  }

  OdometryRun Run() {
    return Alone([&] { return odometry_.Run(); });
  }

  const std::vector<OnlineState>& states() const { return states_; }
  const std::string& method() const { return method_; }

 private:
  std::optional<OnlineState> Take(const std::vector<OnlineState>& states) {
    states_.insert(states_.end(), states.begin(), states.end());
    if (states.empty()) return std::nullopt;
    return states.back();
  }

  const Rig rig_;
  const std::string method_;
  std::mutex mutex_;
  Odometry odometry_;
  std::vector<OnlineState> states_;
};

std::unique_ptr<LiveOdometry> MakeOdometry(const Rig& rig, const std::string& method,
                                           const std::optional<std::filesystem::path>& config,
                                           int threads) {
  OdometryOptions options;
  if (config) {
    options = OdometryOptions::FromYaml(config->string());
    VerdictOptions::FromYaml(config->string());  // these are checked alone, as `run` does
    MappingOptions::FromYaml(config->string());
  }
  if (!method.empty()) options.method = MethodFromName(method);
  options.Check();
  if (threads < 1 || threads > 2)
    throw ConfigError(fmt::format("threads: found {}, expected 1 or 2", threads));
  return std::make_unique<LiveOdometry>(rig, options, threads);
}

// n x 6: starts and ends.
py::array_t<double> GetLines(LiveOdometry& odometry) {
  std::vector<Eigen::Matrix<double, 6, 1>> ends;
  for (const Line& line : odometry.Run().lines) {
    ends.emplace_back();
    ends.back() << line.start_world, line.end_world;
  }
  return ToArray(ends);
}

py::array_t<double> GetPoints(LiveOdometry& odometry) {
  std::vector<Eigen::Vector3d> points;
  for (const Landmark& landmark : odometry.Run().landmarks) points.push_back(landmark.p_world);
  return ToArray(points);
}

void AddState(py::module_& module) {
  py::class_<OnlineState>(module, "State", "What odometry knows at the moment of an image.")
      .def_readonly("stamp_ns", &OnlineState::stamp_ns)
      .def_readonly("segment", &OnlineState::segment, "Counts re-starts after failures.")
      .def_property_readonly(
          "T_world_imu", [](const OnlineState& s) { return s.T_world_imu.Matrix(); },
          "4 x 4, metres, z up.")
      .def_readonly("velocity_m_s", &OnlineState::velocity_world_m_s, "3, in the world.")
      .def_readonly("gyro_bias_rad_s", &OnlineState::gyro_bias_rad_s)
      .def_readonly("accel_bias_m_s2", &OnlineState::accel_bias_m_s2)
      .def("__repr__", [](const OnlineState& s) {
        const Eigen::Vector3d& p = s.T_world_imu.translation;
        return fmt::format("<slcmap.State at {} ns: ({:.3f}, {:.3f}, {:.3f}) m>", s.stamp_ns, p.x(),
                           p.y(), p.z());
      });
}

}  // namespace

void AddOdometry(py::module_& module) {
  AddState(module);
  py::class_<LiveOdometry>(module, "OdometryBase", "See slcmap.Odometry.")
      .def(py::init(&MakeOdometry), py::arg("rig"), py::arg("method"), py::arg("config"),
           py::arg("threads"))
      .def("add_imu", &LiveOdometry::AddImu, py::arg("stamp_ns"), py::arg("gyro"), py::arg("accel"),
           "A sample (3 rad/s, 3 m/s2), or n of them (n, n x 3, n x 3), by rising stamps of the "
           "IMU's clock.")
      .def("add_stereo", &LiveOdometry::AddStereo, py::arg("stamp_ns"), py::arg("left"),
           py::arg("right") = py::none(), py::arg("others") = std::vector<py::object>(),
           "Images of uint8, rows x columns; right is None of one camera, and others are those of "
           "the third camera on. Processes all whose IMU "
           "samples have come, and returns the newest State, or None where there is none yet.")
      .def("finish", &LiveOdometry::Finish,
           "Waits for what is under way; the newest State, or None.")
      .def_property_readonly("method", &LiveOdometry::method)
      .def_property_readonly(
          "trajectory", [](const LiveOdometry& o) { return PyTrajectory{OnlinePoses(o.states())}; },
          "All states so far, as a Trajectory.")
      .def_property_readonly("points", &GetPoints, "n x 3, metres: landmarks so far.")
      .def_property_readonly("lines", &GetLines, "n x 6, metres: starts and ends of lines so far.")
      .def_property_readonly(
          "warnings", [](LiveOdometry& o) { return o.Run().warnings; }, "Counts by kind.")
      .def("__repr__", [](const LiveOdometry& o) {
        return fmt::format("<slcmap.Odometry '{}', {} states>", o.method(), o.states().size());
      });
}

}  // namespace slcmap::python
