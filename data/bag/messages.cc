#include "data/bag/messages.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <bit>
#include <map>
#include <opencv2/imgproc.hpp>
#include <type_traits>

#include "data/bag/containers.h"
#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t kCdrHeader = 4;  // bytes, of which alignment counts nothing

template <typename T>
concept Number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

// CDR aligns a number to its size, ROS 1 nothing.
size_t Padding(bool aligns, size_t at, size_t size) {
  return aligns ? (size - (at - kCdrHeader) % size) % size : 0;
}

class MessageReader {
 public:
  MessageReader(BagEncoding encoding, BagBytes bytes) : cdr_(encoding == BagEncoding::kCdr) {
    bytes_ = bytes;
    if (encoding == BagEncoding::kOther) throw DataError("its layout is neither ROS 1 nor CDR");
    if (!cdr_) return;
    const auto header = Take(kCdrHeader);
    const int kind = std::to_integer<int>(header[1]);
    if (header[0] != std::byte{0} || kind > 1) {
      throw DataError(
          fmt::format("found the layout {:02x} {:02x}{}, expected plain CDR (00 00 or 00 01)",
                      std::to_integer<int>(header[0]), kind,
                      kind == 2 || kind == 3    ? " (a parameter list)"
                      : kind >= 6 && kind <= 11 ? " (XCDR2)"
                                                : ""));
    }
    swaps_ = kind == 0;
  }

  template <typename... Field>
  void All(Field&... fields) {
    (Read(fields), ...);
  }

  void Header(RosStamped* header) {
    if (!cdr_) Get<uint32_t>();  // seq
    const int64_t s = cdr_ ? int64_t{Get<int32_t>()} : int64_t{Get<uint32_t>()};
    header->stamp_ns = s * kSecond_ns + Get<uint32_t>();
    Read(header->frame_id);
  }

  // How many elements follow, of at least `bytes` each.
  size_t Count(size_t bytes) {
    const size_t count = Get<uint32_t>();
    if (count > (bytes_.size() - at_) / bytes) Fail(count * bytes);
    return count;
  }

 private:
  [[noreturn]] void Fail(size_t bytes) const {
    throw DataError(
        fmt::format("cut short: found {} bytes, expected {} or more", bytes_.size(), at_ + bytes));
  }

  BagBytes Take(size_t bytes) {
    if (bytes > bytes_.size() - at_) Fail(bytes);
    at_ += bytes;
    return bytes_.subspan(at_ - bytes, bytes);
  }

  template <Number T>
  T Get() {
    std::array<std::byte, sizeof(T)> raw;
    Take(Padding(cdr_, at_, sizeof(T)));
    std::ranges::copy(Take(sizeof(T)), raw.begin());
    if (swaps_) std::ranges::reverse(raw);
    return std::bit_cast<T>(raw);
  }

  void Read(Number auto& value) { value = Get<std::remove_reference_t<decltype(value)>>(); }
  void Read(bool& value) { value = Get<uint8_t>() != 0; }

  // CDR counts the NUL at its end; some writers give an empty string none.
  void Read(std::string& text) {
    const auto bytes = Take(Get<uint32_t>());
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (cdr_ && !text.empty() && text.back() == '\0') text.pop_back();
  }

  template <size_t kSize>
  void Read(std::array<double, kSize>& values) {
    for (double& value : values) Read(value);
  }

  void Read(std::vector<double>& values) {
    values.resize(Count(sizeof(double)));
    for (double& value : values) Read(value);
  }

  void Read(RosBytes& data) {
    data.written = Get<uint32_t>();
    data.bytes = Take(std::min<size_t>(data.written, bytes_.size() - at_));
  }

  BagBytes bytes_;
  size_t at_ = 0;
  bool cdr_ = false, swaps_ = false;
};

