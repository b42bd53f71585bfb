#include "data/source/convert_recording.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "data/bag/bytes.h"
#include "data/bag/messages.h"
#include "data/core/types.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/rig/topics.h"
#include "data/source/imu_streams.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

std::string CameraName(int camera) { return fmt::format("cam{}", camera); }

// The rows of a part of a recording.
struct PartRows {
  std::map<int, std::vector<ImageFile>> images;  // by camera
  std::vector<ImuRow> imu;                       // none of a recording without
  size_t size() const {
    size_t rows = imu.size();
    for (const auto& [camera, files] : images) rows += files.size();
    return rows;
  }
};

PartRows ReadRows(const RecordingTables& recording, const SequencePart& part, Warnings* warnings) {
  constexpr int64_t kMargin_ns = 1'000'000'000;
  part.Check();
  PartRows rows;
  for (const int camera : recording.cameras()) {
    rows.images[camera] = recording.ReadImages(camera, warnings).elements;
  }
  try {
    rows.imu = recording.ReadImu(warnings).elements;
  } catch (const DataError& error) {
    warnings->Add("recordings_without_imu", error.what());
  }
  const std::vector<ImageFile>& first = rows.images.begin()->second;
  if (first.empty() || (part.from_s == 0 && part.duration_s == 0)) return rows;
  const PartSpan span = part.SpanFrom(first.front().stamp_ns);
  const auto is_out = [&](const auto& row, int64_t margin_ns) {
    return row.stamp_ns < span.from_ns - margin_ns || row.stamp_ns > span.to_ns + margin_ns;
  };
  for (auto& [camera, files] : rows.images) {
    std::erase_if(files, [&](const ImageFile& file) { return is_out(file, 0); });
  }
  std::erase_if(rows.imu, [&](const ImuRow& row) { return is_out(row, kMargin_ns); });
  return rows;
}

void RequireImages(const RecordingTables& recording, const SequencePart& part,
                   const PartRows& rows) {
  if (std::ranges::any_of(rows.images, [](const auto& entry) { return !entry.second.empty(); })) {
    return;
  }
  throw ConfigError(
      fmt::format("{}: found no image {}", recording.place(),
                  part.from_s == 0 && part.duration_s == 0
                      ? std::string("that can be read")
                      : fmt::format("with --from {} --duration {}", part.from_s, part.duration_s)));
}

// Counts rows as they are written.
class ConvertedRows {
 public:
  ConvertedRows(size_t all, const Progress& progress)
      : all_(static_cast<double>(std::max<size_t>(all, 1))), progress_(progress) {}

  void Add(const std::string& sensor) {
    ++counts_.rows[sensor];
    Pass();
  }
  void Lose(const char* problem, const std::string& path) {
    counts_.warnings.Add(problem, path);
    Pass();
  }
  ConvertedCounts& counts() { return counts_; }

 private:
  void Pass() { progress_.ReportOrStop(std::min(1.0, ++done_ / all_)); }

  const double all_;
  const Progress& progress_;
  ConvertedCounts counts_;
  double done_ = 0;
};

void WriteAslImu(const std::vector<ImuRow>& rows, const std::string& folder,
                 ConvertedRows* written) {
  if (rows.empty()) return;
  MakeFolder(folder);
  FileWriter file(folder + "/data.csv");
  file.Add(kAslImuHead);
  for (const ImuRow& row : rows) {
    file.Add(AslImuText(row));
    written->Add("imu0");
  }
  file.Close();
}

void WriteAslCamera(const ImageStore& images, const std::vector<ImageFile>& rows,
                    const std::string& camera, const std::string& folder, ConvertedRows* written) {
  MakeFolder(folder + "/data");
  std::string table = kAslImagesHead;
  std::set<std::string> names;
  for (const ImageFile& row : rows) {
    const KeptImage kept = images.Read(row.path);
    if (kept.problem != nullptr) {
      written->Lose(kept.problem, row.path);
      continue;
    }
    const std::string name = fs::path(row.path).filename().string();
    if (names.insert(name).second) {  // a row may be there twice
      const std::string path = folder + "/data/" + name;
      kept.pixels.empty() ? WriteFile(path, kept.bytes) : WritePng(path, kept.pixels);
    }
    table += fmt::format("{},{}\n", row.stamp_ns, name);
    written->Add(camera);
  }
  WriteFile(folder + "/data.csv", table);
}

