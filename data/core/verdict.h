// What a run says of itself.
#pragma once

#include <string>
#include <vector>

namespace slcmap::inline data {

enum class VerdictLevel { kGood, kDoubtful, kFailed };

// Of the reason that an estimator lost itself: what is behind that is shifted.
inline constexpr const char* kLostReason = "lost";
inline constexpr const char* kScaleReason = "scale";

// Why a verdict is what it is; what is good but had better be known is a reason too.
struct VerdictReason {
  VerdictLevel level = VerdictLevel::kGood;
  std::string what;  // a word for scripts, such as "points-rejected"
  std::string found, expected, remedy;
};

struct Verdict {
  VerdictLevel level = VerdictLevel::kGood;  // that of the worst reason
  std::vector<VerdictReason> reasons;        // the worst first

  // Keeps the order.
  void Add(VerdictReason reason);
  // Takes a reason back that holds no longer.
  void Withdraw(const std::string& what);
};

std::string VerdictLevelName(VerdictLevel level);  // good, doubtful, failed
// Throws DataError naming `place` where there is no such level.
VerdictLevel VerdictLevelFromName(const std::string& place, const std::string& name);

// A line a reason: "points-rejected: found ..., expected ...; remedy: ...".
std::string InWords(const VerdictReason& reason);

}  // namespace slcmap::data
