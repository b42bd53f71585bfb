// The figures that methods are compared by: one list, which all tables, files and plots follow.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace slcmap {

enum class FigureGroup { kTrajectory, kStraightness, kLines, kDenseMap, kCost };

// In the order of the tables.
inline constexpr FigureGroup kFigureGroups[] = {FigureGroup::kTrajectory,
                                                FigureGroup::kStraightness, FigureGroup::kLines,
                                                FigureGroup::kDenseMap, FigureGroup::kCost};

struct FigureInfo {
  const char* key;    // in files; names the unit
  const char* label;  // for people
  const char* unit;
  FigureGroup group;
  int digits;
  bool less_is_better = true;
  bool needs_truth = false;
  bool in_table = true;  // of the terminal, LaTeX and the page; files hold all
};

// In the order of the tables.
const std::vector<FigureInfo>& AllFigures();
const FigureInfo& FigureOf(const std::string& key);  // throws std::out_of_range
// What a figure is of, as a sentence for people. Throws std::out_of_range.
std::string MeaningOf(const std::string& key);
std::string GroupTitle(FigureGroup group);

// Values by key; a figure that could not be measured is not in it.
using Figures = std::map<std::string, double>;

}  // namespace slcmap
