// Recordings, whatever keeps them, as Python goes through them.
#include <pybind11/stl/filesystem.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>

#include "apps/commands/options.h"
#include "apps/python/arrays.h"
#include "data/core/error.h"
#include "data/source/recorded_source.h"

namespace slcmap::inline python {
namespace {

// Shared by those who go through it; one at a time.
struct SharedSource {
  std::unique_ptr<SequenceSource> source;
  std::mutex mutex;

  // Does work with the source, without Python's lock.
  template <typename Work>
  auto With(Work work) {
    return WithoutLock([&] {
      const std::lock_guard lock(mutex);
      return work(*source);
    });
  }
};

// The images of a time, of which all but the left one are decoded when they are asked for.
class Sample {
 public:
  Sample(int64_t stamp_ns, cv::Mat left, DeferredImages decode)
      : stamp_ns_(stamp_ns),
        left_(std::move(left)),
        others_(decode.size()),
        decode_(std::move(decode)) {}

  int64_t stamp_ns() const { return stamp_ns_; }
  const cv::Mat& left() const { return left_; }
  size_t others() const { return others_.size(); }

  // Of the second camera on.
  const cv::Mat& Other(size_t i) {
    if (!decode_[i]) return others_[i];
    others_[i] = WithoutLock([this, i, decode = std::exchange(decode_[i], nullptr)] {
      cv::Mat image = decode();
      if (image.empty()) {
        spdlog::warn("{} ns: the {} image cannot be decoded", stamp_ns_,
                     i == 0 ? "right" : fmt::format("{}th camera's", i + 2));
      }
      return image;
    });
    return others_[i];
  }

 private:
  int64_t stamp_ns_;
  cv::Mat left_;
  std::vector<cv::Mat> others_;
  DeferredImages decode_;
};

class Recording {
 public:
  Recording(std::string path, SequenceOptions options)
      : path_(std::move(path)), options_(std::move(options)), shared_(Open()) {}

  const std::string& path() const { return path_; }
  const SequenceOptions& options() const { return options_; }
  const SourceInfo& info() const { return shared_->source->info(); }

  // A source that is at its first pair.
  std::shared_ptr<SharedSource> Begin() {
    return std::exchange(is_begun_, true) ? Open() : shared_;
  }

  const std::vector<ImuSample>& Imu() {
    if (!imu_) imu_ = shared_->With([](SequenceSource& source) { return AllSamples(&source); });
    return *imu_;
  }

  Sample Get(py::ssize_t index) {
    const auto count = static_cast<py::ssize_t>(info().pair_stamps_ns.size());
    if (index < -count || index >= count) {
      throw py::index_error(
          fmt::format("found index {}, expected one of {} samples", index, count));
    }
    const auto pair = static_cast<size_t>(index < 0 ? index + count : index);
    ImageRead left = Read(pair, 0);
    if (left.problem) {
      throw DataError(fmt::format("{}: found {}, expected an image",
                                  shared_->source->ImagePlace(pair, 0),
                                  Warnings::InWords(left.problem)));
    }
    DeferredImages decode;
    for (int camera = 1; camera < CameraCount(info().rig); ++camera) {
      decode.push_back([shared = shared_, pair, camera] {
        const std::lock_guard lock(shared->mutex);
        return shared->source->ReadImage(pair, camera).image;
      });
    }
    return {info().pair_stamps_ns[pair], left.image, decode};
  }

  std::vector<Sample> Slice(const py::slice& slice) {
    py::ssize_t from = 0, until = 0, step = 0, count = 0;
    const auto all = static_cast<py::ssize_t>(info().pair_stamps_ns.size());
    if (!slice.compute(all, &from, &until, &step, &count)) throw py::error_already_set();
    std::vector<Sample> samples;
    for (py::ssize_t i = 0; i < count; ++i) samples.push_back(Get(from + i * step));
    return samples;
  }

  Trajectory Truth() {
    return shared_->With([](SequenceSource& source) { return source.ReadTruth(); });
  }

  std::map<std::string, int64_t> CountedWarnings() {
    std::map<std::string, int64_t> counts;
    const Warnings warnings =
        shared_->With([](SequenceSource& source) { return source.warnings(); });
    for (const auto& [kind, entry] : warnings.entries()) counts[kind] = entry.count;
    return counts;
  }

 private:
  std::shared_ptr<SharedSource> Open() const {
    auto shared = std::make_shared<SharedSource>();
    shared->source = WithoutLock([this] { return OpenSource(path_, options_); });
    return shared;
  }

  ImageRead Read(size_t pair, int camera) {
    return shared_->With([&](SequenceSource& source) { return source.ReadImage(pair, camera); });
  }