// Files of calibrations, and true poses, from one ASL folder to another.
void CarryAlong(const fs::path& from, const fs::path& to) {
  const auto copy = [&](const fs::path& path, const fs::path& target) {
    std::error_code error;
    if (!fs::exists(path, error)) return;
    fs::create_directories(target.parent_path(), error);
    fs::copy(path, target, fs::copy_options::recursive, error);
    if (error) {
      throw OutputError(fmt::format("{}: cannot be written: {}", target.string(), error.message()));
    }
  };
  const auto copy_calibrations = [&](const fs::path& folder) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      const std::string extension = entry.path().extension().string();
      const bool is_calibration = extension == ".yaml" || extension == ".yml";
      const fs::path target = to / entry.path().filename();
      if (is_calibration && !fs::exists(target, error)) copy(entry.path(), target);
    }
    if (!fs::exists(to / "dso", error)) copy(folder / "dso", to / "dso");
  };
  for (const auto& entry : fs::directory_iterator(to)) {
    const fs::path sensor = entry.path().filename();
    copy(from / sensor / "sensor.yaml", to / sensor / "sensor.yaml");
  }
  for (const char* truth : {"state_groundtruth_estimate0", "mocap0"})
    copy(from / truth, to / truth);
  copy_calibrations(from);
  const fs::path whole = fs::absolute(from).lexically_normal();
  if (whole.filename() != "mav0") return;  // what is above may be another recording's
  copy_calibrations(whole.parent_path());
  copy(whole.parent_path() / "truth", to / "truth");
}

// Bags have stamps of 32 bits of seconds. Logs beside videos may begin before these do, at 0.
void RequireStamps(const RecordingTables& recording, PartRows* some, Warnings* warnings) {
  PartRows& rows = *some;
  std::erase_if(rows.imu, [&](const ImuRow& row) {
    if (row.stamp_ns < 0) warnings->Add("samples_before_time_zero", recording.NameTable("imu0"));
    return row.stamp_ns < 0;
  });
  constexpr int64_t kMost_ns = int64_t{std::numeric_limits<int32_t>::max()} * 1'000'000'000;
  const auto require = [&](const std::string& sensor, int64_t stamp_ns) {
    if (stamp_ns >= 0 && stamp_ns <= kMost_ns) return;
    throw DataError(fmt::format("{}: found the stamp {}, expected 0 to {}: bags hold no others",
                                recording.NameTable(sensor), stamp_ns, kMost_ns));
  };
  for (const auto& [camera, files] : rows.images) {
    for (const ImageFile& file : files) require(CameraName(camera), file.stamp_ns);
  }
  for (const ImuRow& row : rows.imu) require("imu0", row.stamp_ns);
}

bool IsFile(const KeptImage& kept) { return !ExtensionFor(kept.bytes).empty(); }

// A bag that is written, as EuRoC's or as a rig's.
struct OpenedBag {
  BagEncoding encoding;
  std::unique_ptr<BagWriter> writer;
  std::optional<RigLayout> layout;

  uint32_t AddTopic(const std::string& name, const std::string& type) {
    return writer->AddTopic(MakeTopic(name, type, encoding));
  }
  template <typename Message>
  void Write(uint32_t topic, int64_t received_ns, const Message& message) {
    writer->Write(topic, received_ns, EncodeMessage(encoding, message));
  }
};

// The IMU's rows as messages.
class ImuMessages {
 public:
  ImuMessages(const std::vector<ImuRow>& rows, OpenedBag* bag) : bag_(*bag) {
    if (rows.empty()) return;
    const bool apart = LackHalves(rows);
    const std::string gyro = bag_.layout ? bag_.layout->topics.gyro
                             : apart     ? "/imu0/gyro"
                                         : "/imu0";
    const std::string accel = bag_.layout ? bag_.layout->topics.accel
                              : apart     ? "/imu0/accel"
                                          : gyro;
    const auto add = [&](const std::string& name) -> Topic {
      return {bag_.AddTopic(name, RosImu::kType),
              bag_.layout ? bag_.layout->FrameName(name) : "imu0"};
    };
    apart_ = gyro != accel;
    gyro_ = add(gyro);
    if (apart_) accel_ = add(accel);
  }

