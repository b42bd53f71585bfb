#include "data/bag/bytes.h"

#include <bzlib.h>
#include <fcntl.h>
#include <lz4frame.h>
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>

#include "data/io/file.h"

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

namespace {

// What a step of unpacking used and made; `more` is false at the end, or where bytes are no good.
struct UnpackStep {
  size_t used = 0, made = 0;
  bool damaged = false, ended = false;
};

// Steps until the packed bytes have run out or enough was made. The room grows with what is there,
// since a size that is written may be absurd.
template <typename Step>
Unpacked UnpackBy(BagBytes packed, uint64_t size, const Step& step) {
  constexpr uint64_t kFirstRoom = 1 << 23;
  Unpacked result;
  size_t made = 0, used = 0;
  while (made < size) {
    if (made == result.bytes.size()) {
      result.bytes.resize(std::min(size, std::max<uint64_t>(kFirstRoom, 2 * made)));
    }
    const UnpackStep done = step(packed.subspan(used), std::span(result.bytes).subspan(made));
    used += done.used;
    made += done.made;
    result.damaged = done.damaged;
    if (done.damaged || done.ended || (done.used == 0 && done.made == 0)) break;
  }
  result.bytes.resize(made);
  return result;
}

Unpacked UnpackLz4(BagBytes packed, uint64_t size) {
  LZ4F_dctx* context = nullptr;
  LZ4F_createDecompressionContext(&context, LZ4F_VERSION);
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owner(
      context, &LZ4F_freeDecompressionContext);
  return UnpackBy(packed, size, [&](BagBytes in, std::span<std::byte> out) {
    UnpackStep done{in.size(), out.size()};
    const size_t hint =
        LZ4F_decompress(context, out.data(), &done.made, in.data(), &done.used, nullptr);
    done.damaged = LZ4F_isError(hint) != 0;
    done.ended = hint == 0;
    if (done.damaged) done.used = done.made = 0;
    return done;
  });
}

UnpackStep StepZstd(ZSTD_DStream* stream, BagBytes in, std::span<std::byte> out) {
  ZSTD_inBuffer input{in.data(), in.size(), 0};
  ZSTD_outBuffer output{out.data(), out.size(), 0};
  const size_t hint = ZSTD_decompressStream(stream, &output, &input);
  return {input.pos, output.pos, ZSTD_isError(hint) != 0, hint == 0};
}

Unpacked UnpackZstd(BagBytes packed, uint64_t size) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  return UnpackBy(packed, size, [&](BagBytes in, std::span<std::byte> out) {
    UnpackStep done = StepZstd(stream.get(), in, out);
    done.ended = false;  // another frame may follow
    return done;
  });
}

Unpacked UnpackBz2(BagBytes packed, uint64_t size) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw DataError("bzip2: out of memory");
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> owner(&stream,
                                                                         &BZ2_bzDecompressEnd);
  constexpr size_t kMost = 1 << 30;  // its counts have 32 bits
  return UnpackBy(packed, size, [&](BagBytes in, std::span<std::byte> out) {
    const auto given = static_cast<unsigned>(std::min(in.size(), kMost));
    const auto room = static_cast<unsigned>(std::min(out.size(), kMost));
    stream.next_in = const_cast<char*>(AsText(in).data());
    stream.avail_in = given;
    stream.next_out = reinterpret_cast<char*>(out.data());
    stream.avail_out = room;
    const int status = BZ2_bzDecompress(&stream);
    return UnpackStep{given - stream.avail_in, room - stream.avail_out, status < 0,
                      status == BZ_STREAM_END};
  });
}

std::string PackBz2(std::string_view bytes) {
  std::string packed(bytes.size() + bytes.size() / 64 + 1024, '\0');
  auto size = static_cast<unsigned>(packed.size());
  if (BZ2_bzBuffToBuffCompress(packed.data(), &size, const_cast<char*>(bytes.data()),
                               static_cast<unsigned>(bytes.size()), 9, 0, 0) != BZ_OK) {
    throw OutputError("bytes cannot be packed with bzip2");
  }
  packed.resize(size);
  return packed;
}

// In a frame as ROS 1 writes it, the only kind that it reads.
std::string PackLz4(std::string_view bytes) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.blockMode = LZ4F_blockIndependent;
  preferences.frameInfo.blockSizeID = LZ4F_max1MB;
  preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  std::string packed(LZ4F_compressFrameBound(bytes.size(), &preferences), '\0');
  const size_t size =
      LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &preferences);
  if (LZ4F_isError(size)) throw OutputError("bytes cannot be packed with lz4");
  packed.resize(size);
  return packed;
}

constexpr int kZstdLevel = 1;               // as rosbag2's quick profile
constexpr uint64_t kMostMessage = 1 << 30;  // bytes; no camera writes as much at once

}  // namespace

bool CanUnpack(const std::string& compression) {
  return compression == "lz4" || compression == "zstd" || compression == "bz2";
}

Unpacked Unpack(const std::string& compression, BagBytes packed, uint64_t size) {
  if (compression == "lz4") return UnpackLz4(packed, size);
  if (compression == "zstd") return UnpackZstd(packed, size);
  return UnpackBz2(packed, size);
}

std::string Pack(const std::string& compression, std::string_view bytes) {
  if (compression == "bz2") return PackBz2(bytes);
  if (compression == "lz4") return PackLz4(bytes);
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size)) throw OutputError("bytes cannot be packed with zstd");
  packed.resize(size);
  return packed;
}

bool IsZstdFrame(BagBytes bytes) { return AsText(bytes).starts_with("\x28\xb5\x2f\xfd"); }

std::vector<std::byte> UnpackZstdMessage(BagBytes packed) {
  const unsigned long long said = ZSTD_getFrameContentSize(packed.data(), packed.size());
  const bool known = said != ZSTD_CONTENTSIZE_UNKNOWN && said != ZSTD_CONTENTSIZE_ERROR;
  Unpacked unpacked =
      UnpackZstd(packed, known ? std::min<uint64_t>(said, kMostMessage) : kMostMessage);
  if (unpacked.damaged || (known && unpacked.bytes.size() != said)) {
    throw DataError("found a damaged zstd frame");
  }
  return std::move(unpacked.bytes);
}

bool UnpackZstdFile(const PlacedFile& packed, const std::string& path) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  std::vector<std::byte> in(ZSTD_DStreamInSize()), out(ZSTD_DStreamOutSize());
  FileWriter file(path);
  UnpackStep done;
  for (uint64_t at = 0; !done.damaged && at < packed.size();) {
    const size_t got = packed.ReadInto(at, in);
    if (got == 0) break;
    at += got;
    BagBytes rest = BagBytes(in).first(got);
    do {
      done = StepZstd(stream.get(), rest, out);
      rest = rest.subspan(done.used);
      file.Add(AsText(BagBytes(out).first(done.made)));
      // What the stream still holds comes without new bytes.
    } while (!done.damaged && (!rest.empty() || (!done.ended && done.made == out.size())));
  }
  file.Close();
  return done.ended;
}

}  // namespace slcmap::data
