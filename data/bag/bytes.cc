#include "data/bag/bytes.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace slcmap::inline data {

PlacedFile::PlacedFile(const std::string& path) : path_(path) {
  descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor_ < 0 || fstat(descriptor_, &status) != 0) {
    throw DataError(fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  }
  size_ = static_cast<uint64_t>(status.st_size);
}

PlacedFile::~PlacedFile() { close(descriptor_); }

size_t PlacedFile::ReadInto(uint64_t at, std::span<std::byte> bytes) const {
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (got == 0) break;
    if (got > 0) done += static_cast<size_t>(got);
    if (got < 0 && errno != EINTR) {
      throw DataError(fmt::format("{}: cannot be read: {}", path_, std::strerror(errno)));
    }
  }
  return done;
}

std::vector<std::byte> PlacedFile::Read(uint64_t at, size_t count) const {
  const uint64_t left = at < size_ ? size_ - at : 0;
  std::vector<std::byte> bytes(std::min<uint64_t>(count, left));
  bytes.resize(ReadInto(at, bytes));
  return bytes;
}

BagBytes PlacedBytes::Peek(uint64_t at, size_t count) {
  if (at >= size_) return {};
  count = static_cast<size_t>(std::min<uint64_t>(count, size_ - at));
  if (file_ == nullptr) return memory_.subspan(at, count);
  if (at < window_at_ || at + count > window_at_ + window_.size()) {
    constexpr size_t kWindow = 1 << 13;  // some twenty samples of an IMU; of an image its start
    window_.resize(std::min<uint64_t>(std::max(count, kWindow), size_ - at));
    window_.resize(file_->ReadInto(at, window_));
    window_at_ = at;
  }
  return BagBytes(window_)
      .subspan(at - window_at_)
      .first(std::min<uint64_t>(count, window_at_ + window_.size() - at));
}

std::string ByteCursor::TakeText() { return std::string(AsText(TakeSized())); }

std::string_view AsText(BagBytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

BagBytes AsBytes(std::string_view text) { return std::as_bytes(std::span(text)); }

ChunkCache::Chunk ChunkCache::Get(uint64_t block,
                                  const std::function<std::vector<std::byte>()>& load) {
  std::promise<Chunk> promise;
  {
    std::unique_lock lock(mutex_);
    const auto known = std::ranges::find(chunks_, block, &Kept::block);
    if (known != chunks_.end()) {
      chunks_.splice(chunks_.begin(), chunks_, known);
      const std::shared_future<Chunk> chunk = known->chunk;
      lock.unlock();
      return chunk.get();  // another thread may be at it
    }
    chunks_.push_front({block, 0, promise.get_future().share()});
  }
  try {
    const auto chunk = std::make_shared<const std::vector<std::byte>>(load());
    promise.set_value(chunk);
    Forget(block, chunk->size());
    return chunk;
  } catch (...) {
    promise.set_exception(std::current_exception());
    Forget(block, 0);
    throw;
  }
}

// Those that were used longest ago.
void ChunkCache::Forget(uint64_t loaded, size_t bytes) {
  constexpr size_t kLeast = 4;  // left, right and IMU, and one that is read ahead
  constexpr size_t kMost = 64, kMostBytes = size_t{32} << 20;
  const std::lock_guard lock(mutex_);
  const auto kept = std::ranges::find(chunks_, loaded, &Kept::block);
  if (kept != chunks_.end()) {
    kept->bytes = bytes;
    bytes_ += bytes;
  }
  while (chunks_.size() > kMost || (chunks_.size() > kLeast && bytes_ > kMostBytes)) {
    bytes_ -= chunks_.back().bytes;
    chunks_.pop_back();
  }
}

}  // namespace slcmap::data
