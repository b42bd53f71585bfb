// Checksums that tell whether bytes changed; they do not withstand forgery.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace slcmap {

// Of bytes that come part by part. FNV-1a of 64 bits: http://www.isthe.com/chongo/tech/comp/fnv.
class RunningChecksum {
 public:
  void Add(std::string_view bytes) {
    for (const char c : bytes) hash_ = (hash_ ^ static_cast<uint8_t>(c)) * 0x100000001b3u;
  }
  std::string Text() const { return fmt::format("{:016x}", hash_); }  // 16 hexadecimal digits

 private:
  uint64_t hash_ = 0xcbf29ce484222325u;
};

inline std::string Checksum(std::string_view bytes) {
  RunningChecksum checksum;
  checksum.Add(bytes);
  return checksum.Text();
}

}  // namespace slcmap