  void Write(const ImuRow& row, int64_t received_ns) {
    if (!apart_) {
      Put(gyro_, row, received_ns);
      return;
    }
    if (row.angular_velocity_rad_s.allFinite()) Put(gyro_, row, received_ns);
    if (row.specific_force_m_s2.allFinite()) Put(accel_, row, received_ns);
  }

 private:
  struct Topic {
    uint32_t number = 0;
    std::string frame;
  };

  void Put(const Topic& topic, const ImuRow& row, int64_t received_ns) {
    RosImu imu;
    imu.stamp_ns = row.stamp_ns;
    imu.frame_id = topic.frame;
    imu.orientation_covariance[0] = -1;  // not known, as the message's definition has it
    Eigen::Map<Eigen::Vector3d>(imu.angular_velocity_rad_s.data()) = row.angular_velocity_rad_s;
    Eigen::Map<Eigen::Vector3d>(imu.linear_acceleration_m_s2.data()) = row.specific_force_m_s2;
    bag_.Write(topic.number, received_ns, imu);
  }

  OpenedBag& bag_;
  Topic gyro_, accel_;
  bool apart_ = false;
};

// One camera's images as messages.
class ImageMessages {
 public:
  ImageMessages(int camera, bool as_files, OpenedBag* bag) : as_files_(as_files), bag_(*bag) {
    const std::string name =
        bag_.layout ? bag_.layout->ImagesTopic(camera) : fmt::format("/cam{}/image_raw", camera);
    frame_ = bag_.layout ? bag_.layout->FrameName(name) : CameraName(camera);
    topic_ = bag_.AddTopic(name + (as_files ? kCompressedSuffix : ""),
                           as_files ? RosCompressedImage::kType : RosImage::kType);
    if (!bag_.layout) return;
    is_coloured_ = name.find("color") != std::string::npos;
    info_ = bag_.layout->Info(camera);
    info_topic_ = bag_.AddTopic(bag_.layout->InfoTopic(camera), RosCameraInfo::kType);
  }

  // nullptr, or why it is not there.
  const char* Write(const KeptImage& kept, int64_t stamp_ns, int64_t received_ns) {
    if (kept.problem != nullptr) return kept.problem;
    const char* const problem = as_files_ ? WriteAsFile(kept, stamp_ns, received_ns)
                                          : WritePixels(kept, stamp_ns, received_ns);
    if (problem != nullptr || !info_) return problem;
    info_->stamp_ns = stamp_ns;
    bag_.Write(info_topic_, received_ns, *info_);
    return nullptr;
  }

 private:
  const char* WritePixels(const KeptImage& kept, int64_t stamp_ns, int64_t received_ns) {
    const cv::Mat grey = StoredGray(kept);
    if (grey.empty() || grey.channels() != 1) return kImageUndecodable;
    const bool deep = grey.depth() == CV_16U;
    if (!deep && grey.depth() != CV_8U) return kImageUndecodable;
    cv::Mat pixels = grey.isContinuous() ? grey : grey.clone();
    const bool is_coloured = is_coloured_ && !deep;
    if (is_coloured) cv::cvtColor(grey, pixels, cv::COLOR_GRAY2BGRA);
    RosImage image;
    image.stamp_ns = stamp_ns;
    image.frame_id = frame_;
    image.width_px = static_cast<uint32_t>(pixels.cols);
    image.height_px = static_cast<uint32_t>(pixels.rows);
    image.encoding = deep ? "mono16" : is_coloured ? "bgra8" : "mono8";
    image.step_bytes = static_cast<uint32_t>(static_cast<size_t>(pixels.cols) * pixels.elemSize());
    image.data.bytes = std::as_bytes(std::span(pixels.data, pixels.total() * pixels.elemSize()));
    bag_.Write(topic_, received_ns, image);
    return nullptr;
  }

  const char* WriteAsFile(const KeptImage& kept, int64_t stamp_ns, int64_t received_ns) {
    std::string bytes = kept.bytes;
    if (!IsFile(kept)) {
      const cv::Mat grey = StoredGray(kept);
      if (grey.empty()) return bytes.empty() ? kImageTruncated : kImageUndecodable;
      bytes = EncodePng(grey);
    }
    RosCompressedImage image;
    image.stamp_ns = stamp_ns;
    image.frame_id = frame_;
    image.format = ExtensionFor(bytes) == ".png" ? "png" : "jpeg";
    image.data.bytes = AsBytes(bytes);
    bag_.Write(topic_, received_ns, image);
    return nullptr;
  }