class MessageWriter {
 public:
  explicit MessageWriter(BagEncoding encoding) : cdr_(encoding == BagEncoding::kCdr) {
    if (cdr_) bytes_ = {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  }

  template <typename... Field>
  void All(const Field&... fields) {
    (Write(fields), ...);
  }

  void Header(const RosStamped* header) {
    if (!cdr_) Write(uint32_t{0});  // seq
    const int64_t ns = header->stamp_ns, s = ns / kSecond_ns - (ns % kSecond_ns < 0 ? 1 : 0);
    Write(static_cast<int32_t>(s));
    Write(static_cast<uint32_t>(ns - s * kSecond_ns));
    Write(header->frame_id);
  }

  void WriteCount(size_t count) { Write(static_cast<uint32_t>(count)); }

  std::vector<std::byte> Finish() { return std::move(bytes_); }

 private:
  void Append(BagBytes raw) { bytes_.insert(bytes_.end(), raw.begin(), raw.end()); }

  template <Number T>
  void Write(T value) {
    bytes_.resize(bytes_.size() + Padding(cdr_, bytes_.size(), sizeof value));
    Append(std::as_bytes(std::span(&value, 1)));
  }
  void Write(bool value) { Write(static_cast<uint8_t>(value)); }

  void Write(const std::string& text) {
    WriteCount(text.size() + (cdr_ ? 1 : 0));
    Append(std::as_bytes(std::span(text)));
    if (cdr_) bytes_.push_back(std::byte{0});
  }

  template <size_t kSize>
  void Write(const std::array<double, kSize>& values) {
    for (const double value : values) Write(value);
  }

  void Write(const std::vector<double>& values) {
    WriteCount(values.size());
    for (const double value : values) Write(value);
  }

  void Write(const RosBytes& data) {
    WriteCount(data.bytes.size());
    bytes_.reserve(bytes_.size() + data.bytes.size());
    Append(data.bytes);
  }

  std::vector<std::byte> bytes_;
  bool cdr_ = false;
};

// The fields of each message, in their order, for reading and for writing.

template <typename Io>
void Fields(Io* io, RosStamped* m) {
  io->Header(m);
}

template <typename Io>
void Fields(Io* io, RosImage* m) {
  io->Header(m);
  io->All(m->height_px, m->width_px, m->encoding, m->is_bigendian, m->step_bytes, m->data);
}

template <typename Io>
void Fields(Io* io, RosCompressedImage* m) {
  io->Header(m);
  io->All(m->format, m->data);
}

template <typename Io>
void Fields(Io* io, RosCameraInfo* m) {
  io->Header(m);
  io->All(m->height_px, m->width_px, m->distortion_model, m->d, m->k, m->r, m->p, m->binning_x,
          m->binning_y, m->roi_x_px, m->roi_y_px, m->roi_height_px, m->roi_width_px,
          m->roi_rectify);
}

template <typename Io>
void Fields(Io* io, RosImu* m) {
  io->Header(m);
  io->All(m->orientation_xyzw, m->orientation_covariance, m->angular_velocity_rad_s,
          m->angular_velocity_covariance, m->linear_acceleration_m_s2,
          m->linear_acceleration_covariance);
}

template <typename Io>
void Fields(Io* io, RosTransform* m) {
  io->All(m->translation_m, m->rotation_xyzw);
}

template <typename Io>
void Fields(Io* io, RosTransformStamped* m) {
  io->Header(m);
  io->All(m->child_frame_id);
  Fields(io, &m->transform);
}

template <typename Io>
void Fields(Io* io, RosTransforms* m) {
  if constexpr (std::is_same_v<Io, MessageReader>) {
    m->transforms.resize(io->Count(sizeof(RosTransform)));
  } else {
    io->WriteCount(m->transforms.size());
  }
  for (RosTransformStamped& transform : m->transforms) Fields(io, &transform);
}

// As .msg files have it. `uses` names the types in it, and in those, each once.
struct RosType {
  const char* name;
  const char* md5;
  const char* fields;
  std::vector<const char*> uses;
};

const std::vector<RosType>& RosTypes() {
  static const char* const kHeader = RosStamped::kType;
  static const char* const kVector = "geometry_msgs/Vector3";
  static const char* const kQuaternion = "geometry_msgs/Quaternion";
  static const std::vector<RosType> types = {
      {kHeader,
       "2176decaecbce78abc3b96ef049fabed",
       "uint32 seq\ntime stamp\nstring frame_id\n",
       {}},
      {kVector, "4a842b65f413084dc2b10fb484ea7f17", "float64 x\nfloat64 y\nfloat64 z\n", {}},
      {kQuaternion,
       "a779879fadf0160734f906b8c19c7004",
       "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
       {}},
      {"sensor_msgs/RegionOfInterest",
       "bdb633039d588fcccb441a4d43ccfe09",
       "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
       {}},
      {RosImage::kType,
       "060021388200f6f0f447d0fcd9c64743",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
       "uint32 step\nuint8[] data\n",
       {kHeader}},
      {RosCompressedImage::kType,
       "8f7a12909da2c9d3332d540a0977563f",
       "std_msgs/Header header\nstring format\nuint8[] data\n",
       {kHeader}},
      {RosCameraInfo::kType,
       "c9a58c1b0b154e0e6da7578cb991d214",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\n"
       "float64[9] K\nfloat64[9] R\nfloat64[12] P\nuint32 binning_x\nuint32 binning_y\n"
       "sensor_msgs/RegionOfInterest roi\n",
       {kHeader, "sensor_msgs/RegionOfInterest"}},
      {RosImu::kType,
       "6a62c6daae103f4ff57a132d6f95cec2",
       "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
       "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
       "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
       "float64[9] linear_acceleration_covariance\n",
       {kHeader, kQuaternion, kVector}},
      {RosTransform::kType,
       "ac9eff44abf714214112b05d54a3cf9b",
       "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
       {kVector, kQuaternion}},
      {RosTransformStamped::kType,
       "b5764a33bfeb3588febc2682852579b0",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
       {kHeader, RosTransform::kType, kVector, kQuaternion}},
      {RosTransforms::kType,
       "94810edda583a504dfda3829e70d7eec",
       "geometry_msgs/TransformStamped[] transforms\n",
       {RosTransformStamped::kType, kHeader, RosTransform::kType, kVector, kQuaternion}}};
  return types;
}

const RosType* FindRosType(const std::string& name) {
  const std::string wanted = name == "tf/tfMessage" ? RosTransforms::kType : name;
  const auto found = std::ranges::find(RosTypes(), wanted, &RosType::name);
  return found == RosTypes().end() ? nullptr : &*found;
}

// ROS 2 took `seq` away, and writes small letters.
std::string FieldsText(const RosType& type, BagEncoding encoding) {
  std::string text = type.fields;
  if (encoding != BagEncoding::kCdr) return text;
  if (type.name == std::string(RosStamped::kType)) {
    return "builtin_interfaces/Time stamp\nstring frame_id\n";
  }
  for (const char name : {'D', 'K', 'R', 'P'}) {
    const size_t at = text.find(std::string("] ") + name + "\n");
    if (at != std::string::npos) text[at + 2] = static_cast<char>(name - 'A' + 'a');
  }
  return text;
}

}  // namespace

