// Means of repeated runs with their spread, and which order of methods the spread bears.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slcmap {

struct Spread {
  int count = 0;
  double mean = 0;
  double deviation = 0;  // standard deviation of one run; 0 of fewer than two
};
Spread SpreadOf(const std::vector<double>& values);

// "12.3 +- 0.4"; without the second where there is none, and "-" without a run.
std::string SpreadText(const Spread& spread, int digits);

// True where a mean is below another by more than twice the standard error of their difference.
// Two means of which one is of a single run are never told apart: nothing says how far it scatters.
bool IsBelow(const Spread& a, const Spread& b);

struct Ranked {
  std::string name;
  Spread spread;
};

// The index of the one that is better than every other, where the spread bears that.
std::optional<size_t> BestOf(const std::vector<Ranked>& methods, bool less_is_better);

// The order in words, as far as the spread bears it: "slc before points and points-lines, points
// before points-lines", or why there is none.
std::string OrderInWords(const std::vector<Ranked>& methods, bool less_is_better);

}  // namespace slcmap
