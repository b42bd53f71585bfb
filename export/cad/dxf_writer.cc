#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "data/io/file.h"
#include "export/cad/ifc_file.h"
#include "export/plan/section_drawing.h"
#include "export/plan/sheet.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"
#include "export/scene/map_layers.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Rows of a group code and a value.
class Groups {
 public:
  explicit Groups(std::string* text) : text_(text) {}

  Groups& Name(int code, std::string_view value) { return Row(code, value); }
  Groups& Number(int code, int value) { return Row(code, value); }
  Groups& Real(int code, double value) {
    fmt::format_to(std::back_inserter(*text_), "{}\n{:.6f}\n", code, value);
    return *this;
  }
  // Codes 10, 20, 30 for the first point, 11, 21, 31 for the second, ...
  Groups& Point(int which, const Vector3d& point) {
    return Real(10 + which, point.x()).Real(20 + which, point.y()).Real(30 + which, point.z());
  }
  Groups& Variable(std::string_view name) { return Name(9, name); }

 private:
  template <typename Value>
  Groups& Row(int code, const Value& value) {
    fmt::format_to(std::back_inserter(*text_), "{}\n{}\n", code, value);
    return *this;
  }

  std::string* text_;
};

enum class DxfLinetype { kContinuous, kDashed, kDotted };

struct DxfLayer {
  std::string name;
  int colour = 7;  // of AutoCAD's index: 1 red, 3 green, 5 blue, 7 black or white, ...
  DxfLinetype linetype = DxfLinetype::kContinuous;
  bool is_on = true;
};

constexpr std::array<const char*, 3> kLinetypes = {"CONTINUOUS", "DASHED", "DOTTED"};

// A text with ASCII characters alone; others are named as CAD programs read them.
std::string Ascii(const std::string& text) {
  static const std::map<uint32_t, const char*> kKnown = {{0xb2, "2"}, {0x3c3, "sigma"}};
  std::string ascii;
  for (std::size_t at = 0; at < text.size();) {
    const uint32_t character = NextCharacter(text, &at);
    const auto known = kKnown.find(character);
    if (known != kKnown.end()) {
      ascii += known->second;
    } else if (character >= ' ' && character <= '~') {
      ascii += static_cast<char>(character);
    } else {
      ascii += fmt::format("\\U+{:04X}", character);
    }
  }
  return ascii;
}

Vector3d Flat(const Vector2d& p) { return {p.x(), p.y(), 0}; }

void WriteLine(const std::string& layer, const Vector3d& start, const Vector3d& end,
               std::string* text) {
  Groups(text).Name(0, "LINE").Name(8, layer).Point(0, start).Point(1, end);
}

void WriteText(const std::string& layer, const DrawnText& drawn, std::string* text) {
  const Vector3d place = Flat(drawn.position);
  Groups(text)
      .Name(0, "TEXT")
      .Name(8, layer)
      .Point(0, place)
      .Real(40, drawn.height)
      .Name(1, Ascii(drawn.text))
      .Real(50, drawn.angle_rad * 180 / M_PI)
      .Name(7, "STANDARD")
      .Number(72, drawn.align == Align::kLeft ? 0 : 1)
      .Point(1, place);
}

// Dashes and gaps (negative) in millimetres on paper: $LTSCALE makes metres of them.
void WriteLinetype(DxfLinetype type, const char* shown, const std::vector<double>& parts_mm,
                   std::string* text) {
  double length_mm = 0;
  for (const double part_mm : parts_mm) length_mm += std::abs(part_mm);
  Groups groups(text);
  groups.Name(0, "LTYPE")
      .Name(2, kLinetypes[static_cast<size_t>(type)])
      .Number(70, 0)
      .Name(3, shown)
      .Number(72, 65)
      .Number(73, static_cast<int>(parts_mm.size()))
      .Real(40, length_mm);
  for (const double part_mm : parts_mm) groups.Real(49, part_mm);
}

void WriteLayer(const DxfLayer& layer, std::string* text) {
  Groups(text)
      .Name(0, "LAYER")
      .Number(70, 0)  // FreeCAD skips what comes first, so that is not the name
      .Name(2, layer.name)
      .Number(62, layer.is_on ? layer.colour : -layer.colour)
      .Name(6, kLinetypes[static_cast<size_t>(layer.linetype)]);
}

