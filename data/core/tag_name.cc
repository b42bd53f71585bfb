#include "data/core/tag_name.h"

#include <algorithm>

namespace slcmap::inline data {
namespace {

constexpr int kMostDigits = 4;

std::optional<int> ParseId(const std::string& text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (text.empty() || text.size() > kMostDigits || !std::ranges::all_of(text, is_digit)) {
    return std::nullopt;
  }
  return std::stoi(text);
}

std::vector<std::string> MakeFamilies() {
  std::vector<std::string> names;
  for (const char* bits : {"4x4", "5x5", "6x6", "7x7"}) {
    for (const char* count : {"50", "100", "250", "1000"}) {
      names.push_back(std::string("aruco") + bits + "_" + count);
    }
  }
  names.insert(names.end(), {"aruco_original", "tag16h5", "tag25h9", "tag36h10", "tag36h11"});
  return names;
}

}  // namespace

const std::vector<std::string>& TagFamilies() {
  static const std::vector<std::string> families = MakeFamilies();
  return families;
}

std::optional<TagName> ParseTagName(const std::string& name) {
  const size_t colon = name.find(':');
  const auto id = ParseId(colon == std::string::npos ? name : name.substr(colon + 1));
  if (!id) return std::nullopt;
  if (colon == std::string::npos) return TagName{-1, *id};
  const auto family = std::ranges::find(TagFamilies(), name.substr(0, colon));
  if (family == TagFamilies().end()) return std::nullopt;
  return TagName{static_cast<int>(family - TagFamilies().begin()), *id};
}

}  // namespace slcmap::data
