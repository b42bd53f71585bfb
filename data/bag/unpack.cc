#include "data/bag/unpack.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "data/bag/bytes.h"
#include "data/bag/messages.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

constexpr const char* kUnreadable = "messages_that_cannot_be_decoded";
constexpr const char* kStampTwice = "images_with_a_stamp_twice";

// Eight bits of grey, or the sixteen that are there.
std::optional<cv::Mat> GreyFrom(const RosImage& image) {
  struct Form {
    int type, conversion;  // -1: grey already
  };
  static const std::map<std::string, Form> kForms = {
      {"mono8", {CV_8UC1, -1}},
      {"8UC1", {CV_8UC1, -1}},
      {"mono16", {CV_16UC1, -1}},
      {"16UC1", {CV_16UC1, -1}},
      {"bgr8", {CV_8UC3, cv::COLOR_BGR2GRAY}},
      {"8UC3", {CV_8UC3, cv::COLOR_BGR2GRAY}},
      {"rgb8", {CV_8UC3, cv::COLOR_RGB2GRAY}},
      {"bgra8", {CV_8UC4, cv::COLOR_BGRA2GRAY}},
      {"8UC4", {CV_8UC4, cv::COLOR_BGRA2GRAY}},
      {"rgba8", {CV_8UC4, cv::COLOR_RGBA2GRAY}},
      {"yuv422", {CV_8UC2, cv::COLOR_YUV2GRAY_UYVY}},
      {"yuv422_yuy2", {CV_8UC2, cv::COLOR_YUV2GRAY_YUY2}},
      // OpenCV names a mosaic by the second row's second and third pixels.
      {"bayer_rggb8", {CV_8UC1, cv::COLOR_BayerBG2GRAY}},
      {"bayer_bggr8", {CV_8UC1, cv::COLOR_BayerRG2GRAY}},
      {"bayer_gbrg8", {CV_8UC1, cv::COLOR_BayerGR2GRAY}},
      {"bayer_grbg8", {CV_8UC1, cv::COLOR_BayerGB2GRAY}}};
  const auto form = kForms.find(image.encoding);
  if (form == kForms.end()) return std::nullopt;
  const size_t row_bytes = image.width_px * static_cast<size_t>(CV_ELEM_SIZE(form->second.type));
  const size_t step_bytes = std::max<size_t>(image.step_bytes, row_bytes);
  if (image.width_px == 0 || image.height_px == 0 ||
      image.data.bytes.size() < (image.height_px - 1) * step_bytes + row_bytes) {
    throw DataError("fewer pixels than its size says");
  }
  const cv::Mat stored(static_cast<int>(image.height_px), static_cast<int>(image.width_px),
                       form->second.type, const_cast<std::byte*>(image.data.bytes.data()),
                       step_bytes);
  cv::Mat grey;
  if (form->second.conversion < 0) {
    grey = stored.clone();
  } else {
    cv::cvtColor(stored, grey, form->second.conversion);
  }
  if (grey.depth() == CV_16U && image.is_bigendian) {
    for (auto pixel = grey.begin<uint16_t>(); pixel != grey.end<uint16_t>(); ++pixel) {
      *pixel = static_cast<uint16_t>(*pixel << 8 | *pixel >> 8);
    }
  }
  return grey;
}

// "" where the bytes are neither PNG nor JPEG.
std::string ExtensionFor(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) return ".png";
  return bytes.starts_with("\xff\xd8") ? ".jpg" : "";
}

[[noreturn]] void FailEncoding(const std::string& topic, const std::string& encoding) {
  throw InputFault("bag_images",
                   fmt::format("{}: found images as '{}', expected grey or colour: mono8, mono16, "
                               "bgr8, rgb8, bgra8, rgba8, bayer, yuv422, JPEG or PNG",
                               topic, encoding),
                   "choose other topics with --topics, or decode the stream before");
}

// One camera's images as they come.
class CameraFolder {
 public:
  CameraFolder(std::string topic, const std::string& folder)
      : topic_(std::move(topic)), data_(folder + "/data") {
    MakeFolder(data_);
    table_ = folder + "/data.csv";
  }

  // Whether there was none with its stamp.
  bool Add(const BagTopic& topic, BagBytes message) {
    return topic.type == RosImage::kType ? AddPixels(topic, message) : AddFile(topic, message);
  }

  void WriteTable() const {
    std::string text = kAslImagesHead;
    for (const auto& [stamp_ns, name] : names_) text += fmt::format("{},{}\n", stamp_ns, name);
    WriteFile(table_, text);
  }

