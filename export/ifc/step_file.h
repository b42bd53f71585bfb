// Text of a STEP file (ISO 10303-21): one entity a line, numbered in the order in which they are
// added.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace slcmap {

inline constexpr const char* kStepUnset = "$";
inline constexpr const char* kStepDerived = "*";

// Attributes as the file holds them. Numbers have six decimals, a micrometre, or as many as said;
// throws DataError for one that is not finite.
std::string StepReal(double value, int decimals = 6);
std::string StepText(std::string_view utf8);  // in quotes
std::string StepBool(bool value);
std::string StepList(const std::vector<std::string>& values);

class StepFile {
 public:
  // Adds an entity, its attributes as above, and returns the reference to it, as "#12".
  std::string Add(std::string_view type, const std::vector<std::string>& attributes);

  // Adds an entity unless there is one that says the same: of things without identity.
  std::string Share(std::string_view type, const std::vector<std::string>& attributes);

  // The whole file. Its stamp is always the same, so that one map gives the same bytes each time.
  std::string Text(std::string_view name, std::string_view schema, std::string_view view,
                   std::string_view writer) const;

 private:
  int count_ = 0;
  std::string data_;
  std::map<std::string, std::string> shared_;
};

}  // namespace slcmap
