// The arrays of a page and where they are among its bytes.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace slcmap {

// As the page's scripts know the type of an array.
template <typename Value>
constexpr const char* PageType() {
  if constexpr (std::same_as<Value, double>) return "f64";
  if constexpr (std::same_as<Value, float>) return "f32";
  if constexpr (std::same_as<Value, int32_t>) return "i32";
  if constexpr (std::same_as<Value, uint16_t>) return "u16";
  if constexpr (std::same_as<Value, uint8_t>) return "u8";
}

// Arrays of numbers, one behind the other.
class PageArrays {
 public:
  static_assert(std::endian::native == std::endian::little, "pages are little-endian");

  struct Entry {
    std::string name, type;
    std::size_t offset = 0, count = 0;
  };

  template <typename Value>
  void Add(const std::string& name, const std::vector<Value>& values) {
    entries_.push_back({name, PageType<Value>(), bytes_.size(), values.size()});
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
    bytes_.append((kAlignment - bytes_.size() % kAlignment) % kAlignment, '\0');
  }

  const std::vector<Entry>& entries() const { return entries_; }
  const std::string& bytes() const { return bytes_; }

  static constexpr std::size_t kAlignment = 8;  // of the largest type

 private:
  std::vector<Entry> entries_;
  std::string bytes_;
};

}  // namespace slcmap
