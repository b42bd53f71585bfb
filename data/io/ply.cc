#include "data/io/ply.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <iterator>
#include <limits>
#include <string_view>
#include <type_traits>
#include <unordered_set>
#include <utility>

#include "data/core/error.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

static_assert(std::endian::native == std::endian::little);

struct PlyTypeName {
  PlyType type;
  std::string_view name;   // as written
  std::string_view alias;  // also read
};
constexpr std::array<PlyTypeName, 8> kTypeNames = {{{PlyType::kInt8, "char", "int8"},
                                                    {PlyType::kUint8, "uchar", "uint8"},
                                                    {PlyType::kInt16, "short", "int16"},
                                                    {PlyType::kUint16, "ushort", "uint16"},
                                                    {PlyType::kInt32, "int", "int32"},
                                                    {PlyType::kUint32, "uint", "uint32"},
                                                    {PlyType::kFloat, "float", "float32"},
                                                    {PlyType::kDouble, "double", "float64"}}};

// Calls function with a zero of the type.
template <typename Function>
auto WithType(PlyType type, Function function) {
  switch (type) {
    case PlyType::kInt8:
      return function(int8_t{0});
    case PlyType::kUint8:
      return function(uint8_t{0});
    case PlyType::kInt16:
      return function(int16_t{0});
    case PlyType::kUint16:
      return function(uint16_t{0});
    case PlyType::kInt32:
      return function(int32_t{0});
    case PlyType::kUint32:
      return function(uint32_t{0});
    case PlyType::kFloat:
      return function(float{0});
    case PlyType::kDouble:
      break;
  }
  return function(double{0});
}

std::string_view GetName(PlyType type) {
  for (const PlyTypeName& entry : kTypeNames) {
    if (entry.type == type) return entry.name;
  }
  throw std::logic_error("unknown PLY type");
}

void AppendValue(PlyType type, double value, std::string* bytes) {
  WithType(type, [&](auto zero) { AppendBytes(static_cast<decltype(zero)>(value), bytes); });
}

void AppendText(PlyType type, double value, std::string* text) {
  WithType(type, [&](auto zero) {
    fmt::format_to(std::back_inserter(*text), "{}", +static_cast<decltype(zero)>(value));
  });
}

// Rows of values, in the form that a file has.
class RowWriter {
 public:
  RowWriter(PlyForm form, std::string* bytes) : is_ascii_(form == PlyForm::kAscii), bytes_(bytes) {}

  void Add(PlyType type, double value) {
    if (!is_ascii_) return AppendValue(type, value, bytes_);
    if (!bytes_->empty() && bytes_->back() != '\n') *bytes_ += ' ';
    AppendText(type, value, bytes_);
  }

  void EndRow() {
    if (is_ascii_) *bytes_ += '\n';
  }

 private:
  const bool is_ascii_;
  std::string* bytes_;
};

bool Fits(PlyType type, double value) {
  return WithType(type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_floating_point_v<T>) return true;
    return value >= static_cast<double>(std::numeric_limits<T>::min()) &&
           value <= static_cast<double>(std::numeric_limits<T>::max());
  });
}

void CheckFits(const std::string& path, const PlyElement& element) {
  for (const PlyProperty& property : element.properties) {
    for (const double value : property.values) {
      if (Fits(property.type, value)) continue;
      throw OutputError(fmt::format("{}: {} {}: {} does not fit the type {}", path, element.name,
                                    property.name, value, GetName(property.type)));
    }
  }
}

std::string Header(const PlyFile& file, PlyForm form) {
  std::string text = fmt::format("ply\nformat {} 1.0\n",
                                 form == PlyForm::kAscii ? "ascii" : "binary_little_endian");
  for (const std::string& comment : file.comments) text += "comment " + comment + "\n";
  for (const PlyElement& element : file.elements) {
    text += fmt::format("element {} {}\n", element.name, element.size());
    for (const PlyProperty& property : element.properties) {
      text += fmt::format("property {} {}\n", GetName(property.type), property.name);
    }
  }
  if (!file.faces.empty()) {
    text +=
        fmt::format("element face {}\nproperty list uchar int vertex_indices\n", file.faces.size());
  }
  return text + "end_header\n";
}

