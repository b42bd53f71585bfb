#include "apps/maps/measured_map.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/evaluation/report.h"
#include "data/core/error.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Vector3d;

constexpr double kRival = 0.9;  // of the overlap, for another place to be as good

// Half a centimetre: of metres that is about 100 km off the origin, as in UTM.
constexpr double kCoarseStep_m = 0.005;

ExternalMap ReadScaled(const std::string& path, double scale) {
  ExternalMap map = ReadExternalMap(path);
  if (map.float_step * scale > kCoarseStep_m) {
    spdlog::warn(
        "{}: found single-precision coordinates in steps of {:.3g} m, so far are they from their "
        "origin, expected steps below {:g} m; write doubles, or subtract an origin",
        path, map.float_step * scale, kCoarseStep_m);
  }
  if (scale == 1) return map;
  for (Vector3d& p : map.points) p *= scale;
  for (Vector3d& p : map.filled) p *= scale;
  for (PlySegment& line : map.lines) line.start_world *= scale, line.end_world *= scale;
  for (auto& triangle : map.triangles) {
    for (Vector3d& p : triangle) p *= scale;
  }
  return map;
}

std::unique_ptr<TrueScan> ReadTruth(const MapsToMeasure& maps) {
  if (maps.truth.empty()) return nullptr;
  const ExternalMap scan = ReadScaled(maps.truth, maps.true_scale);
  std::vector<Vector3d> points = SurfacePoints(scan);
  if (points.empty()) {
    throw DataError(
        fmt::format("{} ({}): found lines alone, expected the points or faces of a "
                    "scan; true edges go with --true-edges",
                    maps.truth, scan.format));
  }
  RefuseOtherUnits(maps.truth, points);
  auto truth = std::make_unique<TrueScan>(std::move(points));
  if (truth->map.planes() == 0) {
    throw DataError(fmt::format(
        "{}: found {} points on no surface, expected a scan of a building, with points at most "
        "some 20 cm apart",
        maps.truth, truth->map.points().size()));
  }
  return truth;
}

ScanPlacement Place(const std::string& path, const MapSamples& samples, const TrueScan& truth,
                    bool as_they_are) {
  const ScanPlacement placed = PlaceOnTruth(path, samples, truth, as_they_are);
  if (placed.rival >= kRival * placed.overlap) {
    spdlog::warn(
        "{}: fits the truth elsewhere about as well ({:.0f} against {:.0f} % of it); lay it there "
        "yourself and measure --as-they-are",
        path, 100 * placed.rival, 100 * placed.overlap);
  }
  return placed;
}

MeasuredMap Measure(const NamedMap& named, const TrueScan* truth, bool as_they_are) {
  const ExternalMap map = ReadScaled(named.path, named.scale);
  MeasuredMap measured{named.name, named.path, map.format, {}, {}, {}, {}, {}, {}, {}};
  measured.points = static_cast<int64_t>(map.points.size());
  measured.filled = static_cast<int64_t>(map.filled.size());
  measured.triangles = static_cast<int64_t>(map.triangles.size());
  measured.lines = static_cast<int64_t>(map.lines.size());
  std::vector<Vector3d> points = SurfacePoints(map);
  std::vector<Vector3d> ends;
  for (const PlySegment& line : map.lines) ends.push_back(line.start_world);
  RefuseOtherUnits(named.path, points.empty() ? ends : points);
  MapOnScan placed;
  placed.lines = &map.lines;
  placed.filled = &map.filled;
  MapSamples samples;
  std::optional<SurfaceMap> surfaces;
  std::vector<FoundFace> faces;
  if (!points.empty()) {
    surfaces.emplace(std::move(points));
    samples = SampleSurfaces(*surfaces);
    if (as_they_are && samples.axes.is_z_up) {
      samples.axes = WithUp(samples.axes, Vector3d::UnitZ());
      samples.axes.tilt_deg = kNoFigure;
    }
    faces = FindFaces(*surfaces, samples.axes.axes.col(2));
    measured.walls = MeasureWalls(*surfaces, samples.axes, faces);
    placed.map = &*surfaces;
    placed.faces = &faces;
  }
  if (!map.lines.empty()) measured.edges = MeasureLines(map.lines);
  if (samples.places.empty()) {
    if (map.lines.empty()) {
      throw DataError(fmt::format(
          "{}: found {} points on no surface, expected a dense cloud: points of walls at most some "
          "20 cm apart",
          named.path, measured.points));
    }
    samples = SampleLines(map.lines);
    placed.map = nullptr;
  }
  if (truth) {
    placed.placement = Place(named.path, samples, *truth, as_they_are);
    measured.truth = MeasureAgreement(placed, *truth);
  }
  return measured;
}

}  // namespace

