// Changes inputs at random, the same way for the same seed.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace slcmap::fuzz {

class Mutator {
 public:
  explicit Mutator(uint32_t seed) : generator_(seed) {}

  // One to four changes of `input`, with pieces of `other` here and there; at most 64 kB.
  std::string Mutate(const std::string& input, const std::string& other);

  size_t Below(size_t count) { return count == 0 ? 0 : generator_() % count; }

 private:
  void ChangeBytes(std::string* text);
  void ChangeRows(std::string* text);
  void ChangeField(std::string* text);
  void Splice(const std::string& other, std::string* text);

  std::mt19937 generator_;
};

}  // namespace slcmap::fuzz
