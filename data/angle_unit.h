// Angles are radians everywhere but in files and in what people read.
#pragma once

#include <numbers>

namespace slcmap {

inline constexpr double kDegree = std::numbers::pi / 180;  // in radians
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

}  // namespace slcmap
