#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "data/io/file.h"
#include "data/io/yaml.h"
#include "export/cad/cad_writers.h"
#include "export/cad/ifc_building.h"
#include "export/cad/ifc_file.h"
#include "export/scene/building_solids.h"
#include "export/scene/map_layers.h"
#include "export/scene/meshes.h"

namespace slcmap::inline exporting {

// Lines as annotations, and as thin solids.

// Adds an annotation for the lines of a storey and an axis, as one set of curves, and with
// options.line_solids a proxy for the same lines as bars; both say of each line its id, kind and
// sigma, in the order of the curves. Returns how many lines without length
// were left out. Throws StoppedError when progress says so.
int AddIfcLines(const MapResult& map, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file, const Progress& progress);

// Pipes as segments of pipes.

// Adds an IfcPipeSegment for each pipe, a circle extruded along its axis, to the storey in which
// its middle is. What it is used for is not known: columns and drums are among them. Returns how
// many without length were left out.
int AddIfcPipes(const MapResult& map, IfcStructure* structure, IfcFile* file);

namespace {

using Lines = std::vector<const MapLine*>;

// In the order of storeys and axes.
using LineGroups = std::map<std::pair<std::optional<std::size_t>, LineAxis>, Lines>;

double MedianSigma(const Lines& lines) {
  std::vector<double> sigmas_m;
  for (const MapLine* line : lines) sigmas_m.push_back(line->sigma_m);
  const auto middle = sigmas_m.begin() + static_cast<std::ptrdiff_t>(sigmas_m.size() / 2);
  std::nth_element(sigmas_m.begin(), middle, sigmas_m.end());
  return *middle;
}

// A value a line, in the order of the curves.
template <typename Value>
IfcProperty MakeList(const char* name, const Lines& lines, Value value) {
  std::vector<std::string> values;
  for (const MapLine* line : lines) values.push_back(value(*line));
  return {name, StepList(values), true};
}

// The lines of one storey and axis.
class LineGroup {
 public:
  LineGroup(LineAxis axis, const Lines& lines, IfcPart* part, IfcFile* file)
      : lines_(lines),
        part_(part),
        file_(file),
        name_(fmt::format("Lines {}", AxisName(axis))),
        content_(fmt::format("{} {}", part->content, name_)) {
    const auto [red, green, blue] = LineColour(axis, true);
    colour_ = {red, green, blue};
  }

  void AddCurves() {
    std::vector<std::string> curves;
    for (const MapLine* line : lines_) {
      const std::string start = file_->Point(Local(line->start_world));
      const std::string end = file_->Point(Local(line->end_world));
      curves.push_back(file_->Add("IFCPOLYLINE", {StepList({start, end})}));
    }
    const std::string set = file_->Add("IFCGEOMETRICCURVESET", {StepList(curves)});
    file_->SetCurve(set, colour_);
    AddElement("IFCANNOTATION",
               file_->Shape({file_->Representation(file_->contexts().annotation, "Annotation",
                                                   "GeometricCurveSet", {set})}),
               {});
  }

  void AddBars(double width_m) {
    std::vector<std::string> bars;
    for (const MapLine* line : lines_) {
      bars.push_back(file_->Bar(Local(line->start_world), Local(line->end_world), width_m));
      file_->SetSurface(bars.back(), colour_, 0);
    }
    AddElement("IFCBUILDINGELEMENTPROXY", file_->SolidShape(bars), {kStepUnset, ".NOTDEFINED."});
  }

 private:
  Eigen::Vector3d Local(const Eigen::Vector3d& p_world) const {
    return p_world - part_->floor_m * Eigen::Vector3d::UnitZ();
  }

  void AddElement(const char* type, const std::string& shape,
                  const std::vector<std::string>& others) {
    std::vector<std::string> attributes = {StepText(name_), kStepUnset, "'StructuralLines'",
                                           file_->LocalPlacement(part_->placement, {}), shape};
    attributes.insert(attributes.end(), others.begin(), others.end());
    const std::string element = file_->AddRooted(type, content_, attributes);
    part_->elements.push_back(element);
    file_->AddProperties(
        element, type + content_, "Lines",
        {{"lines", IfcIntegerValue(std::ssize(lines_))},
         {"median_sigma_m", IfcLengthValue(MedianSigma(lines_))},
         MakeList("ids", lines_, [](const MapLine& line) { return IfcIntegerValue(line.id); }),
         MakeList("kinds", lines_,
                  [](const MapLine& line) { return IfcLabelValue(GetName(line.kind)); }),
         MakeList("sigmas_m", lines_,
                  [](const MapLine& line) { return IfcLengthValue(line.sigma_m); })});
  }