  const std::string path_;
  const SequenceOptions options_;
  std::shared_ptr<SharedSource> shared_;
  bool is_begun_ = false;
  std::optional<std::vector<ImuSample>> imu_;
};

Sample Next(SharedSource& shared) {
  std::optional<ReadPair> pair =
      shared.With([](SequenceSource& source) { return source.NextPair(); });
  if (!pair) throw py::stop_iteration();
  return {pair->stamp_ns, pair->left, pair->decode};
}

std::unique_ptr<Recording> OpenRecording(const std::filesystem::path& path,
                                         const std::optional<std::filesystem::path>& calibration,
                                         const std::vector<int>& cameras,
                                         const std::vector<std::string>& masks,
                                         double pair_tolerance_s, double right_offset_s) {
  SequenceOptions options;
  if (calibration) options.calibration = calibration->string();
  options.cameras = cameras;
  options.masks = masks;
  options.max_stereo_offset_s = pair_tolerance_s;
  options.right_offset_s = right_offset_s;
  return std::make_unique<Recording>(path.string(), std::move(options));
}

// The command line that names the recording, opened so.
std::vector<std::string> Arguments(const Recording& recording) {
  std::vector<std::string> arguments = SequenceArguments(recording.options());
  arguments.insert(arguments.begin(), recording.path());
  return arguments;
}

std::string Describe(const Recording& recording) {
  const SourceInfo& info = recording.info();
  const std::vector<int64_t>& stamps_ns = info.pair_stamps_ns;
  const double span_s = stamps_ns.empty() ? 0 : ToSeconds(stamps_ns.back() - stamps_ns.front());
  return fmt::format("<slcmap.Recording {} ({}): {} {}, {:.1f} s>", info.name, info.form,
                     stamps_ns.size(), HasTwoCameras(info.rig) ? "pairs" : "images", span_s);
}

// Three arrays over the samples, which the recording keeps.
py::dict ImuColumns(const py::object& self) {
  const std::vector<ImuSample>& imu = self.cast<Recording&>().Imu();
  py::dict columns;
  columns["stamps_ns"] = Column(imu, &ImuSample::stamp_ns, self);
  columns["gyro"] = Column(imu, &ImuSample::angular_velocity_rad_s, self);
  columns["accel"] = Column(imu, &ImuSample::specific_force_m_s2, self);
  return columns;
}

void AddSample(py::module_& module) {
  py::class_<Sample>(module, "Sample", "A pair of images, or an image.")
      .def_property_readonly("stamp_ns", &Sample::stamp_ns, "On the camera's clock.")
      .def_property_readonly(
          "left", [](const Sample& s) { return ToArray(s.left()); }, "rows x columns, uint8.")
      .def_property_readonly(
          "right", [](Sample& s) { return ToArray(s.others() == 0 ? cv::Mat() : s.Other(0)); },
          "The same; decoded when it is asked for first. None where there is one "
          "camera, or where its pixels are damaged.")
      .def_property_readonly(
          "images",
          [](Sample& s) {
            py::list images;
            images.append(ToArray(s.left()));
            for (size_t i = 0; i < s.others(); ++i) images.append(ToArray(s.Other(i)));
            return images;
          },
          "Of all cameras, the left one first; None where there is none.")
      .def("__repr__", [](const Sample& s) {
        return fmt::format("<slcmap.Sample at {} ns, {} x {} px>", s.stamp_ns(), s.left().cols,
                           s.left().rows);
      });
}

}  // namespace

void AddRecording(py::module_& module) {
  AddSample(module);
  py::class_<SharedSource, std::shared_ptr<SharedSource>>(module, "Samples",
                                                          "Goes through a recording; pairs that "
                                                          "cannot be read are left out.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Next);
  py::class_<Recording>(module, "Recording", "A recording on disk; see slcmap.open.")
      .def_property_readonly("path", &Recording::path)
      .def_property_readonly("form", [](const Recording& r) { return r.info().form; })
      .def_property_readonly(
          "calibration", [](const Recording& r) { return r.info().calibration; },
          "Where the rig was read, in words.")
      .def_property_readonly("rig", [](const Recording& r) { return r.info().rig; })
      .def_property_readonly(
          "stamps_ns",
          [](const py::object& self) {
            return Column(self.cast<Recording&>().info().pair_stamps_ns, std::identity(), self);
          },
          "n, int64: of all pairs, on the camera's clock.")
      .def_property_readonly("imu", &ImuColumns,
                             "A dict of stamps_ns (n, int64, the IMU's clock), gyro (n x 3, rad/s) "
                             "and accel (n x 3, m/s2: 9.81 upwards at rest).")
      .def_property_readonly(
          "truth",
          [](Recording& r) -> py::object {
            Trajectory truth = r.Truth();
            return truth.empty() ? py::none() : py::cast(PyTrajectory{std::move(truth)});
          },
          "The true poses, a Trajectory; None where there are none.")
      .def_property_readonly("warnings", &Recording::CountedWarnings,
                             "What was left out so far: counts by kind.")
      .def("_arguments", &Arguments)
      .def("__len__", [](const Recording& r) { return r.info().pair_stamps_ns.size(); })
      .def("__getitem__", &Recording::Get, py::arg("index"))
      .def("__getitem__", &Recording::Slice, py::arg("index"))
      .def("__iter__", &Recording::Begin)
      .def("__repr__", &Describe);
  module.def("open", &OpenRecording, py::arg("path"), py::arg("calibration") = py::none(),
             py::kw_only(), py::arg("cameras") = std::vector<int>(),
             py::arg("masks") = std::vector<std::string>(), py::arg("pair_tolerance_s") = 0.003,
             py::arg("right_offset_s") = 0.0,
             "Opens what the program takes as a recording. cameras: which of a rig's; "
             "masks: image files of what moves with the rig, white. Throws DataError.");
}

}  // namespace slcmap::python
