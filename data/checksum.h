// Checksums that tell whether bytes changed; they do not withstand forgery.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace slcmap {

// FNV-1a of 64 bits: http://www.isthe.com/chongo/tech/comp/fnv. Sixteen hexadecimal digits.
inline std::string Checksum(std::string_view bytes) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : bytes) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

}  // namespace slcmap
