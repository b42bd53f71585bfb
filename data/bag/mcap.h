// What reader and writer of MCAP share.
#pragma once

#include <cstdint>
#include <string_view>

namespace slcmap::inline data {

inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};

enum McapOp : uint8_t {
  kMcapHeader = 0x01,
  kMcapFooter = 0x02,
  kMcapSchema = 0x03,
  kMcapChannel = 0x04,
  kMcapMessage = 0x05,
  kMcapChunk = 0x06,
  kMcapMessageIndex = 0x07,
  kMcapChunkIndex = 0x08,
  kMcapStatistics = 0x0b,
  kMcapSummaryOffset = 0x0e,
  kMcapDataEnd = 0x0f
};

uint32_t Crc32(std::string_view bytes);

}  // namespace slcmap::data