// What a program shows when it opens the drawing: a box seen from above, with a margin.
void WriteView(const Vector3d& least, const Vector3d& most, std::string* text) {
  constexpr double kAspect = 1.5, kMargin = 1.05, kLeast_m = 1;
  const Vector3d size = most - least, middle = 0.5 * (least + most);
  const double height_m = kMargin * std::max({size.y(), size.x() / kAspect, kLeast_m});
  Groups groups(text);
  groups.Name(0, "TABLE").Name(2, "VPORT").Number(70, 1).Name(0, "VPORT");
  groups.Name(2, "*ACTIVE").Number(70, 0);
  groups.Real(10, 0).Real(20, 0).Real(11, 1).Real(21, 1).Real(12, middle.x()).Real(22, middle.y());
  groups.Real(13, 0).Real(23, 0).Real(14, 1).Real(24, 1).Real(15, 1).Real(25, 1);
  groups.Point(6, Vector3d::UnitZ()).Point(7, Vector3d::Zero());
  groups.Real(40, height_m).Real(41, kAspect).Real(42, 50).Real(43, 0).Real(44, 0);
  groups.Real(50, 0).Real(51, 0).Number(71, 0).Number(72, 1000).Number(73, 1).Number(74, 1);
  groups.Number(75, 0).Number(76, 0).Number(77, 0).Number(78, 0).Name(0, "ENDTAB");
}

void WriteStyles(std::string* text) {
  Groups(text)
      .Name(0, "TABLE")
      .Name(2, "STYLE")
      .Number(70, 1)
      .Name(0, "STYLE")
      .Name(2, "STANDARD")
      .Number(70, 0)
      .Real(40, 0)
      .Real(41, 1)
      .Real(50, 0)
      .Number(71, 0)
      .Real(42, 0.2)
      .Name(3, "txt")
      .Name(4, "")
      .Name(0, "ENDTAB");
}

// How dimensions are drawn, beneath a style's group codes and the header's variables.
struct DimensionVariable {
  const char* name;
  int code;
  double value;
};

std::vector<DimensionVariable> DimensionLengths(const PlanTextSizes& sizes) {
  return {{"$DIMSCALE", 40, 1},
          {"$DIMASZ", 41, sizes.figure_m},
          {"$DIMEXO", 42, sizes.gap_m},
          {"$DIMEXE", 44, sizes.gap_m},
          {"$DIMTXT", 140, sizes.figure_m},
          {"$DIMTSZ", 142, 0.5 * sizes.figure_m},
          {"$DIMGAP", 147, sizes.gap_m}};
}

// Texts stand above the line and along it.
constexpr std::array<std::tuple<const char*, int, int>, 3> kDimensionFlags = {
    {{"$DIMTIH", 73, 0}, {"$DIMTOH", 74, 0}, {"$DIMTAD", 77, 1}}};

void WriteDimensionStyle(const PlanTextSizes& sizes, std::string* text) {
  Groups groups(text);
  groups.Name(0, "TABLE").Name(2, "DIMSTYLE").Number(70, 1).Name(0, "DIMSTYLE");
  groups.Name(2, "STANDARD").Number(70, 0);
  for (const DimensionVariable& variable : DimensionLengths(sizes)) {
    groups.Real(variable.code, variable.value);
  }
  for (const auto& [name, code, value] : kDimensionFlags) groups.Number(code, value);
  groups.Name(0, "ENDTAB");
}

// A DXF file in the form of AutoCAD R12, the one that all programs read.
//
// Metres. Names are upper-case ASCII letters, digits, $, _ and -, at most 31 of them. Texts are
// ASCII: what is not, is written by its nearest ASCII characters.
class DxfFile {
 public:
  // Texts and dashes are sized for a drawing that is printed at 1 : scale. What the comment says is
  // at the head of the file; "" for nothing.
  DxfFile(int scale, const std::string& comment)
      : scale_(scale), sizes_(scale), comment_(comment) {}

  // What is drawn on a layer comes after it was added. Layers on which nothing is drawn are left
  // out of the file.
  void AddLayer(const DxfLayer& layer) { layers_.push_back(layer); }

  void AddLine(const std::string& layer, const Vector3d& start, const Vector3d& end) {
    used_.insert(layer);
    Extend(start);
    Extend(end);
    WriteLine(layer, start, end, &entities_);
  }

  void AddPoint(const std::string& layer, const Vector3d& point) {
    used_.insert(layer);
    Extend(point);
    Groups(&entities_).Name(0, "POINT").Name(8, layer).Point(0, point);
  }

  void AddTriangle(const std::string& layer, const std::array<Vector3d, 3>& corners) {
    used_.insert(layer);
    constexpr int kAllEdgesHidden = 15;  // outlines are drawn beside
    for (const Vector3d& corner : corners) Extend(corner);
    Groups(&entities_)
        .Name(0, "3DFACE")
        .Name(8, layer)
        .Point(0, corners[0])
        .Point(1, corners[1])
        .Point(2, corners[2])
        .Point(3, corners[2])
        .Number(70, kAllEdgesHidden);
  }

