#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <regex>
#include <set>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/external/readers.h"
#include "data/io/csv.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector3d;

// Whether an object or layer is one of our own exports that shows no edge of the building.
bool IsOurAddition(std::string_view name) {
  static const std::regex kNames(
      "TRAJECTORY|(S-?[0-9]+_)?(X|Y|VERTICAL|OTHER|SLOPED)_(MARK|OUTLINE)|"
      "S-?[0-9]+_(WALL|FLOOR|CEILING|OTHER)_PLANE_OUTLINE");
  return std::regex_match(name.begin(), name.end(), kNames);
}

class ObjReader {
 public:
  ObjReader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  ExternalMap Read() {
    ForEachTextRow(bytes_, [&](int row, std::string_view text) {
      row_ = row;
      const auto words = SplitRow(text);
      if (words.size() < 2) return;
      if (words[0] == "v") AddVertex(words);
      if (words[0] == "o") is_left_out_ = IsOurAddition(words[1]);
      if (words[0] == "l" && !is_left_out_) AddLine(words);
      if (words[0] == "f") AddFace(words);
    });
    map_.format = !map_.triangles.empty() ? "OBJ with faces"
                  : map_.lines.empty()    ? "OBJ with points"
                                          : "OBJ with lines";
    if (map_.lines.empty() && map_.triangles.empty()) {
      for (const Vector3d& p : vertices_) AddPoint(p, &map_);
    }
    return std::move(map_);
  }

 private:
  using Words = std::vector<std::string_view>;

  [[noreturn]] void Fail(const std::string& what) const {
    throw DataError(fmt::format("{}: row {}: {}", path_, row_, what));
  }

  void AddVertex(const Words& words) {
    Vector3d p;
    for (size_t i = 0; i < 3; ++i) {
      const auto value = i + 1 < words.size() ? ParseNumber(words[i + 1]) : std::nullopt;
      if (!value) Fail("found a vertex without three numbers, expected 'v X Y Z'");
      p[static_cast<int>(i)] = *value;
    }
    vertices_.push_back(p);
  }

  // "7", "7/1", "7//3" or, from the last one back, "-1".
  const Vector3d& Vertex(std::string_view word) const {
    const auto number = ParseScaledInteger(word.substr(0, word.find('/')), 0);
    const auto count = static_cast<int64_t>(vertices_.size());
    const int64_t index = !number ? -1 : *number < 0 ? count + *number : *number - 1;
    if (index < 0 || index >= count) {
      Fail(fmt::format("found vertex '{}', expected one of the {} before it", word, count));
    }
    return vertices_[static_cast<size_t>(index)];
  }

  void AddLine(const Words& words) {
    for (size_t i = 2; i < words.size(); ++i) {
      map_.lines.push_back({Vertex(words[i - 1]), Vertex(words[i])});
    }
  }

  void AddFace(const Words& words) {
    for (size_t i = 3; i < words.size(); ++i) {
      map_.triangles.push_back({Vertex(words[1]), Vertex(words[i - 1]), Vertex(words[i])});
    }
  }

  const std::string& path_;
  const std::string_view bytes_;
  int row_ = 0;
  bool is_left_out_ = false;  // the object
  std::vector<Vector3d> vertices_;
  ExternalMap map_;
};

// Metres of a unit of $INSUNITS; 1 where it is not said.
double MetresOfDxfUnit(int64_t unit) {
  static const std::map<int64_t, double> kMetres = {
      {1, 0.0254},  {2, 0.3048},  {3, 1609.344}, {4, 0.001},         {5, 0.01},  {7, 1000},
      {8, 2.54e-8}, {9, 2.54e-5}, {10, 0.9144},  {11, 1e-10},        {12, 1e-9}, {13, 1e-6},
      {14, 0.1},    {15, 10},     {16, 100},     {21, 1200.0 / 3937}};
  const auto found = kMetres.find(unit);
  return found == kMetres.end() ? 1 : found->second;
}

// The places on an arc behind its first and before its last one.
void AddArc(const Vector3d& centre, const Vector3d& from, double turn_rad,
            std::vector<Vector3d>* places) {
  const int pieces = static_cast<int>(std::ceil(std::abs(turn_rad) / 0.15));
  for (int i = 1; i < pieces; ++i) {
    const Eigen::AngleAxisd turn(turn_rad * i / pieces, Vector3d::UnitZ());
    places->push_back(centre + turn * (from - centre));
  }
}

// Of a corner with a bulge, the tangent of a quarter of the turn to the next one.
void AddBulge(const Vector3d& from, const Vector3d& to, double bulge,
              std::vector<Vector3d>* places) {
  if (bulge == 0 || !std::isfinite(bulge)) return;
  const Vector3d chord = to - from, left(-chord.y(), chord.x(), 0);
  AddArc(from + chord / 2 + left * (1 - bulge * bulge) / (4 * bulge), from, 4 * std::atan(bulge),
         places);
}

