// What a comparison of methods found, as its reports tell it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/compare/figures.h"
#include "apps/evaluation/truth.h"
#include "data/io/map_line.h"
#include "data/io/trajectory.h"

namespace slcmap::inline evaluation {

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

// The figures that some method of a sequence has.
std::vector<FigureInfo> SelectFigures(const SequenceResult& sequence, FigureGroup group,
                                      bool in_table_only);

nlohmann::ordered_json ComparisonJson(const Comparison& comparison);
std::string ComparisonCsv(const Comparison& comparison);    // a row a method and figure
std::string ComparisonTable(const Comparison& comparison);  // for a terminal
// One HTML page that needs nothing beside it: tables, bars with their spread, trajectories over the
// truth, line maps side by side and cost by stage, drawn as SVG.
std::string ComparisonPage(const Comparison& comparison);

// Which measures were made without truth, and what the floor under them is, in words.
std::vector<std::string> NotesOn(const SequenceResult& sequence, int repeats);

}  // namespace slcmap::evaluation
