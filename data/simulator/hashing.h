// Random numbers that depend on a counter only, not on who asked before.
#pragma once

#include <cstdint>

namespace slcmap {

// Mixes all bits (the finaliser of MurmurHash3).
inline uint32_t Mixed(uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

inline uint32_t Mixed(uint32_t a, uint32_t b) { return Mixed(a + 0x9e3779b9u * (Mixed(b) + 1)); }

// Uniform in [0, 1).
inline float UnitFloat(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace slcmap
