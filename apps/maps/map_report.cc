#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "apps/evaluation/report.h"
#include "apps/maps/measured_map.h"

namespace slcmap::inline evaluation {
namespace {

using Json = nlohmann::ordered_json;

// A row of all forms of the report.
struct MapFigure {
  std::string key, label, unit;
  int digits = 1;
  std::function<double(const MeasuredMap&)> value;  // kNoFigure of none
};

double OfEdge(const std::vector<StraightedgeFigures>& all, size_t i,
              double (*figure)(const StraightedgeFigures&)) {
  return i < all.size() && all[i].pieces > 0 ? figure(all[i]) : kNoFigure;
}

double Rms_mm(const StraightedgeFigures& f) { return 1e3 * f.rms_m; }
double GapMedian_mm(const StraightedgeFigures& f) { return 1e3 * f.gap_median_m; }
double GapWorst_mm(const StraightedgeFigures& f) { return 1e3 * f.gap_worst_m; }
double WithinDin(const StraightedgeFigures& f) {
  return 100 * static_cast<double>(f.within_din) / static_cast<double>(f.pieces);
}

using EdgesOf = std::function<const std::vector<StraightedgeFigures>*(const MeasuredMap&)>;

// Rows of a kind of straightedges: "wall", "edge" or "bend".
void AddStraightedges(const std::string& key, const std::string& label, const EdgesOf& of, bool rms,
                      std::vector<MapFigure>* figures) {
  struct Column {
    const char *key, *label, *unit;
    double (*figure)(const StraightedgeFigures&);
  };
  std::vector<Column> columns = {{"gap_median", "gap, median", "mm", GapMedian_mm},
                                 {"gap_worst", "gap, worst", "mm", GapWorst_mm},
                                 {"within_din_18202", "within DIN 18202", "%", WithinDin}};
  if (rms) columns.insert(columns.begin(), {"rms", "RMS", "mm", Rms_mm});
  for (const Column& column : columns) {
    for (size_t i = 0; i < std::size(kMapStraightedges_m); ++i) {
      figures->push_back(
          {fmt::format("{}_{}_{:g}m_{}", key, column.key, kMapStraightedges_m[i],
                       std::string(column.unit) == "%" ? "percent" : column.unit),
           fmt::format("{}, {:g} m: {}", label, kMapStraightedges_m[i], column.label), column.unit,
           1, [of, i, figure = column.figure](const MeasuredMap& map) {
             const auto* all = of(map);
             return all ? OfEdge(*all, i, figure) : kNoFigure;
           }});
    }
  }
}

template <typename Value>
std::function<double(const MeasuredMap&)> OfWalls(Value value) {
  return [value](const MeasuredMap& m) { return m.walls ? double(value(*m.walls)) : kNoFigure; };
}
template <typename Value>
std::function<double(const MeasuredMap&)> OfLines(Value value) {
  return [value](const MeasuredMap& m) { return m.edges ? double(value(*m.edges)) : kNoFigure; };
}
template <typename Value>
std::function<double(const MeasuredMap&)> OfTruth(Value value) {
  return [value](const MeasuredMap& m) { return m.truth ? double(value(*m.truth)) : kNoFigure; };
}

using Walls = WallStraightness;
using Lines = LineStraightness;
using Truth = TruthAgreement;

void AddWallFigures(std::vector<MapFigure>* f) {
  f->push_back({"walls", "walls", "", 0, OfWalls([](const Walls& w) { return w.walls; })});
  f->push_back({"wall_length_m", "their length", "m", 1,
                OfWalls([](const Walls& w) { return w.length_m; })});
  AddStraightedges(
      "wall", "wall",
      [](const MeasuredMap& m) { return m.walls ? &m.walls->straightedges : nullptr; }, true, f);
  f->push_back({"thickness_mm", "thickness (MPV)", "mm", 2,
                OfWalls([](const Walls& w) { return 1e3 * w.thickness_m; })});
  f->push_back(
      {"mme_nats", "map entropy (MME)", "nats", 2, OfWalls([](const Walls& w) { return w.mme; })});
  f->push_back({"lean_rms_mm", "lean over a storey, RMS", "mm", 1,
                OfWalls([](const Walls& w) { return 1e3 * w.lean_rms_m; })});
  f->push_back({"angle_rms_deg", "angles of walls off 90, RMS", "deg", 3,
                OfWalls([](const Walls& w) { return w.angle_rms_deg; })});
  f->push_back(
      {"tilt_deg", "tilt of z", "deg", 3, OfWalls([](const Walls& w) { return w.tilt_deg; })});
}

void AddLineFigures(std::vector<MapFigure>* f) {
  f->push_back({"edge_length_m", "length of edges, once", "m", 1,
                OfLines([](const Lines& l) { return l.edges_m; })});
  f->push_back({"redundancy", "length of lines over that", "", 2,
                OfLines([](const Lines& l) { return l.length_m / l.edges_m; })});
  AddStraightedges(
      "edge", "edge",
      [](const MeasuredMap& m) { return m.edges ? &m.edges->straightedges : nullptr; }, true, f);
  const auto of_directions = [](auto value) {
    return OfLines(
        [value](const Lines& l) { return l.directions ? value(*l.directions) : kNoFigure; });
  };
  f->push_back({"dispersion_deg", "directions off three axes, RMS", "deg", 3,
                of_directions([](const DirectionMetrics& d) { return d.dispersion_deg; })});
  f->push_back({"following_percent", "of the length along them", "%", 1,
                of_directions([](const DirectionMetrics& d) { return 100 * d.following; })});
  f->push_back({"orthogonality_deg", "axes off 90, fitted alone", "deg", 3,
                of_directions([](const DirectionMetrics& d) {
                  return d.orthogonality_deg.value_or(kNoFigure);
                })});
}

void AddTruthFigures(std::vector<MapFigure>* f) {
  f->push_back({"overlap_percent", "on the truth (10 cm)", "%", 1,
                OfTruth([](const Truth& t) { return 100 * t.placement.overlap; })});
  f->push_back({"truth_rms_mm", "off the truth, RMS", "mm", 1,
                OfTruth([](const Truth& t) { return 1e3 * t.rms_m; })});
  struct Column {
    const char *key, *label;
    double AgreementScore::*figure;
  };
  for (const Column& column :
       {Column{"accuracy", "accuracy", &AgreementScore::accuracy},
        Column{"completeness", "completeness", &AgreementScore::completeness},
        Column{"f", "F", &AgreementScore::f}}) {
    for (size_t i = 0; i < 3; ++i) {
      const int cm[] = {2, 5, 10};
      f->push_back({fmt::format("{}_{}cm_percent", column.key, cm[i]),
                    fmt::format("{} at {} cm", column.label, cm[i]), "%", 1,
                    OfTruth([i, figure = column.figure](const Truth& t) {
                      return 100 * (t.scores[i].*figure);
                    })});
    }
  }
  AddStraightedges(
      "bend", "bend against the truth",
      [](const MeasuredMap& m) { return m.truth ? &m.truth->bends : nullptr; }, false, f);
  f->push_back({"bend_whole_mm", "bend of a whole wall, worst", "mm", 1,
                OfTruth([](const Truth& t) { return 1e3 * t.whole_bend_m; })});
}

const std::vector<MapFigure>& AllFigures() {
  static const std::vector<MapFigure> all = [] {
    std::vector<MapFigure> figures;
    AddWallFigures(&figures);
    AddLineFigures(&figures);
    AddTruthFigures(&figures);
    return figures;
  }();
  return all;
}

bool IsKnown(const MapFigure& figure, const std::vector<MeasuredMap>& maps) {
  return std::any_of(maps.begin(), maps.end(),
                     [&](const MeasuredMap& m) { return !std::isnan(figure.value(m)); });
}

std::string Contents(const MeasuredMap& map) {
  std::string text = map.format;
  if (map.points > 0) text += fmt::format(", {} points", map.points);
  if (map.filled > 0) text += fmt::format(" and {} filled", map.filled);
  if (map.triangles > 0) text += fmt::format(", {} faces", map.triangles);
  if (map.lines > 0) text += fmt::format(", {} lines", map.lines);
  return text;
}

// Which is the straightest of those that a straightedge can be laid on.
std::string RankBy(const std::vector<MeasuredMap>& maps, const std::string& what,
                   const EdgesOf& of) {
  for (size_t i = std::size(kMapStraightedges_m); i-- > 0;) {
    std::vector<std::pair<double, std::string>> sorted;
    size_t have = 0;
    for (const MeasuredMap& map : maps) {
      const auto* all = of(map);
      if (!all || all->empty() || all->front().pieces == 0) continue;
      ++have;
      const double rms_mm = OfEdge(*all, i, Rms_mm);
      if (!std::isnan(rms_mm)) sorted.emplace_back(rms_mm, map.name);
    }
    if (have == 0) return "";
    if (sorted.size() < have) continue;
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::string> words;
    for (const auto& [rms_mm, name] : sorted) {
      words.push_back(fmt::format("{} {:.2f} mm", name, rms_mm));
    }
    return fmt::format("{} under straightedges of {:g} m, the straightest first: {}", what,
                       kMapStraightedges_m[i], fmt::join(words, ", "));
  }
  return "";
}

std::string Row(const std::string& label, const std::vector<std::string>& cells) {
  std::string row = fmt::format("{:<42}", label);
  for (const std::string& cell : cells) row += fmt::format("{:>14}", cell);
  return row + "\n";
}

std::vector<std::string> Cells(const MapFigure& figure, const std::vector<MeasuredMap>& maps) {
  std::vector<std::string> cells;
  for (const MeasuredMap& map : maps) {
    cells.push_back(FigureText(figure.value(map), figure.digits));
  }
  return cells;
}

std::string LabelWithUnit(const MapFigure& figure) {
  return figure.unit.empty() ? figure.label : figure.label + " [" + figure.unit + "]";
}

}  // namespace

std::vector<std::string> Ranking(const std::vector<MeasuredMap>& maps) {
  std::vector<std::string> ranking;
  for (const std::string& words :
       {RankBy(maps, "walls",
               [](const MeasuredMap& m) { return m.walls ? &m.walls->straightedges : nullptr; }),
        RankBy(maps, "edges",
               [](const MeasuredMap& m) { return m.edges ? &m.edges->straightedges : nullptr; })}) {
    if (!words.empty()) ranking.push_back(words);
  }
  return ranking;
}

std::string MapTable(const std::vector<MeasuredMap>& maps) {
  std::string text;
  std::vector<std::string> names;
  for (const MeasuredMap& map : maps) {
    text += fmt::format("{:<14} {}\n", map.name, Contents(map));
    names.push_back(map.name);
  }
  text += "\n" + Row("", names);
  for (const MapFigure& figure : AllFigures()) {
    if (IsKnown(figure, maps)) text += Row(LabelWithUnit(figure), Cells(figure, maps));
  }
  for (const std::string& words : Ranking(maps)) text += "\n" + words;
  return text + "\n";
}

std::string MapCsv(const std::vector<MeasuredMap>& maps) {
  std::string text = "map,figure,value\n";
  for (const MeasuredMap& map : maps) {
    for (const MapFigure& figure : AllFigures()) {
      const double value = figure.value(map);
      if (!std::isnan(value)) text += fmt::format("{},{},{:.9g}\n", map.name, figure.key, value);
    }
  }
  return text;
}

Json MapsJson(const std::vector<MeasuredMap>& maps) {
  Json json = {{"ranking", Ranking(maps)}, {"maps", Json::array()}};
  for (const MeasuredMap& map : maps) {
    Json one = {{"name", map.name},     {"path", map.path},         {"format", map.format},
                {"points", map.points}, {"filled", map.filled},     {"faces", map.triangles},
                {"lines", map.lines},   {"figures", Json::object()}};
    for (const MapFigure& figure : AllFigures()) {
      const double value = figure.value(map);
      one["figures"][figure.key] = std::isnan(value) ? Json() : Json(value);
    }
    if (map.truth) {
      const Eigen::Matrix4d T = map.truth->placement.T_truth_map.Matrix();
      one["T_truth_map"] = Json::array();
      for (int row = 0; row < 4; ++row) {
        one["T_truth_map"].push_back({T(row, 0), T(row, 1), T(row, 2), T(row, 3)});
      }
      one["overlap_elsewhere"] = map.truth->placement.rival;
    }
    json["maps"].push_back(std::move(one));
  }
  return json;
}

}  // namespace slcmap::evaluation