  int64_t count() const { return static_cast<int64_t>(names_.size()); }

 private:
  bool AddPixels(const BagTopic& topic, BagBytes message) {
    const auto image = DecodeMessage<RosImage>(topic.encoding, message);
    const std::optional<cv::Mat> grey = GreyFrom(image);
    if (!grey) FailEncoding(topic_, image.encoding);
    const std::optional<std::string> path = TakePath(image.stamp_ns, ".png");
    if (path) WritePng(*path, *grey);
    return path.has_value();
  }

  bool AddFile(const BagTopic& topic, BagBytes message) {
    const auto image = DecodeMessage<RosCompressedImage>(topic.encoding, message);
    const std::string_view bytes = AsText(image.data.bytes);
    const std::string extension = ExtensionFor(bytes);
    if (extension.empty()) FailEncoding(topic_, image.format);
    const std::optional<std::string> path = TakePath(image.stamp_ns, extension);
    if (path) WriteFile(*path, bytes);
    return path.has_value();
  }

  // Nothing where the stamp is taken.
  std::optional<std::string> TakePath(int64_t stamp_ns, const std::string& extension) {
    const auto [entry, is_new] = names_.emplace(stamp_ns, std::to_string(stamp_ns) + extension);
    return is_new ? std::optional(data_ + "/" + entry->second) : std::nullopt;
  }

  std::string topic_, data_, table_;
  std::map<int64_t, std::string> names_;
};

// Rows in the order in which they were written down; a half that a message does not have is blank.
class ImuTable {
 public:
  explicit ImuTable(const RecordingTopics& topics) : topics_(topics) {}

  void Add(const BagTopic& topic, BagBytes message) {
    const auto imu = DecodeMessage<RosImu>(topic.encoding, message);
    text_ += std::to_string(imu.stamp_ns);
    AddHalf(topic.name == topics_.gyro, imu.angular_velocity_rad_s);
    AddHalf(topic.name == topics_.accel, imu.linear_acceleration_m_s2);
    text_ += '\n';
    ++count_;
  }

  void Write(const std::string& folder) const {
    MakeFolder(folder);
    WriteFile(folder + "/data.csv", kAslImuHead + text_);
  }

  int64_t count() const { return count_; }

 private:
  void AddHalf(bool has, const std::array<double, 3>& values) {
    for (const double value : values) text_ += has ? fmt::format(",{}", value) : ",";
  }

  const RecordingTopics& topics_;
  std::string text_;
  int64_t count_ = 0;
};

}  // namespace

UnpackedCounts UnpackRecording(const RecordingTopics& topics, const std::string& folder,
                               const Progress& progress, Bag* bag) {
  UnpackedCounts counts;
  std::vector<CameraFolder> cameras;
  cameras.emplace_back(topics.left, folder + "/cam0");
  if (!topics.right.empty()) cameras.emplace_back(topics.right, folder + "/cam1");
  ImuTable imu(topics);
  std::vector<uint32_t> chosen;
  double all = 0, done = 0;
  for (uint32_t i = 0; i < bag->topics().size(); ++i) {
    const BagTopic& topic = bag->topics()[i];
    const bool is_image = topic.name == topics.left || topic.name == topics.right;
    const bool is_imu = topic.name == topics.gyro || topic.name == topics.accel;
    if (!(is_image && IsImageTopic(topic)) && !(is_imu && IsImuTopic(topic))) continue;
    chosen.push_back(i);
    all += static_cast<double>(std::max<int64_t>(topic.messages, 0));
  }
  bag->Visit(chosen, 0, [&](const BagPlace& place, BagBytes message) {
    const BagTopic& topic = bag->topics()[place.topic];
    try {
      if (IsImuTopic(topic)) {
        imu.Add(topic, message);
      } else if (!cameras[topic.name == topics.left ? 0 : 1].Add(topic, message)) {
        counts.warnings.Add(kStampTwice, topic.name);
      }
    } catch (const InputFault&) {
      throw;
    } catch (const DataError& error) {
      counts.warnings.Add(kUnreadable, fmt::format("{}: {}", topic.name, error.what()));
    }
    done += 1;
    progress.ReportOrStop(all > 0 ? std::min(1.0, done / all) : 0);
    return true;
  });
  counts.warnings.Merge(bag->warnings());
  for (const CameraFolder& camera : cameras) camera.WriteTable();
  imu.Write(folder + "/imu0");
  counts.left = cameras.front().count();
  counts.right = cameras.size() > 1 ? cameras.back().count() : 0;
  counts.imu = imu.count();
  return counts;
}

}  // namespace slcmap::data
