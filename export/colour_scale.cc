#include "export/colour_scale.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace slcmap {
namespace {

// At equal steps. All are bright, so that they show on dark pages, and in viewers that take glTF's
// linear colours for those of the screen.
constexpr std::array<std::array<double, 3>, 5> kScale = {
    {{80, 130, 255}, {50, 200, 230}, {90, 225, 110}, {250, 220, 70}, {255, 120, 60}}};

uint8_t ToByte(double value) { return static_cast<uint8_t>(std::lround(value)); }

}  // namespace

Colour ScaleColour(double u) {
  const double place = std::clamp(u, 0.0, 1.0) * (kScale.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kScale.size() - 2);
  const double fraction = place - static_cast<double>(below);
  const auto part = [&](std::size_t i) {
    return ToByte((1 - fraction) * kScale[below][i] + fraction * kScale[below + 1][i]);
  };
  return {part(0), part(1), part(2)};
}

Colour Shade(const Colour& colour, double factor) {
  return {ToByte(factor * colour.red), ToByte(factor * colour.green), ToByte(factor * colour.blue)};
}

}  // namespace slcmap
