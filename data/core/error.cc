#include "data/core/error.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace slcmap::inline data {

void Warnings::Add(const std::string& kind, const std::string& place) {
  Entry& entry = entries_[kind];
  if (entry.count++ != 0) return;
  entry.first_place = place;
  spdlog::warn("{}: {} (from here on only counted)", place, InWords(kind));
}

std::string Warnings::InWords(const std::string& kind) {
  std::string words = kind;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

void Warnings::Merge(const Warnings& other) {
  for (const auto& [kind, added] : other.entries_) {
    Entry& entry = entries_[kind];
    if (entry.count == 0) entry.first_place = added.first_place;
    entry.count += added.count;
  }
}

int64_t Warnings::Count(const std::string& kind) const {
  const auto found = entries_.find(kind);
  return found == entries_.end() ? 0 : found->second.count;
}

}  // namespace slcmap::data
