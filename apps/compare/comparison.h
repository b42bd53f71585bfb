// What a comparison of methods found, as its reports tell it: figures, how they spread over
// repeats, and who is best.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/truth.h"
#include "data/io/map_line.h"
#include "data/io/trajectory.h"

namespace slcmap::inline evaluation {

// Titles of what figures tell of, in the order of the tables.
inline constexpr const char* kFigureGroups[] = {"Trajectory, against the truth",
                                                "Straightness, all with the same observations",
                                                "Line map, against true edges", "Cost of odometry"};

struct FigureInfo {
  const char* key;    // in files; names the unit
  const char* label;  // for people
  const char* unit;
  const char* group;  // of kFigureGroups
  int digits;
  const char* meaning;  // what it is of, as a sentence
  bool less_is_better = true;
  bool needs_truth = false;
  bool in_table = true;  // of the terminal and the page; files hold all
};

// In the order of the tables.
const std::vector<FigureInfo>& AllFigures();
const FigureInfo& FindFigure(const std::string& key);  // throws std::out_of_range

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

// The results.

struct StageCost {
  std::string name;
  double ms_a_pair = 0;  // wall time
};

// One method (or setting, or trajectory of another system) on one sequence.
struct MethodResult {
  std::string name;
  std::vector<Figures> repeats;      // of the runs that gave any
  std::vector<std::string> remarks;  // what a reader has to know: failures, low coverage
  // Of the first run, for pictures; in the world of the truth where there is one.
  Trajectory trajectory;       // final poses
  std::vector<MapLine> lines;  // of its sparse map
  std::vector<StageCost> stages;

  std::vector<double> Values(const std::string& key) const;
};

struct SequenceResult {
  std::string name, path;
  double length_m = 0, duration_s = 0;
  bool true_poses = false, true_edges = false;
  bool truth_is_floor = false;  // with true poses edges are thinner than with any method's
  std::string reference;        // whose observations all were measured with, in words
  Figures with_true_poses;      // straightness: what observations and building have of their own
  Trajectory truth;
  std::vector<PlySegment> edges;  // true ones that were seen
  std::vector<MethodResult> methods;

  // Of a figure, those methods that have it, in their order.
  std::vector<Ranked> Of(const FigureInfo& figure) const;
};

struct Comparison {
  std::string version, date, machine, command;
  int repeats = 1;
  std::vector<SequenceResult> sequences;
};

// The figures of a table that some method of a sequence has.
std::vector<FigureInfo> SelectFigures(const SequenceResult& sequence, const char* group);

nlohmann::ordered_json ComparisonJson(const Comparison& comparison);
std::string ComparisonCsv(const Comparison& comparison);    // a row a method and figure
std::string ComparisonTable(const Comparison& comparison);  // for a terminal
// One HTML page that needs nothing beside it: tables, bars with their spread, trajectories over the
// truth, line maps side by side and cost by stage, drawn as SVG.
std::string ComparisonPage(const Comparison& comparison);

// Which measures were made without truth, and what the floor under them is, in words.
std::vector<std::string> NotesOn(const SequenceResult& sequence, int repeats);

}  // namespace slcmap::evaluation