  void AddPolyline(const std::string& layer, const std::vector<Vector3d>& points, bool is_closed) {
    used_.insert(layer);
    constexpr int kClosed = 1, kInSpace = 8, kVertexInSpace = 32;
    Groups groups(&entities_);
    groups.Name(0, "POLYLINE").Name(8, layer).Number(66, 1).Point(0, Vector3d::Zero());
    groups.Number(70, kInSpace + (is_closed ? kClosed : 0));
    for (const Vector3d& point : points) {
      Extend(point);
      groups.Name(0, "VERTEX").Name(8, layer).Point(0, point).Number(70, kVertexInSpace);
    }
    groups.Name(0, "SEQEND").Name(8, layer);
  }

  void AddText(const std::string& layer, const DrawnText& text) {
    used_.insert(layer);
    Extend(Flat(text.position));
    WriteText(layer, text, &entities_);
  }

  // The dimension with the block that shows it, at z = 0.
  void AddDimension(const std::string& layer, const Dimension& dimension) {
    used_.insert(layer);
    constexpr int kAtAngle = 0, kAnonymous = 1;
    const std::string block = fmt::format("*D{}", ++dimensions_);
    const Drawing drawing = DrawDimension(dimension, sizes_);
    Groups blocks(&blocks_);
    blocks.Name(0, "BLOCK").Name(8, layer).Name(2, block).Number(70, kAnonymous);
    blocks.Point(0, Vector3d::Zero()).Name(3, block);
    for (const DrawnPath& path : drawing.paths) {
      for (size_t i = 0; i + 1 < path.points.size(); ++i) {
        WriteLine(layer, Flat(path.points[i]), Flat(path.points[i + 1]), &blocks_);
        Extend(Flat(path.points[i]));
      }
    }
    const DrawnText& text = drawing.texts.front();
    WriteText(layer, text, &blocks_);
    blocks.Name(0, "ENDBLK").Name(8, layer);
    const Vector2d along = dimension.to - dimension.from;
    const Vector2d up(-std::sin(text.angle_rad), std::cos(text.angle_rad));
    Groups(&entities_)
        .Name(0, "DIMENSION")
        .Name(8, layer)
        .Name(2, block)
        .Point(0, Flat(dimension.LineEnd()))
        .Point(1, Flat(text.position + 0.5 * text.height * up))
        .Number(70, kAtAngle)
        .Name(1, text.text)
        .Name(3, "STANDARD")
        .Point(3, Flat(dimension.from))
        .Point(4, Flat(dimension.to))
        .Real(50, std::atan2(along.y(), along.x()) * 180 / M_PI);
  }

  std::string Text() const {
    const auto section = [](const char* name, const std::string& content) {
      return fmt::format("0\nSECTION\n2\n{}\n{}0\nENDSEC\n", name, content);
    };
    return Header() + Tables() + section("BLOCKS", blocks_) + section("ENTITIES", entities_) +
           "0\nEOF\n";
  }

 private:
  void Extend(const Vector3d& point) {
    least_ = is_empty_ ? point : least_.cwiseMin(point);
    most_ = is_empty_ ? point : most_.cwiseMax(point);
    is_empty_ = false;
  }

  std::vector<DxfLayer> UsedLayers() const {
    std::vector<DxfLayer> used;
    for (const DxfLayer& layer : layers_) {
      if (used_.contains(layer.name)) used.push_back(layer);
    }
    return used;
  }

  std::string Header() const {
    std::string text;
    Groups groups(&text);
    if (!comment_.empty()) groups.Name(999, comment_);
    groups.Name(0, "SECTION").Name(2, "HEADER");
    groups.Variable("$ACADVER").Name(1, "AC1009");
    groups.Variable("$EXTMIN").Point(0, least_).Variable("$EXTMAX").Point(0, most_);
    for (const auto& [name, corner] : {std::pair("$LIMMIN", least_), std::pair("$LIMMAX", most_)}) {
      groups.Variable(name).Real(10, corner.x()).Real(20, corner.y());
    }
    // R12 knows neither of these two; FreeCAD takes metres for millimetres without them.
    groups.Variable("$INSUNITS").Number(70, 6).Variable("$MEASUREMENT").Number(70, 1);
    groups.Variable("$LUNITS").Number(70, 2).Variable("$LUPREC").Number(70, 3);
    groups.Variable("$LTSCALE").Real(40, scale_ / 1000.0);
    groups.Variable("$DIMSTYLE").Name(2, "STANDARD");
    for (const DimensionVariable& variable : DimensionLengths(sizes_)) {
      groups.Variable(variable.name).Real(40, variable.value);
    }
    for (const auto& [name, code, value] : kDimensionFlags) groups.Variable(name).Number(70, value);
    groups.Name(0, "ENDSEC");
    return text;
  }