// Takes a PLY file apart, front to back.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), bytes_(ReadFile(path)) {}

  PlyFile Read() {
    ReadHeader();
    for (std::size_t i = 0; i < file_.elements.size(); ++i) ReadElement(i);
    std::erase_if(file_.elements, [](const PlyElement& e) { return e.properties.empty(); });
    return std::move(file_);
  }

 private:
  // A property as the header declares it; `index` is its place among the scalar ones.
  struct Declared {
    PlyType type;
    bool is_list = false;
    PlyType count_type = PlyType::kUint8;
    std::size_t index = 0;
    bool is_face = false;  // the list of a face's vertices
  };

  [[noreturn]] void Fail(const std::string& what) const { throw DataError(path_ + ": " + what); }

  std::string_view Line() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string::npos) Fail("PLY header has no end_header");
    std::string_view line(bytes_.data() + position_, end - position_);
    position_ = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  static std::vector<std::string_view> Words(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t begin = 0; (begin = line.find_first_not_of(' ', begin)) != line.npos;) {
      const std::size_t end = std::min(line.find(' ', begin), line.size());
      words.push_back(line.substr(begin, end - begin));
      begin = end;
    }
    return words;
  }

  void ReadHeader() {
    if (Line() != "ply") Fail("found no 'ply' in the first row, expected a PLY file");
    for (std::string_view line = Line(); line != "end_header"; line = Line()) {
      const std::vector<std::string_view> words = Words(line);
      if (words.empty()) continue;
      if (words[0] == "comment") {
        file_.comments.emplace_back(line.substr(std::min<std::size_t>(8, line.size())));
      } else if (words[0] == "format") {
        ReadFormat(words);
      } else if (words[0] == "element") {
        ReadElementDeclaration(words, line);
      } else if (words[0] == "property") {
        ReadPropertyDeclaration(words, line);
      }
    }
  }

  void ReadFormat(const std::vector<std::string_view>& words) {
    const std::string_view form = words.size() > 1 ? words[1] : "";
    ascii_ = form == "ascii";
    is_big_endian_ = form == "binary_big_endian";
    if (!ascii_ && !is_big_endian_ && form != "binary_little_endian") {
      Fail(fmt::format(
          "found PLY format '{}', expected ascii, binary_little_endian or binary_big_endian",
          form));
    }
  }

  void ReadElementDeclaration(const std::vector<std::string_view>& words, std::string_view line) {
    std::size_t count = 0;
    if (words.size() == 3) {
      const auto [end, error] =
          std::from_chars(words[2].data(), words[2].data() + words[2].size(), count);
      if (error == std::errc() && end == words[2].data() + words[2].size()) {
        file_.elements.push_back({std::string(words[1]), {}});
        declared_.emplace_back();
        counts_.push_back(count);
        return;
      }
    }
    Fail(fmt::format("found '{}' in the header, expected 'element NAME COUNT'", line));
  }

  PlyType FindType(std::string_view name) const {
    for (const PlyTypeName& entry : kTypeNames) {
      if (name == entry.name || name == entry.alias) return entry.type;
    }
    Fail(fmt::format("found PLY type '{}', expected one of its eight types", name));
  }

  void ReadPropertyDeclaration(const std::vector<std::string_view>& words, std::string_view line) {
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (declared_.empty() || (!is_list && words.size() != 3)) {
      Fail(fmt::format("found '{}' in the header, expected 'property TYPE NAME'", line));
    }
    if (is_list) {
      const bool is_face = file_.elements.back().name == "face" &&
                           (words[4] == "vertex_indices" || words[4] == "vertex_index");
      declared_.back().push_back({FindType(words[3]), true, FindType(words[2]), 0, is_face});
      return;
    }
    PlyElement& element = file_.elements.back();
    declared_.back().push_back(
        {FindType(words[1]), false, PlyType::kUint8, element.properties.size()});
    element.Add(std::string(words[2]), FindType(words[1]));
  }

  template <typename T>
  double Take() {
    if (bytes_.size() - position_ < sizeof(T)) FailShort();
    T value;
    char* const first = bytes_.data() + position_;
    if (is_big_endian_) std::reverse(first, first + sizeof value);
    std::memcpy(&value, first, sizeof value);
    position_ += sizeof value;
    return static_cast<double>(value);
  }

  double TakeText() {
    position_ = std::min(bytes_.find_first_not_of(" \t\r\n", position_), bytes_.size());
    const std::size_t end = std::min(bytes_.find_first_of(" \t\r\n", position_), bytes_.size());
    if (position_ == end) FailShort();
    double value = 0;
    const auto [parsed, error] =
        std::from_chars(bytes_.data() + position_, bytes_.data() + end, value);
    if (error != std::errc() || parsed != bytes_.data() + end) {
      Fail(fmt::format("{} row {}: found '{}', expected a number", element_name_, row_ + 1,
                       bytes_.substr(position_, end - position_)));
    }
    position_ = end;
    return value;
  }

  [[noreturn]] void FailShort() const {
    Fail(fmt::format("cut short: found {} rows of element {}, expected {}", row_, element_name_,
                     expected_rows_));
  }

  double TakeValue(PlyType type) {
    if (ascii_) return TakeText();
    return WithType(type, [&](auto zero) { return Take<decltype(zero)>(); });
  }

  void ReadElement(std::size_t index) {
    PlyElement& element = file_.elements[index];
    element_name_ = element.name;
    // Rows without properties take no bytes, so that their count proves nothing.
    expected_rows_ = declared_[index].empty() ? 0 : counts_[index];
    for (row_ = 0; row_ < expected_rows_; ++row_) {
      for (const Declared& declared : declared_[index]) {
        if (declared.is_list) {
          ReadList(declared);
        } else {
          element.properties[declared.index].values.push_back(TakeValue(declared.type));
        }
      }
    }
  }

  void ReadList(const Declared& declared) {
    const double count = TakeValue(declared.count_type);
    if (declared.is_face) file_.faces.emplace_back();
    for (double i = 0; i < count; ++i) {
      const double value = TakeValue(declared.type);
      if (declared.is_face) file_.faces.back().push_back(VertexIndex(value));
    }
  }

  int32_t VertexIndex(double value) const {
    if (Fits(PlyType::kInt32, value) && value >= 0) return static_cast<int32_t>(value);
    Fail(fmt::format("{} row {}: found vertex {}, expected a number from 0", element_name_,
                     row_ + 1, value));
  }

  std::string path_;
  std::string bytes_;
  std::size_t position_ = 0;
  bool ascii_ = false, is_big_endian_ = false;
  PlyFile file_;
  std::vector<std::vector<Declared>> declared_;  // per element
  std::vector<std::size_t> counts_;              // per element
  std::string element_name_;                     // being read
  std::size_t row_ = 0, expected_rows_ = 0;
};

}  // namespace

