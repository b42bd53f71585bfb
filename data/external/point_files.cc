#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include "data/core/error.h"
#include "data/external/readers.h"
#include "data/io/csv.h"

namespace slcmap::inline data {
namespace {

template <typename T>
T TakeAt(std::string_view bytes, size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// A column of a PCD file.
struct PcdField {
  std::string name;
  size_t size = 4, count = 1;
  char type = 'F';
};

double PcdValue(const PcdField& field, std::string_view bytes, size_t at) {
  if (field.type == 'F') {
    return field.size == 8 ? TakeAt<double>(bytes, at) : TakeAt<float>(bytes, at);
  }
  const bool is_signed = field.type == 'I';
  switch (field.size) {
    case 1:
      return is_signed ? TakeAt<int8_t>(bytes, at) : TakeAt<uint8_t>(bytes, at);
    case 2:
      return is_signed ? TakeAt<int16_t>(bytes, at) : TakeAt<uint16_t>(bytes, at);
    case 4:
      return is_signed ? TakeAt<int32_t>(bytes, at) : TakeAt<uint32_t>(bytes, at);
    default:
      return static_cast<double>(TakeAt<int64_t>(bytes, at));
  }
}

// What LZF packed, as PCL writes it; nothing where it is damaged.
std::optional<std::string> UnpackLzf(std::string_view packed, size_t size) {
  std::string out;
  out.reserve(size);
  for (size_t at = 0; at < packed.size();) {
    const auto control = static_cast<uint8_t>(packed[at++]);
    if (control < 32) {
      const size_t literal = control + size_t{1};
      if (packed.size() - at < literal) return std::nullopt;
      out.append(packed.substr(at, literal));
      at += literal;
      continue;
    }
    size_t length = control >> 5;
    if (length == 7 && at < packed.size()) length += static_cast<uint8_t>(packed[at++]);
    if (at >= packed.size()) return std::nullopt;
    const size_t back = ((control & 31u) << 8) + static_cast<uint8_t>(packed[at++]) + 1;
    if (back > out.size()) return std::nullopt;
    // May reach into what it writes.
    for (size_t i = 0; i < length + 2; ++i) out += out[out.size() - back];
    if (out.size() > size) return std::nullopt;
  }
  return out.size() == size ? std::optional(out) : std::nullopt;
}

class PcdReader {
 public:
  PcdReader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  ExternalMap Read() {
    ReadHeader();
    for (int axis = 0; axis < 3; ++axis) Find(axis);
    map_.format = "PCD, " + data_;
    if (data_ == "ascii") {
      ReadAscii();
    } else if (data_ == "binary") {
      ReadBinary();
    } else if (data_ == "binary_compressed") {
      ReadCompressed();
    } else {
      Fail(fmt::format("found DATA {}, expected ascii, binary or binary_compressed", data_));
    }
    if (data_ != "ascii") NoteFloats();  // text may have more digits
    return std::move(map_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const { throw DataError(path_ + ": " + what); }

  size_t Whole(std::string_view text) const {
    const auto value = ParseScaledInteger(text, 0);
    if (!value || *value < 0) Fail(fmt::format("PCD header: found '{}', expected a number", text));
    return static_cast<size_t>(*value);
  }

  void ReadHeader() {
    while (data_.empty()) {
      const size_t end = bytes_.find('\n', at_);
      if (end == std::string_view::npos) Fail("PCD header has no row DATA");
      const auto words = SplitRow(bytes_.substr(at_, end - at_));
      at_ = end + 1;
      if (words.size() < 2) continue;
      if (words[0] == "FIELDS") fields_.resize(words.size() - 1);
      if (words[0] == "POINTS") points_ = Whole(words[1]);
      if (words[0] == "DATA") data_ = words[1];
      for (size_t i = 0; i < std::min(fields_.size(), words.size() - 1); ++i) {
        if (words[0] == "FIELDS") fields_[i].name = words[i + 1];
        if (words[0] == "SIZE") fields_[i].size = Whole(words[i + 1]);
        if (words[0] == "TYPE") fields_[i].type = words[i + 1].front();
        if (words[0] == "COUNT") fields_[i].count = Whole(words[i + 1]);
      }
    }
    for (const PcdField& field : fields_) stride_ += field.size * field.count;
  }

  void Find(int axis) {
    size_t offset = 0, column = 0;
    for (const PcdField& field : fields_) {
      if (field.name == std::string(1, static_cast<char>('x' + axis))) {
        fields_of_[axis] = field;
        offsets_[axis] = offset;
        columns_[axis] = column;
        return;
      }
      offset += field.size * field.count;
      column += field.count;
    }
    Fail(fmt::format("PCD header: found no field {}, expected x, y and z",
                     static_cast<char>('x' + axis)));
  }

  void RequireBytes(size_t have) const {
    if (stride_ == 0 || have / stride_ < points_) {
      Fail(fmt::format("cut short: found {} points, expected {}", stride_ > 0 ? have / stride_ : 0,
                       points_));
    }
  }

  void NoteFloats() {
    for (const int axis : {0, 1, 2}) {
      if (fields_of_[axis].type != 'F' || fields_of_[axis].size != 4) continue;
      double largest = 0;
      for (const Eigen::Vector3d& p : map_.points) largest = std::max(largest, std::abs(p[axis]));
      map_.float_step = std::max(map_.float_step, GetFloatStep(largest));
    }
  }

  void ReadAscii() {
    size_t rows = 0;
    ForEachTextRow(bytes_.substr(at_), [&](int, std::string_view text) {
      const auto words = SplitRow(text);
      if (words.empty()) return;
      Eigen::Vector3d p;
      for (int axis = 0; axis < 3; ++axis) {
        const auto value =
            columns_[axis] < words.size() ? ParseNumber(words[columns_[axis]]) : std::nullopt;
        if (!value) Fail(fmt::format("point {}: found '{}', expected numbers", rows + 1, text));
        p[axis] = *value;
      }
      AddPoint(p, &map_);
      ++rows;
    });
    if (rows < points_) Fail(fmt::format("cut short: found {} points, expected {}", rows, points_));
  }

  void ReadBinary() {
    const std::string_view body = bytes_.substr(at_);
    RequireBytes(body.size());
    for (size_t i = 0; i < points_; ++i) {
      Eigen::Vector3d p;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = PcdValue(fields_of_[axis], body, i * stride_ + offsets_[axis]);
      }
      AddPoint(p, &map_);
    }
  }

  // Column after column, packed.
  void ReadCompressed() {
    if (bytes_.size() - at_ < 8) Fail("cut short: found no compressed points");
    const size_t packed = TakeAt<uint32_t>(bytes_, at_), size = TakeAt<uint32_t>(bytes_, at_ + 4);
    RequireBytes(size);
    const auto body = UnpackLzf(bytes_.substr(at_ + 8, packed), size);
    if (!body) Fail("compressed points are damaged or cut short; write them anew, uncompressed");
    for (size_t i = 0; i < points_; ++i) {
      Eigen::Vector3d p;
      for (int axis = 0; axis < 3; ++axis) {
        const size_t at = offsets_[axis] * points_ + i * fields_of_[axis].size;
        p[axis] = PcdValue(fields_of_[axis], *body, at);
      }
      AddPoint(p, &map_);
    }
  }

  const std::string& path_;
  const std::string_view bytes_;
  size_t at_ = 0;
  std::vector<PcdField> fields_;
  size_t points_ = 0, stride_ = 0;
  std::string data_;
  PcdField fields_of_[3];
  size_t offsets_[3] = {}, columns_[3] = {};
  ExternalMap map_;
};

// Where things stand in a LAS file (ASPRS, LAS 1.4 R15).
constexpr size_t kLasHeader = 227, kLas14Header = 375;
constexpr int kLasNoise = 7, kLasHighNoise = 18;

struct LasHeader {
  int minor = 0, format = 0;
  size_t data = 0, stride = 0;
  uint64_t points = 0;
  Eigen::Vector3d scale, offset;
};

LasHeader ReadLasHeader(const std::string& path, std::string_view bytes) {
  if (bytes.size() < kLasHeader) throw DataError(path + ": cut short within the header of LAS");
  LasHeader header;
  header.minor = TakeAt<uint8_t>(bytes, 25);
  header.data = TakeAt<uint32_t>(bytes, 96);
  header.format = TakeAt<uint8_t>(bytes, 104);
  header.stride = TakeAt<uint16_t>(bytes, 105);
  header.points = TakeAt<uint32_t>(bytes, 107);
  if (header.minor >= 4 && header.points == 0 && bytes.size() >= kLas14Header) {
    header.points = TakeAt<uint64_t>(bytes, 247);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const size_t at = static_cast<size_t>(axis) * 8;
    header.scale[axis] = TakeAt<double>(bytes, 131 + at);
    header.offset[axis] = TakeAt<double>(bytes, 155 + at);
  }
  return header;
}

}  // namespace

ExternalMap ReadPcd(const std::string& path, std::string_view bytes) {
  return PcdReader(path, bytes).Read();
}

ExternalMap ReadLas(const std::string& path, std::string_view bytes) {
  const LasHeader header = ReadLasHeader(path, bytes);
  if (header.format & 0xc0) {
    throw DataError(path +
                    ": found LAZ, which is compressed, expected LAS; unpack it with laszip -i "
                    "FILE.laz -o FILE.las, or save it as LAS or PLY in CloudCompare");
  }
  if (header.format > 10 || header.stride < 20) {
    throw DataError(
        fmt::format("{}: found LAS points of format {} and {} bytes, expected format 0 "
                    "to 10 of 20 bytes or more",
                    path, header.format, header.stride));
  }
  const size_t found =
      bytes.size() > header.data ? (bytes.size() - header.data) / header.stride : 0;
  if (found < header.points) {
    throw DataError(
        fmt::format("{}: cut short: found {} points, expected {}", path, found, header.points));
  }
  ExternalMap map;
  map.format = fmt::format("LAS 1.{}", header.minor);
  for (uint64_t i = 0; i < header.points; ++i) {
    const size_t at = header.data + i * header.stride;
    const int kind =
        header.format < 6 ? TakeAt<uint8_t>(bytes, at + 15) & 31 : TakeAt<uint8_t>(bytes, at + 16);
    if (kind == kLasNoise || kind == kLasHighNoise) {
      ++map.left_out;
      continue;
    }
    const Eigen::Vector3d counts(TakeAt<int32_t>(bytes, at), TakeAt<int32_t>(bytes, at + 4),
                                 TakeAt<int32_t>(bytes, at + 8));
    AddPoint(header.scale.cwiseProduct(counts) + header.offset, &map);
  }
  return map;
}

}  // namespace slcmap::data
