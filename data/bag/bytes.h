// Bytes of the files that make bags: read where they lie, in parts, and packed and unpacked.
#pragma once

#include <cstring>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "data/bag/bag.h"

namespace slcmap::inline data {

// A file that several threads read at any place.
class PlacedFile {
 public:
  explicit PlacedFile(const std::string& path);  // throws DataError
  ~PlacedFile();
  PlacedFile(const PlacedFile&) = delete;
  PlacedFile& operator=(const PlacedFile&) = delete;

  const std::string& path() const { return path_; }
  uint64_t size() const { return size_; }
  // Fewer bytes at the end of the file. Throws DataError where the disk fails.
  std::vector<std::byte> Read(uint64_t at, size_t count) const;
  size_t ReadInto(uint64_t at, std::span<std::byte> bytes) const;

 private:
  std::string path_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
};

// Bytes by their place in a file or in memory; of a file, a small window is kept.
class PlacedBytes {
 public:
  explicit PlacedBytes(const PlacedFile& file) : file_(&file), size_(file.size()) {}
  explicit PlacedBytes(BagBytes memory) : memory_(memory), size_(memory.size()) {}

  uint64_t size() const { return size_; }
  bool in_file() const { return file_ != nullptr; }
  // Fewer at the end; valid until the next call.
  BagBytes Peek(uint64_t at, size_t count);

 private:
  const PlacedFile* file_ = nullptr;
  BagBytes memory_;
  uint64_t size_ = 0, window_at_ = 0;
  std::vector<std::byte> window_;
};

// Takes little-endian numbers and texts one after another; zeros where bytes have run out, which
// ok() then says.
class ByteCursor {
 public:
  explicit ByteCursor(BagBytes bytes) : rest_(bytes) {}

  bool ok() const { return ok_; }
  BagBytes rest() const { return rest_; }

  BagBytes Take(uint64_t count) {
    if (count > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const BagBytes taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }

  template <typename Number>
  Number Take() {
    Number value{};
    const BagBytes raw = Take(sizeof value);
    if (!raw.empty()) std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }

  // As long as the number before it says.
  BagBytes TakeSized() { return Take(Take<uint32_t>()); }
  std::string TakeText();

 private:
  BagBytes rest_;
  bool ok_ = true;
};

std::string_view AsText(BagBytes bytes);
BagBytes AsBytes(std::string_view text);

// As much as can be unpacked of "lz4", "zstd" (frames) or "bz2", up to `size` bytes; `damaged` of
// bytes that are none, not of those that end too early.
struct Unpacked {
  std::vector<std::byte> bytes;
  bool damaged = false;
};
Unpacked Unpack(const std::string& compression, BagBytes packed, uint64_t size);
bool CanUnpack(const std::string& compression);

// Throws OutputError.
std::string Pack(const std::string& compression, std::string_view bytes);

// rosbag2 may pack each message by itself; CDR does not begin so.
bool IsZstdFrame(BagBytes bytes);
// Throws DataError.
std::vector<std::byte> UnpackZstdMessage(BagBytes packed);

// Unpacks a file to another as far as it goes; false where it ends too early or is damaged.
bool UnpackZstdFile(const PlacedFile& packed, const std::string& path);

// The last chunks that were unpacked, for the messages of one to unpack it once: a few, and more
// where they are small.
class ChunkCache {
 public:
  using Chunk = std::shared_ptr<const std::vector<std::byte>>;
  Chunk Get(uint64_t block, const std::function<std::vector<std::byte>()>& load);

 private:
  struct Kept {
    uint64_t block = 0;
    size_t bytes = 0;  // once it is loaded
    std::shared_future<Chunk> chunk;
  };

  void Forget(uint64_t loaded, size_t bytes);

  std::mutex mutex_;
  std::list<Kept> chunks_;  // the last used is first
  size_t bytes_ = 0;
};

}  // namespace slcmap::data