PlyProperty& PlyElement::Add(const std::string& property, PlyType type) {
  properties.push_back({property, type, {}});
  return properties.back();
}

void PlyElement::Reserve(std::size_t rows) {
  for (PlyProperty& property : properties) property.values.reserve(rows);
}

void PlyElement::AppendRow(std::initializer_list<double> row) {
  std::size_t column = 0;
  for (const double value : row) properties[column++].values.push_back(value);
}

const PlyProperty& PlyElement::Get(const std::string& property, const std::string& path) const {
  for (const PlyProperty& candidate : properties) {
    if (candidate.name == property) return candidate;
  }
  throw DataError(fmt::format("{}: element {} has no property '{}'", path, name, property));
}

const std::vector<double>& PlyElement::Bounded(const std::string& property, double least,
                                               double most, const std::string& path) const {
  const std::vector<double>& values = Get(property, path).values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] >= least && values[i] <= most) continue;
    throw DataError(fmt::format("{}: {} row {}: {}: found {}, expected {} to {}", path, name, i + 1,
                                property, values[i], least, most));
  }
  return values;
}

void PlyElement::CheckUnique(const std::string& property, const std::string& path) const {
  std::unordered_set<double> seen;
  const std::vector<double>& values = Get(property, path).values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (seen.insert(values[i]).second) continue;
    throw DataError(
        fmt::format("{}: {} row {}: {}: found {}, expected one that no row before it has", path,
                    name, i + 1, property, values[i]));
  }
}