  std::string Tables() const {
    std::string text;
    Groups groups(&text);
    groups.Name(0, "SECTION").Name(2, "TABLES");
    WriteView(least_, most_, &text);
    groups.Name(0, "TABLE").Name(2, "LTYPE").Number(70, static_cast<int>(kLinetypes.size()));
    const double dash_mm = sizes_.gap_m * 1000 / scale_;
    WriteLinetype(DxfLinetype::kContinuous, "Solid line", {}, &text);
    WriteLinetype(DxfLinetype::kDashed, "__ __ __ __", {2 * dash_mm, -dash_mm}, &text);
    WriteLinetype(DxfLinetype::kDotted, ". . . . . .", {0, -dash_mm}, &text);
    groups.Name(0, "ENDTAB");
    const std::vector<DxfLayer> layers = UsedLayers();
    groups.Name(0, "TABLE").Name(2, "LAYER").Number(70, static_cast<int>(layers.size()) + 1);
    WriteLayer({"0", 7, DxfLinetype::kContinuous, true}, &text);
    for (const DxfLayer& layer : layers) WriteLayer(layer, &text);
    groups.Name(0, "ENDTAB");
    WriteStyles(&text);
    groups.Name(0, "TABLE").Name(2, "APPID").Number(70, 1);
    groups.Name(0, "APPID").Name(2, "ACAD").Number(70, 0).Name(0, "ENDTAB");
    WriteDimensionStyle(sizes_, &text);
    groups.Name(0, "ENDSEC");
    return text;
  }

  const int scale_;
  const PlanTextSizes sizes_;
  const std::string comment_;
  std::vector<DxfLayer> layers_;
  std::set<std::string> used_;
  std::string blocks_, entities_;
  int dimensions_ = 0;
  bool is_empty_ = true;
  Vector3d least_ = Vector3d::Zero(), most_ = Vector3d::Zero();
};

constexpr int kBlack = 7, kGrey = 8, kLightGrey = 9, kGreen = 3, kBlue = 5, kCyan = 4;

// What is drawn with a pen is on a layer of its own.
struct PenLayer {
  const char* name;
  int colour;
  DxfLinetype linetype;
};
constexpr std::array<PenLayer, kPenStyles.size()> kPenLayers = {
    {{"WALL", kBlack, DxfLinetype::kContinuous},
     {"WALL_ASSUMED", kGrey, DxfLinetype::kDashed},
     {"OPENING", kBlue, DxfLinetype::kContinuous},
     {"OVERHEAD", kGrey, DxfLinetype::kDashed},
     {"ROOM", kLightGrey, DxfLinetype::kDotted},
     {"DIMENSION", kGreen, DxfLinetype::kContinuous},
     {"FRAME", kBlack, DxfLinetype::kContinuous},
     {"BEYOND", kGrey, DxfLinetype::kContinuous},
     {"LINE", kCyan, DxfLinetype::kContinuous},
     {"SECTION", 1, DxfLinetype::kDashed},
     {"PLANNED", 6, DxfLinetype::kDashed}}};
constexpr char kTextLayer[] = "TEXT", kRoomTextLayer[] = "ROOM_TEXT";

// Of LineAxis.
constexpr std::array<int, 5> kAxisColours = {1, kGreen, kBlue, 30, 6};

void AddPaths(const std::string& prefix, const Drawing& drawing, DxfFile* file) {
  for (const DrawnPath& path : drawing.paths) {
    const std::string layer = prefix + kPenLayers[static_cast<size_t>(path.pen)].name;
    std::vector<Vector3d> points;
    for (const Eigen::Vector2d& p : path.points) points.emplace_back(p.x(), p.y(), 0);
    if (points.size() == 2)
      file->AddLine(layer, points[0], points[1]);
    else
      file->AddPolyline(layer, points, false);
  }
}

void AddPlanLayers(const std::string& prefix, bool is_on, DxfFile* file) {
  for (const PenLayer& layer : kPenLayers) {
    file->AddLayer({prefix + layer.name, layer.colour, layer.linetype, is_on});
  }
  for (const char* name : {kTextLayer, kRoomTextLayer}) {
    file->AddLayer({prefix + name, kBlack, DxfLinetype::kContinuous, is_on});
  }
}