// An entity of a DXF file: its type, and its numbers by their codes, in their order.
struct DxfEntity {
  std::string type, layer;
  std::map<int, std::vector<double>> values;

  double Get(int code, double otherwise) const {
    const auto found = values.find(code);
    return found == values.end() || found->second.empty() ? otherwise : found->second.front();
  }
  // The codes of the place number `corner`: 10, 20, 30 and so on.
  bool Has(int corner) const { return values.count(10 + corner) > 0; }
  Vector3d Place(int corner) const {
    return {Get(10 + corner, 0), Get(20 + corner, 0), Get(30 + corner, 0)};
  }
  // Seen from below: x and z of what is drawn in a plane then run the other way.
  bool IsMirrored() const { return Get(230, 1) < 0; }
};

constexpr int kBulge = 42;

class DxfReader {
 public:
  DxfReader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  DxfDrawing Read() {
    std::string_view code_text;
    ForEachTextRow(bytes_, [&](int row, std::string_view text) {
      if (row % 2 == 1) {
        code_text = text;
        return;
      }
      const auto fields = SplitRow(code_text);
      const auto code = fields.empty() ? std::nullopt : ParseScaledInteger(fields.front(), 0);
      if (!code) {
        throw DataError(fmt::format("{}: row {}: found '{}', expected the code of a DXF group",
                                    path_, row - 1, code_text));
      }
      Take(static_cast<int>(*code), text);
    });
    EndPolyline();
    Scale();
    if (!is_ended_) {
      spdlog::warn(
          "{}: found no EOF at its end: it was cut short, or not written to its end; what is "
          "there is taken",
          path_);
    }
    for (const auto& [type, count] : left_out_) {
      spdlog::warn("{}: left out {} of {}; explode them in CAD where they matter", path_, count,
                   type == "INSERT" ? "INSERT (blocks)" : type);
    }
    return std::move(drawing_);
  }

 private:
  void Take(int code, std::string_view text) {
    if (code == 0) {
      Finish();
      is_ended_ = text.starts_with("EOF");
      entity_ = {std::string(text), {}, {}};
      return;
    }
    if (code == 8) entity_.layer = text;
    if (code == 9) variable_ = text;
    if (code == 2 && entity_.type == "SECTION") in_entities_ = text == "ENTITIES";
    const bool is_number =
        (code >= 10 && code < 80) || (code >= 140 && code < 148) || (code >= 210 && code < 240);
    if (!is_number) return;
    const auto fields = SplitRow(text);
    const auto value = fields.empty() ? std::nullopt : ParseNumber(fields.front());
    if (!value) return;
    if (variable_ == "$INSUNITS" && code == 70 && !in_entities_) {
      metres_ = MetresOfDxfUnit(static_cast<int64_t>(*value));
      variable_ = {};
    }
    std::vector<double>& bulges = entity_.values[kBulge];
    if (code == 10) bulges.push_back(0);  // until one is said
    if (code == kBulge && !bulges.empty()) {
      bulges.back() = *value;
    } else {
      entity_.values[code].push_back(*value);
    }
  }

  // Adds the entity that is complete.
  void Finish() {
    if (!in_entities_ || entity_.Get(67, 0) == 1) return;  // 67: on paper, at its scale
    const std::string& type = entity_.type;
    if (type == "LINE") {
      drawing_.lines.push_back({entity_.layer, {entity_.Place(0), entity_.Place(1)}});
    }
    if (type == "POINT") drawing_.points.push_back(entity_.Place(0));
    if (type == "3DFACE") AddFace();
    if (type == "LWPOLYLINE") AddLightPolyline();
    if (type == "ARC" || type == "CIRCLE") AddCircle();
    static const std::set<std::string> kLeftOut = {"INSERT", "SPLINE", "ELLIPSE", "MLINE"};
    if (kLeftOut.contains(type)) ++left_out_[type];
    if (type == "POLYLINE") {
      EndPolyline();
      StartPolyline();
    }
    if (type == "VERTEX") AddVertex();
    if (type == "SEQEND") EndPolyline();
    entity_ = {};
  }

  void AddFace() {
    const Vector3d a = entity_.Place(0), b = entity_.Place(1), c = entity_.Place(2);
    drawing_.triangles.push_back({a, b, c});
    if (entity_.Has(3) && entity_.Place(3) != c) {
      drawing_.triangles.push_back({a, c, entity_.Place(3)});
    }
  }

  void AddLightPolyline() {
    const std::vector<double>&x = entity_.values[10], &y = entity_.values[20];
    for (size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
      polyline_.emplace_back(x[i], y[i], entity_.Get(38, 0));
    }
    bulges_ = entity_.values[kBulge];
    StartPolyline();
    EndPolyline();
  }