const PlyElement& PlyFile::Get(const std::string& element, const std::string& path) const {
  for (const PlyElement& candidate : elements) {
    if (candidate.name == element) return candidate;
  }
  throw DataError(fmt::format("{}: found no element '{}'", path, element));
}

void WritePly(const std::string& path, const PlyFile& file, PlyForm form) {
  for (const PlyElement& element : file.elements) CheckFits(path, element);
  FileWriter out(path);
  std::string bytes = Header(file, form);
  RowWriter rows(form, &bytes);
  const auto end_row = [&] {
    rows.EndRow();
    out.Add(bytes);
    bytes.clear();
  };
  for (const PlyElement& element : file.elements) {
    for (std::size_t row = 0; row < element.size(); ++row) {
      for (const PlyProperty& property : element.properties) {
        rows.Add(property.type, property.values[row]);
      }
      end_row();
    }
  }
  for (const std::vector<int32_t>& face : file.faces) {
    rows.Add(PlyType::kUint8, static_cast<double>(face.size()));
    for (const int32_t vertex : face) rows.Add(PlyType::kInt32, vertex);
    end_row();
  }
  out.Add(bytes);
  out.Close();
}

std::vector<Eigen::Vector3d> Positions(const PlyElement& vertices, const std::string& path) {
  const std::vector<double>&x = vertices.Get("x", path).values, &y = vertices.Get("y", path).values,
        &z = vertices.Get("z", path).values;
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    positions.emplace_back(x[i], y[i], z[i]);
    if (!positions.back().allFinite()) {
      throw DataError(fmt::format("{}: {} row {}: found a coordinate that is not finite", path,
                                  vertices.name, i + 1));
    }
  }
  return positions;
}

void WriteLinesPly(const std::string& path, const std::vector<PlySegment>& segments) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
  PlyElement edges{"edge", {}};
  for (const char* name : {"vertex1", "vertex2"}) edges.Add(name, PlyType::kInt32);
  for (const auto& [start, end] : segments) {
    const double first = static_cast<double>(vertices.size());
    vertices.AppendRow({start.x(), start.y(), start.z()});
    vertices.AppendRow({end.x(), end.y(), end.z()});
    edges.AppendRow({first, first + 1});
  }
  WritePly(path, {{"slcmap lines, metres in the world frame"}, {vertices, edges}, {}});
}

std::vector<PlySegment> Segments(const PlyFile& file, const std::string& path) {
  const std::vector<Eigen::Vector3d> positions = Positions(file.Get("vertex", path), path);
  const PlyElement& edges = file.Get("edge", path);
  const auto end_of = [&](const char* property, std::size_t row) {
    const double vertex = edges.Get(property, path).values[row];
    if (!(vertex >= 0 && vertex < static_cast<double>(positions.size()))) {
      throw DataError(fmt::format("{}: edge row {}: found {} {}, expected one of {} vertices", path,
                                  row + 1, property, vertex, positions.size()));
    }
    return positions[static_cast<std::size_t>(vertex)];
  };
  std::vector<PlySegment> segments;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    segments.push_back({end_of("vertex1", i), end_of("vertex2", i)});
  }
  return segments;
}

std::vector<PlySegment> ReadLinesPly(const std::string& path) {
  return Segments(ReadPly(path), path);
}

PlyFile ReadPly(const std::string& path) { return Reader(path).Read(); }

}  // namespace slcmap::data
