#include "export/ifc/ifc_lines.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "export/axis_name.h"
#include "export/storey_at.h"

namespace slcmap {
namespace {

constexpr double kLeast_m = 1e-4;

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

const char* NameOf(LineKind kind) {
  switch (kind) {
    case LineKind::kEdge:
      return "edge";
    case LineKind::kOutline:
      return "outline";
    case LineKind::kMark:
      return "mark";
    case LineKind::kPipe:
      return "pipe";
    case LineKind::kUnknown:
      break;
  }
  return "unknown";
}

// A value a line, in the order of the curves.
template <typename Value>
IfcProperty ListOf(const char* name, const Lines& lines, Value value) {
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
         ListOf("ids", lines_, [](const MapLine& line) { return IfcIntegerValue(line.id); }),
         ListOf("kinds", lines_,
                [](const MapLine& line) { return IfcLabelValue(NameOf(line.kind)); }),
         ListOf("sigmas_m", lines_,
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
    if ((line.end_world - line.start_world).norm() < kLeast_m) {
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

}  // namespace slcmap