  const bool as_files_;
  OpenedBag& bag_;
  std::string frame_;
  uint32_t topic_ = 0, info_topic_ = 0;
  bool is_coloured_ = false;
  std::optional<RosCameraInfo> info_;
};

// A row in the order in which it is written: by stamps, where those of its table rise.
struct OrderedRow {
  int64_t written_ns = 0;
  int camera = -1;  // -1: the IMU
  size_t row = 0;
};

std::vector<OrderedRow> OrderRows(const PartRows& rows) {
  std::vector<OrderedRow> ordered;
  const auto add = [&](int camera, const auto& table) {
    int64_t latest_ns = std::numeric_limits<int64_t>::min();
    for (size_t i = 0; i < table.size(); ++i) {
      latest_ns = std::max(latest_ns, table[i].stamp_ns);
      ordered.push_back({latest_ns, camera, i});
    }
  };
  add(-1, rows.imu);
  for (const auto& [camera, files] : rows.images) add(camera, files);
  std::ranges::stable_sort(ordered, {}, &OrderedRow::written_ns);
  return ordered;
}

// Whether a camera's images are files, by the first that is there.
bool AreFiles(const ImageStore& images, const std::vector<ImageFile>& rows) {
  for (const ImageFile& row : rows) {
    const KeptImage kept = images.Read(row.path);
    if (kept.problem == nullptr) return IsFile(kept);
  }
  return false;
}

}  // namespace

ConvertedCounts WriteAslRecording(const RecordingTables& recording, const SequencePart& part,
                                  const std::string& folder, const Progress& progress) {
  Warnings of_reading;
  const PartRows rows = ReadRows(recording, part, &of_reading);
  RequireImages(recording, part, rows);
  ConvertedRows written(rows.size(), progress);
  const SharedImageStore images = recording.images();
  for (const auto& [camera, files] : rows.images) {
    const std::string name = CameraName(camera);
    WriteAslCamera(*images, files, name, folder + "/" + name, &written);
  }
  WriteAslImu(rows.imu, folder + "/imu0", &written);
  if (!IsBagRecording(recording.place())) CarryAlong(recording.place(), folder);
  written.counts().warnings.Merge(of_reading);
  return written.counts();
}

ConvertedCounts WriteBagRecording(const RecordingTables& recording, const SequencePart& part,
                                  const BagPacking& packing, bool keep_files,
                                  const std::string& path, const Progress& progress,
                                  const std::optional<RigLayout>& layout) {
  Warnings of_reading;
  PartRows rows = ReadRows(recording, part, &of_reading);
  if (layout) {
    std::erase_if(rows.images,
                  [&](const auto& of) { return layout->ImagesTopic(of.first).empty(); });
  }
  RequireImages(recording, part, rows);
  RequireStamps(recording, &rows, &of_reading);
  OpenedBag bag{packing.form == "bag" ? BagEncoding::kRos1 : BagEncoding::kCdr,
                CreateBag(path, packing), layout};
  const SharedImageStore images = recording.images();
  std::map<int, ImageMessages> cameras;
  for (const auto& [camera, files] : rows.images) {
    cameras.try_emplace(camera, camera, keep_files && AreFiles(*images, files), &bag);
  }
  ImuMessages imu(rows.imu, &bag);
  ConvertedRows written(rows.size(), progress);
  const std::vector<OrderedRow> ordered = OrderRows(rows);
  if (layout) WritePoses(*layout, bag.encoding, ordered.front().written_ns, bag.writer.get());
  for (const OrderedRow& each : ordered) {
    if (each.camera < 0) {
      imu.Write(rows.imu[each.row], each.written_ns);
      written.Add("imu0");
      continue;
    }
    const ImageFile& file = rows.images.at(each.camera)[each.row];
    const char* const problem =
        cameras.at(each.camera).Write(images->Read(file.path), file.stamp_ns, each.written_ns);
    problem == nullptr ? written.Add(CameraName(each.camera)) : written.Lose(problem, file.path);
  }
  bag.writer->Close();
  written.counts().warnings.Merge(of_reading);
  return written.counts();
}

}  // namespace slcmap::data