  const Lines& lines_;
  IfcPart* part_;
  IfcFile* file_;
  const std::string name_, content_;
  Colour colour_;
};

}  // namespace

int AddIfcLines(const MapResult& map, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file, const Progress& progress) {
  LineGroups groups;
  int left_out = 0;
  for (const MapLine& line : map.lines) {
    if ((line.end_world - line.start_world).norm() < kLeastSolid_m) {
      ++left_out;
      continue;
    }
    const double middle_m = 0.5 * (line.start_world.z() + line.end_world.z());
    groups[{StoreyAt(map.building, middle_m), line.axis}].push_back(&line);
  }
  double done = 0;
  for (const auto& [key, lines] : groups) {
    progress.ReportOrStop(done++ / static_cast<double>(groups.size()));
    LineGroup group(key.second, lines, &structure->GetPart(key.first), file);
    group.AddCurves();
    if (options.line_solids) group.AddBars(options.line_solid_m);
  }
  return left_out;
}

namespace {

void AddPipe(const MapPipe& pipe, IfcPart* part, IfcFile* file) {
  const Eigen::Vector3d floor = part->floor_m * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d start = pipe.start_world - floor, end = pipe.end_world - floor;
  const std::string solid = file->RoundBar(start, end, pipe.radius_m);
  file->SetSurface(solid, kPipeColour, 0);
  const std::string content = fmt::format("{} pipe {}", part->content, pipe.id);
  const std::string element =
      file->AddRooted("IFCPIPESEGMENT", content,
                      {StepText(fmt::format("Pipe {}", pipe.id)), kStepUnset, kStepUnset,
                       file->LocalPlacement(part->placement, {}), file->SolidShape({solid}),
                       StepText(fmt::format("{}", pipe.id)), ".NOTDEFINED."});
  part->elements.push_back(element);
  file->AddProperties(element, content, "Pipe",
                      {{"radius_m", IfcLengthValue(pipe.radius_m)},
                       {"radius_sigma_m", IfcLengthValue(pipe.radius_sigma_m)},
                       {"sigma_m", IfcLengthValue(pipe.sigma_m)},
                       {"images", IfcIntegerValue(pipe.images)}});
}

}  // namespace

int AddIfcPipes(const MapResult& map, IfcStructure* structure, IfcFile* file) {
  int left_out = 0;
  for (const MapPipe& pipe : map.pipes) {
    if ((pipe.end_world - pipe.start_world).norm() < kLeastSolid_m) {
      ++left_out;
      continue;
    }
    const double middle_m = 0.5 * (pipe.start_world.z() + pipe.end_world.z());
    AddPipe(pipe, &structure->GetPart(StoreyAt(map.building, middle_m)), file);
  }
  return left_out;
}

namespace {

constexpr OptionTable kTable{
    Option{"line_solids", &IfcOptions::line_solids, false, true},
    Option{"line_solid_m", &IfcOptions::line_solid_m, 1e-3, 1.0},
    Option{"slab_m", &IfcOptions::slab_m, 1e-3, 2.0},
    Option{"assumed_height_m", &IfcOptions::assumed_height_m, 0.1, 100.0},
};

}  // namespace

void IfcOptions::Check() const { kTable.Check("ifc", *this); }

std::vector<std::string> IfcWriter::Write(const std::string& folder, const MapResult& map,
                                          const Progress& progress) const {
  options_.Check();
  const std::string path = folder + "/map.ifc";
  IfcFile file(FindNorth_rad(map.source));
  IfcStructure structure(map, &file);
  if (const auto& place = map.source.georeference) {
    file.AddMapConversion(*place, place->crs.empty() ? "" : CoordinateSystem(place->crs).title());
  }
  int left_out = AddIfcWalls(map.building, options_, &structure, &file);
  left_out += AddIfcSlabs(map.building, options_, &structure, &file);
  AddIfcSpaces(map.building, &structure, &file);
  left_out += AddIfcPipes(map, &structure, &file);
  progress.ReportOrStop(0.2);
  left_out += AddIfcLines(map, options_, &structure, &file, progress.Part(0.2, 0.9));
  structure.Finish();
  if (left_out > 0) {
    spdlog::warn("map.ifc: {} walls, openings, slabs, pipes or lines without extent are left out",
                 left_out);
  }
  WriteFile(path, file.Text());
  progress.ReportOrStop(1);
  return {path};
}

}  // namespace slcmap::exporting