MapMeasures MeasureMaps(const MapsToMeasure& maps, const Progress& progress) {
  MapMeasures measured;
  std::vector<std::string> failures;
  const std::unique_ptr<TrueScan> truth = ReadTruth(maps);
  const auto count = static_cast<double>(maps.maps.size());
  for (const NamedMap& named : maps.maps) {
    const auto done = static_cast<double>(measured.maps.size() + failures.size());
    progress.ReportOrStop(done / count);
    try {
      measured.maps.push_back(Measure(named, truth.get(), maps.as_they_are));
    } catch (const DataError& error) {
      failures.emplace_back(error.what());
    }
  }
  measured.failures = fmt::format("{}", fmt::join(failures, "; "));
  if (measured.maps.empty()) throw DataError(measured.failures);
  return measured;
}

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

// A value of a part of what was measured, a member or a function of it; of a map without that part
// no figure.
template <typename Part, typename Value>
std::function<double(const MeasuredMap&)> Of(std::optional<Part> MeasuredMap::*part, Value value) {
  return [=](const MeasuredMap& m) {
    return m.*part ? static_cast<double>(std::invoke(value, *(m.*part))) : kNoFigure;
  };
}

template <typename Part>
EdgesOf GetStraightedges(std::optional<Part> MeasuredMap::*part,
                         std::vector<StraightedgeFigures> Part::*edges) {
  return [=](const MeasuredMap& m) { return m.*part ? &((*(m.*part)).*edges) : nullptr; };
}

using Walls = WallStraightness;
using Lines = LineStraightness;
using Truth = TruthAgreement;

void AddWallFigures(std::vector<MapFigure>* f) {
  f->push_back({"walls", "walls", "", 0, Of(&MeasuredMap::walls, &Walls::walls)});
  f->push_back(
      {"wall_length_m", "their length", "m", 1, Of(&MeasuredMap::walls, &Walls::length_m)});
  AddStraightedges("wall", "wall", GetStraightedges(&MeasuredMap::walls, &Walls::straightedges),
                   true, f);
  f->push_back({"thickness_mm", "thickness (MPV)", "mm", 2,
                Of(&MeasuredMap::walls, [](const Walls& w) { return 1e3 * w.thickness_m; })});
  f->push_back({"mme_nats", "map entropy (MME)", "nats", 2, Of(&MeasuredMap::walls, &Walls::mme)});
  f->push_back({"lean_rms_mm", "lean over a storey, RMS", "mm", 1,
                Of(&MeasuredMap::walls, [](const Walls& w) { return 1e3 * w.lean_rms_m; })});
  f->push_back({"angle_rms_deg", "angles of walls off 90, RMS", "deg", 3,
                Of(&MeasuredMap::walls, &Walls::angle_rms_deg)});
  f->push_back({"tilt_deg", "tilt of z", "deg", 3, Of(&MeasuredMap::walls, &Walls::tilt_deg)});
}

void AddLineFigures(std::vector<MapFigure>* f) {
  f->push_back(
      {"edge_length_m", "length of edges, once", "m", 1, Of(&MeasuredMap::edges, &Lines::edges_m)});
  f->push_back({"redundancy", "length of lines over that", "", 2,
                Of(&MeasuredMap::edges, [](const Lines& l) { return l.length_m / l.edges_m; })});
  AddStraightedges("edge", "edge", GetStraightedges(&MeasuredMap::edges, &Lines::straightedges),
                   true, f);
  const auto of_directions = [](auto value) {
    return Of(&MeasuredMap::edges,
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
                Of(&MeasuredMap::truth, [](const Truth& t) { return 100 * t.placement.overlap; })});
  f->push_back({"truth_rms_mm", "off the truth, RMS", "mm", 1,
                Of(&MeasuredMap::truth, [](const Truth& t) { return 1e3 * t.rms_m; })});
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
                    Of(&MeasuredMap::truth, [i, figure = column.figure](const Truth& t) {
                      return 100 * (t.scores[i].*figure);
                    })});
    }
  }
  AddStraightedges("bend", "bend against the truth",
                   GetStraightedges(&MeasuredMap::truth, &Truth::bends), false, f);
  f->push_back({"bend_whole_mm", "bend of a whole wall, worst", "mm", 1,
                Of(&MeasuredMap::truth, [](const Truth& t) { return 1e3 * t.whole_bend_m; })});
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
    std::map<int64_t, std::vector<std::string>> names;  // by hundredths of a mm, as printed
    size_t have = 0, laid = 0;
    for (const MeasuredMap& map : maps) {
      const auto* all = of(map);
      if (!all || all->empty() || all->front().pieces == 0) continue;
      ++have;
      const double rms_mm = OfEdge(*all, i, Rms_mm);
      if (std::isnan(rms_mm)) continue;
      names[std::llround(100 * rms_mm)].push_back(map.name);
      ++laid;
    }
    if (have == 0) return "";
    if (laid < have) continue;
    std::vector<std::string> words;
    for (const auto& [hundredths, tied] : names) {
      words.push_back(fmt::format("{} {:.2f} mm", fmt::join(tied, " and "),
                                  static_cast<double>(hundredths) / 100));
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
       {RankBy(maps, "walls", GetStraightedges(&MeasuredMap::walls, &Walls::straightedges)),
        RankBy(maps, "edges", GetStraightedges(&MeasuredMap::edges, &Lines::straightedges))}) {
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