void AddStorey(const StoreyPlan& plan, bool is_on, DxfFile* file) {
  const std::string prefix = StoreyPrefix(plan.storey.id) + "_";
  AddPlanLayers(prefix, is_on, file);
  for (const Drawing* drawing : {&plan.rooms, &plan.walls, &plan.openings, &plan.sections}) {
    AddPaths(prefix, *drawing, file);
  }
  for (const DrawnText& text : plan.room_texts) file->AddText(prefix + kRoomTextLayer, text);
  for (const DrawnText& text : plan.wall_texts) file->AddText(prefix + kTextLayer, text);
  for (const DrawnText& text : plan.sections.texts) file->AddText(prefix + kTextLayer, text);
  for (const Dimension& dimension : plan.dimensions) {
    file->AddDimension(prefix + "DIMENSION", dimension);
  }
}

std::string PlanDxf(const PlanSet& plans, const MapResult& map) {
  DxfFile file(plans.format.scale, GeoreferenceNote(map.source.georeference));
  for (const StoreyPlan& plan : plans.storeys) {
    AddStorey(plan, &plan == &plans.storeys.front(), &file);
  }
  return file.Text();
}

void AddLines(const MapResult& map, DxfFile* file) {
  for (const LinesOfLayer& layer : LineLayers(map)) {
    file->AddLayer({layer.name, kAxisColours[static_cast<size_t>(layer.axis)]});
    for (const auto& [start, end] : layer.lines) file->AddLine(layer.name, start, end);
  }
}

void AddPlanes(const Building& building, DxfFile* file) {
  for (const PlanesOfLayer& layer : PlaneLayers(building)) {
    const std::string outlines = layer.name + "_OUTLINE";
    file->AddLayer({layer.name, kLightGrey});
    file->AddLayer({outlines, kGrey});
    for (const auto& triangle : layer.triangles) file->AddTriangle(layer.name, triangle);
    for (const auto& outline : layer.outlines) file->AddPolyline(outlines, outline, true);
  }
}

std::string SectionDxf(const SectionDrawing& section, const MapResult& map) {
  DxfFile file(section.format.scale, GeoreferenceNote(map.source.georeference));
  AddPlanLayers("", true, &file);
  AddPaths("", section.shape, &file);
  AddPaths("", {{}, section.marks, {}}, &file);
  for (const DrawnText& text : section.texts) file.AddText(kTextLayer, text);
  for (const Dimension& dimension : section.dimensions) file.AddDimension("DIMENSION", dimension);
  return file.Text();
}

std::string StoreyDxf(const StoreyPlan& plan, int scale, const MapResult& map) {
  DxfFile file(scale, GeoreferenceNote(map.source.georeference));
  AddStorey(plan, true, &file);
  return file.Text();
}

std::string MapDxf(const MapResult& map) {
  constexpr char kPoints[] = "POINTS", kTrajectory[] = "TRAJECTORY";
  DxfFile file(100, GeoreferenceNote(map.source.georeference));
  AddLines(map, &file);
  AddPlanes(map.building, &file);
  file.AddLayer({kPoints, kLightGrey});
  for (const MapPoint& point : map.points) file.AddPoint(kPoints, point.p_world);
  file.AddLayer({kTrajectory, kCyan});
  for (const auto& piece : TrajectoryPieces(map.trajectory)) {
    file.AddPolyline(kTrajectory, piece, false);
  }
  return file.Text();
}

}  // namespace

std::vector<std::string> WriteDxf(const PlanOptions& options, const std::string& folder,
                                  const MapResult& map, const Progress& progress) {
  std::vector<std::string> paths = {folder + "/plan.dxf", folder + "/map.dxf"};
  const PlanSet plans = MakePlans(map.building, options);
  WriteFile(paths[0], PlanDxf(plans, map));
  const std::vector<SectionDrawing> sections = MakeSections(map, options);
  if (plans.storeys.size() > 1 || !sections.empty()) MakeFolder(folder + "/plan");
  for (const StoreyPlan& plan : plans.storeys) {
    if (plans.storeys.size() < 2) break;
    paths.push_back(fmt::format("{}/plan/storey_{}.dxf", folder, plan.storey.id));
    WriteFile(paths.back(), StoreyDxf(plan, plans.format.scale, map));
  }
  for (const SectionDrawing& section : sections) {
    paths.push_back(fmt::format("{}/plan/{}.dxf", folder, section.view.name));
    WriteFile(paths.back(), SectionDxf(section, map));
  }
  progress.ReportOrStop(0.5);
  WriteFile(paths[1], MapDxf(map));
  return paths;
}

}  // namespace slcmap::exporting
