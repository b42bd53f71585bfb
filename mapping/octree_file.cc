#include "mapping/octree_file.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <optional>

#include "data/error.h"

namespace slcmap {
namespace {

constexpr std::string_view kFirstLine = "# Octomap OcTree binary file";
constexpr std::string_view kTreeType = "OcTree";
constexpr std::size_t kMaxShown = 40;  // characters of what was found

template <typename T>
std::optional<T> Parse(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class HeaderParser {
 public:
  HeaderParser(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  OctreeHeader Parse() {
    if (Line() != kFirstLine) Fail(fmt::format("'{}'", kFirstLine));
    while (Line() != "data") {
      if (!line_.empty() && line_[0] != '#') TakeKey();
    }
    if (!nodes_ || !resolution_m_ || !typed_) Fail("'id', 'size' and 'res' before 'data'");
    return {*nodes_, *resolution_m_, position_};
  }

 private:
  std::string_view Line() {
    ++row_;
    const std::size_t end = bytes_.find('\n', position_);
    line_ = bytes_.substr(position_, end - position_);
    if (end == std::string_view::npos) Fail("more rows of a header, up to 'data'");
    position_ = end + 1;
    return line_;
  }

  void TakeKey() {
    const std::size_t blank = line_.find(' ');
    const std::string_view key = line_.substr(0, blank);
    const std::string_view value =
        blank == std::string_view::npos ? std::string_view() : line_.substr(blank + 1);
    if (key == "id" && !typed_) {
      typed_ = value == kTreeType;
      if (!typed_) Fail(fmt::format("'id {}'", kTreeType));
    } else if (key == "size" && !nodes_) {
      nodes_ = slcmap::Parse<std::size_t>(value);
      if (!nodes_) Fail("'size' with a number of nodes");
    } else if (key == "res" && !resolution_m_) {
      resolution_m_ = slcmap::Parse<double>(value);
      if (resolution_m_ && *resolution_m_ >= kMinVoxel_m && *resolution_m_ <= kMaxVoxel_m) return;
      Fail(fmt::format("'res' with {} to {} m", kMinVoxel_m, kMaxVoxel_m));
    } else {
      Fail("'id', 'size' and 'res', once each, before 'data'");
    }
  }

  // Bytes that are no text would spoil the one line of a message.
  std::string Shown() const {
    std::string shown(line_.substr(0, kMaxShown));
    for (char& c : shown) {
      if (c < ' ' || c > '~') c = '?';
    }
    return shown + (line_.size() > kMaxShown ? "..." : "");
  }

  [[noreturn]] void Fail(const std::string& expected) const {
    throw DataError(
        fmt::format("{}: row {}: found '{}', expected {}", path_, row_, Shown(), expected));
  }

  const std::string& path_;
  std::string_view bytes_, line_;
  std::size_t position_ = 0;
  int row_ = 0;
  bool typed_ = false;
  std::optional<std::size_t> nodes_;
  std::optional<double> resolution_m_;
};

// What two bytes say of a node's eight children.
struct Children {
  explicit Children(std::string_view two_bytes) {
    for (const char byte : two_bytes) {
      for (int shift = 0; shift < 8; shift += 2) {
        const int kind = (static_cast<uint8_t>(byte) >> shift) & 3;
        count += kind != 0;
        inner += kind == 3;
      }
    }
  }
  int count = 0, inner = 0;
};

class NodeWalk {
 public:
  NodeWalk(const std::string& path, std::string_view bytes, std::size_t offset)
      : path_(path), bytes_(bytes), position_(offset) {}

  // Walks one tree; returns the number of its nodes.
  std::size_t Walk() {
    std::size_t nodes = 1;
    std::array<int, kOctreeDepth> waiting{};  // inner nodes of each depth that are still to come
    waiting[0] = 1;
    for (int depth = 0; depth >= 0;) {
      if (waiting[depth] == 0) {
        --depth;
        continue;
      }
      --waiting[depth];
      const Children children = Take();
      nodes += children.count;
      if (children.inner == 0) continue;
      if (++depth == kOctreeDepth) {
        Fail("a node deeper than 16", "a tree of depth 16");
      }
      waiting[depth] = children.inner;
    }
    return nodes;
  }

  [[noreturn]] void Fail(const std::string& found, const std::string& expected) const {
    throw DataError(fmt::format("{}: byte {}: damaged: found {}, expected {}", path_, position_,
                                found, expected));
  }

  std::size_t position() const { return position_; }

 private:
  Children Take() {
    if (bytes_.size() - position_ < 2) Fail("the end of the file", "more nodes");
    const Children children(bytes_.substr(position_, 2));
    if (children.count == 0) Fail("an inner node without children", "at least one");
    position_ += 2;
    return children;
  }

  const std::string& path_;
  std::string_view bytes_;
  std::size_t position_;
};

}  // namespace

std::string OctreeHeaderText(std::size_t nodes, double resolution_m) {
  return fmt::format("{}\nid {}\nsize {}\nres {}\ndata\n", kFirstLine, kTreeType, nodes,
                     resolution_m);
}

OctreeHeader ParseOctreeHeader(const std::string& path, std::string_view bytes) {
  return HeaderParser(path, bytes).Parse();
}

void CheckOctreeNodes(const std::string& path, std::string_view bytes, const OctreeHeader& header) {
  NodeWalk walk(path, bytes, header.data_offset);
  const std::size_t nodes = header.nodes == 0 ? 0 : walk.Walk();
  if (nodes != header.nodes) {
    walk.Fail(fmt::format("{} nodes", nodes), fmt::format("{} as in the header", header.nodes));
  }
  if (walk.position() != bytes.size()) {
    walk.Fail(fmt::format("{} more bytes", bytes.size() - walk.position()), "the end of the file");
  }
}

}  // namespace slcmap