  void StartPolyline() {
    flags_ = static_cast<int>(entity_.Get(70, 0));
    layer_ = entity_.layer;
    is_mirrored_ = entity_.IsMirrored() && !(flags_ & 8);  // 8: corners in space
  }

  void AddCircle() {
    const double start_rad = kDegree * entity_.Get(50, 0);
    const double turn_rad = std::fmod(kDegree * entity_.Get(51, 360) - start_rad, 2 * M_PI);
    const Vector3d centre = entity_.Place(0);
    const Vector3d from =
        centre + entity_.Get(40, 0) * Vector3d(std::cos(start_rad), std::sin(start_rad), 0);
    if (!from.allFinite() || !std::isfinite(turn_rad)) return;
    const double whole_rad = turn_rad > 0 ? turn_rad : turn_rad + 2 * M_PI;
    StartPolyline();
    polyline_ = {from};
    AddArc(centre, from, whole_rad, &polyline_);
    polyline_.push_back(centre + Eigen::AngleAxisd(whole_rad, Vector3d::UnitZ()) * (from - centre));
    EndPolyline();
  }

  // Of a polyface mesh, vertices with 128 and without 64 name the corners of a face.
  void AddVertex() {
    constexpr int kFace = 128, kPlace = 64;
    const int flags = static_cast<int>(entity_.Get(70, 0));
    if (!(flags & kFace) || (flags & kPlace)) {
      polyline_.push_back(entity_.Place(0));
      bulges_.resize(polyline_.size(), 0);
      bulges_.back() = entity_.Get(kBulge, 0);
      return;
    }
    std::vector<Vector3d> corners;
    for (const int code : {71, 72, 73, 74}) {
      const auto index = static_cast<int64_t>(std::abs(entity_.Get(code, 0))) - 1;
      if (index >= 0 && index < static_cast<int64_t>(polyline_.size())) {
        corners.push_back(polyline_[static_cast<size_t>(index)]);
      }
    }
    for (size_t i = 2; i < corners.size(); ++i) {
      drawing_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }

  void EndPolyline() {
    constexpr int kClosed = 1, kMesh = 16, kPolyface = 64;
    if (!(flags_ & (kMesh | kPolyface)) && polyline_.size() > 1) {
      const bool is_round = std::ranges::any_of(bulges_, [](double bulge) { return bulge != 0; });
      if ((flags_ & kClosed) && (polyline_.size() > 2 || is_round)) {
        polyline_.push_back(polyline_.front());
      }
      drawing_.lines.push_back({layer_, {}});
      AddCorners(&drawing_.lines.back().points);
    }
    polyline_.clear();
    bulges_.clear();
    flags_ = 0;
    is_mirrored_ = false;
  }

  void AddCorners(std::vector<Vector3d>* places) const {
    for (size_t i = 0; i < polyline_.size(); ++i) {
      if (i > 0 && i - 1 < bulges_.size()) {
        AddBulge(polyline_[i - 1], polyline_[i], bulges_[i - 1], places);
      }
      places->push_back(polyline_[i]);
    }
    if (!is_mirrored_) return;
    for (Vector3d& p : *places) p.x() = -p.x(), p.z() = -p.z();
  }

  void Scale() {
    for (DxfLine& line : drawing_.lines) {
      for (Vector3d& p : line.points) p *= metres_;
    }
    for (Vector3d& p : drawing_.points) p *= metres_;
    for (auto& triangle : drawing_.triangles) {
      for (Vector3d& p : triangle) p *= metres_;
    }
  }

  const std::string& path_;
  const std::string_view bytes_;
  std::string_view variable_;
  bool in_entities_ = false, is_ended_ = false;
  double metres_ = 1;
  DxfEntity entity_;
  std::vector<Vector3d> polyline_;
  std::vector<double> bulges_;  // behind its corners
  std::string layer_;           // of the polyline
  int flags_ = 0;
  bool is_mirrored_ = false;
  std::map<std::string, int64_t> left_out_;  // by type
  DxfDrawing drawing_;
};

}  // namespace

ExternalMap ReadObj(const std::string& path, std::string_view bytes) {
  return ObjReader(path, bytes).Read();
}

DxfDrawing ReadDxfDrawing(const std::string& path, std::string_view bytes) {
  return DxfReader(path, bytes).Read();
}

ExternalMap ReadDxf(const std::string& path, std::string_view bytes) {
  DxfDrawing drawing = ReadDxfDrawing(path, bytes);
  ExternalMap map;
  map.format = "DXF";
  for (const auto& [layer, points] : drawing.lines) {
    if (IsOurAddition(layer)) continue;
    for (size_t i = 1; i < points.size(); ++i) map.lines.push_back({points[i - 1], points[i]});
  }
  for (const Vector3d& p : drawing.points) AddPoint(p, &map);
  map.triangles = std::move(drawing.triangles);
  return map;
}

}  // namespace slcmap::data
