#include "export/storey_at.h"

namespace slcmap {
namespace {

constexpr double kBeneathFloor_m = 0.15;  // lines along a floor's edge belong to it

}  // namespace

std::optional<std::size_t> StoreyAt(const Building& building, double height_m) {
  if (building.storeys.empty()) return std::nullopt;
  std::size_t storey = 0;
  for (std::size_t i = 1; i < building.storeys.size(); ++i) {
    if (building.storeys[i].floor_m - kBeneathFloor_m <= height_m) storey = i;
  }
  return storey;
}

std::optional<std::size_t> StoreyOfId(const Building& building, int64_t id) {
  for (std::size_t i = 0; i < building.storeys.size(); ++i) {
    if (building.storeys[i].id == id) return i;
  }
  return std::nullopt;
}

}  // namespace slcmap
