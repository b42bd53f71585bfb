// The figures that methods are compared by, and how they spread over repeats.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace slcmap::inline evaluation {

enum class FigureGroup { kTrajectory, kStraightness, kLines, kCost };

// In the order of the tables.
inline constexpr FigureGroup kFigureGroups[] = {
    FigureGroup::kTrajectory, FigureGroup::kStraightness, FigureGroup::kLines, FigureGroup::kCost};

struct FigureInfo {
  const char* key;    // in files; names the unit
  const char* label;  // for people
  const char* unit;
  FigureGroup group;
  int digits;
  bool less_is_better = true;
  bool needs_truth = false;
  bool in_table = true;  // of the terminal and the page; files hold all
};

// In the order of the tables.
const std::vector<FigureInfo>& AllFigures();
const FigureInfo& FindFigure(const std::string& key);  // throws std::out_of_range
// What a figure is of, as a sentence for people. Throws std::out_of_range.
std::string DescribeFigure(const std::string& key);
std::string GroupTitle(FigureGroup group);

// Values by key; a figure that could not be measured is not in it.
using Figures = std::map<std::string, double>;

// Means of repeated runs with their spread, and which order of methods the spread bears.

struct Spread {
  int count = 0;
  double mean = 0;
  double deviation = 0;  // standard deviation of one run; 0 of fewer than two
};
Spread ComputeSpread(const std::vector<double>& values);

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
std::optional<size_t> FindBestMethod(const std::vector<Ranked>& methods, bool less_is_better);

// The order in words, as far as the spread bears it: "slc before points and points-lines, points
// before points-lines", or why there is none.
std::string OrderInWords(const std::vector<Ranked>& methods, bool less_is_better);

}  // namespace slcmap::evaluation