template <typename Message>
Message DecodeMessage(BagEncoding encoding, BagBytes bytes) {
  Message message;
  MessageReader reader(encoding, bytes);
  Fields(&reader, &message);
  return message;
}

template <typename Message>
std::vector<std::byte> EncodeMessage(BagEncoding encoding, const Message& message) {
  Message fields = message;
  MessageWriter writer(encoding);
  Fields(&writer, &fields);
  return writer.Finish();
}

#define SLCMAP_ROS_MESSAGE(Message)                               \
  template Message DecodeMessage<Message>(BagEncoding, BagBytes); \
  template std::vector<std::byte> EncodeMessage(BagEncoding, const Message&)
SLCMAP_ROS_MESSAGE(RosStamped);
SLCMAP_ROS_MESSAGE(RosImage);
SLCMAP_ROS_MESSAGE(RosCompressedImage);
SLCMAP_ROS_MESSAGE(RosCameraInfo);
SLCMAP_ROS_MESSAGE(RosImu);
SLCMAP_ROS_MESSAGE(RosTransform);
SLCMAP_ROS_MESSAGE(RosTransformStamped);
SLCMAP_ROS_MESSAGE(RosTransforms);
#undef SLCMAP_ROS_MESSAGE

RosDefinition DefinitionFor(const std::string& type, BagEncoding encoding) {
  const RosType* const found = FindRosType(type);
  if (found == nullptr) return {};
  RosDefinition definition{FieldsText(*found, encoding), found->md5};
  const auto add = [&](const std::string& name, const std::string& fields) {
    definition.text += std::string(80, '=') + "\nMSG: " + name + "\n" + fields;
  };
  for (const char* used : found->uses) add(used, FieldsText(*FindRosType(used), encoding));
  if (encoding == BagEncoding::kCdr && definition.text.find("Time stamp") != std::string::npos) {
    add("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
  }
  return definition;
}

namespace {

struct PixelLayout {
  int type = CV_8UC1, conversion = -1;  // -1: grey already
};

const PixelLayout* LayoutFor(const std::string& encoding) {
  static const std::map<std::string, PixelLayout> kLayouts = {
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
  const auto layout = kLayouts.find(encoding);
  return layout == kLayouts.end() ? nullptr : &layout->second;
}

size_t RowBytes(const RosImage& image, const PixelLayout& layout) {
  return image.width_px * static_cast<size_t>(CV_ELEM_SIZE(layout.type));
}

}  // namespace

std::optional<size_t> PixelBytes(const RosImage& image) {
  const PixelLayout* const layout = LayoutFor(image.encoding);
  if (layout == nullptr) return std::nullopt;
  if (image.height_px == 0) return 0;
  const size_t row_bytes = RowBytes(image, *layout);
  return (image.height_px - 1) * std::max<size_t>(image.step_bytes, row_bytes) + row_bytes;
}

std::optional<cv::Mat> GreyFrom(const RosImage& image) {
  const PixelLayout* const layout = LayoutFor(image.encoding);
  if (layout == nullptr) return std::nullopt;
  if (image.width_px == 0 || image.height_px == 0 || image.data.bytes.size() < PixelBytes(image)) {
    throw DataError("fewer pixels than its size says");
  }
  const cv::Mat stored(static_cast<int>(image.height_px), static_cast<int>(image.width_px),
                       layout->type, const_cast<std::byte*>(image.data.bytes.data()),
                       std::max<size_t>(image.step_bytes, RowBytes(image, *layout)));
  cv::Mat grey;
  if (layout->conversion < 0) {
    grey = stored.clone();
  } else {
    cv::cvtColor(stored, grey, layout->conversion);
  }
  if (grey.depth() == CV_16U && image.is_bigendian) {
    for (auto pixel = grey.begin<uint16_t>(); pixel != grey.end<uint16_t>(); ++pixel) {
      *pixel = static_cast<uint16_t>(*pixel << 8 | *pixel >> 8);
    }
  }
  return grey;
}

std::string ExtensionFor(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) return ".png";
  return bytes.starts_with("\xff\xd8") ? ".jpg" : "";
}

}  // namespace slcmap::data
