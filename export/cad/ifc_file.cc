#include "export/cad/ifc_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/string_generator.hpp>
#include <cmath>
#include <cstdint>

#include "data/core/error.h"
#include "data/version.h"

namespace slcmap::inline exporting {
namespace {

constexpr char kStamp[] = "1970-01-01T00:00:00";
constexpr uint32_t kReplacement = 0xfffd;

std::string Joined(std::string_view type, const std::vector<std::string>& attributes) {
  return fmt::format("{}({})", type, fmt::join(attributes, ","));
}

}  // namespace

uint32_t NextCharacter(std::string_view utf8, std::size_t* at) {
  const auto lead = static_cast<uint8_t>(utf8[(*at)++]);
  if (lead < 0x80) return lead;
  const int following = lead >= 0xf0 ? 3 : lead >= 0xe0 ? 2 : lead >= 0xc0 ? 1 : 0;
  if (following == 0 || *at + static_cast<std::size_t>(following) > utf8.size()) {
    return kReplacement;
  }
  uint32_t character = lead & (0x3fu >> following);
  for (int i = 0; i < following; ++i) {
    const auto byte = static_cast<uint8_t>(utf8[*at]);
    if ((byte & 0xc0) != 0x80) return kReplacement;
    character = (character << 6) | (byte & 0x3f);
    ++*at;
  }
  return character;
}

std::string StepReal(double value, int decimals) {
  if (!std::isfinite(value)) {
    throw DataError(fmt::format("ifc: found the number {}, expected a finite one", value));
  }
  std::string text = fmt::format("{:.{}f}", value, decimals);
  text.erase(text.find_last_not_of('0') + 1);
  return text == "-0." ? "0." : text;
}

std::string StepText(std::string_view utf8) {
  std::string text = "'";
  for (std::size_t at = 0; at < utf8.size();) {
    const uint32_t character = NextCharacter(utf8, &at);
    if (character == '\'' || character == '\\') {
      text.append(2, static_cast<char>(character));
    } else if (character >= 0x20 && character < 0x7f) {
      text.push_back(static_cast<char>(character));
    } else if (character < 0x10000) {
      text += fmt::format("\\X2\\{:04X}\\X0\\", character);
    } else {
      text += fmt::format("\\X4\\{:08X}\\X0\\", character);
    }
  }
  return text + "'";
}

std::string StepBool(bool value) { return value ? ".T." : ".F."; }

std::string StepList(const std::vector<std::string>& values) {
  return fmt::format("({})", fmt::join(values, ","));
}

std::string StepFile::Add(std::string_view type, const std::vector<std::string>& attributes) {
  std::string reference = fmt::format("#{}", ++count_);
  data_ += fmt::format("{}={};\n", reference, Joined(type, attributes));
  return reference;
}

std::string StepFile::Share(std::string_view type, const std::vector<std::string>& attributes) {
  std::string& reference = shared_[Joined(type, attributes)];
  if (reference.empty()) reference = Add(type, attributes);
  return reference;
}

std::string StepFile::Text(std::string_view name, std::string_view schema, std::string_view view,
                           std::string_view writer) const {
  return fmt::format(
      "ISO-10303-21;\nHEADER;\n"
      "FILE_DESCRIPTION(({}),'2;1');\n"
      "FILE_NAME({},'{}',(''),(''),{},{},'');\n"
      "FILE_SCHEMA(({}));\nENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
      StepText(view), StepText(name), kStamp, StepText(writer), StepText(writer), StepText(schema),
      data_);
}

namespace {

constexpr char kDigits[] = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$";
constexpr char kNamespace[] = "2f6a1c0e-5b7d-4d39-9a53-6c1d3b0f7e42";  // all names of slcmap

// `count` digits of a number.
std::string Digits(uint32_t number, int count) {
  std::string digits;
  for (int i = 0; i < count; ++i, number /= 64) digits.push_back(kDigits[number % 64]);
  std::reverse(digits.begin(), digits.end());
  return digits;
}

}  // namespace

std::string IfcGuid(std::string_view name) {
  const boost::uuids::name_generator_sha1 generate(boost::uuids::string_generator()(kNamespace));
  const boost::uuids::uuid id = generate(name.data(), name.size());
  // The first byte has two digits, each three that follow have four.
  std::string guid = Digits(id.data[0], 2);
  for (std::size_t i = 1; i < id.size(); i += 3) {
    const uint32_t number = static_cast<uint32_t>(id.data[i]) << 16 |
                            static_cast<uint32_t>(id.data[i + 1]) << 8 | id.data[i + 2];
    guid += Digits(number, 4);
  }
  return guid;
}

namespace {

constexpr int kDirectionDecimals = 12;
constexpr double kLeastUpright = 1e-6;  // of a direction, to be square to the vertical

std::string Part(double value) { return StepReal(value / 255.0); }

}  // namespace

std::string IfcLengthValue(double length_m) {
  return fmt::format("IFCLENGTHMEASURE({})", StepReal(length_m));
}
std::string IfcIntegerValue(int64_t value) { return fmt::format("IFCINTEGER({})", value); }
std::string IfcBooleanValue(bool value) { return fmt::format("IFCBOOLEAN({})", StepBool(value)); }
std::string IfcRatioValue(double ratio) {
  return fmt::format("IFCNORMALISEDRATIOMEASURE({})", StepReal(ratio));
}
std::string IfcTextValue(std::string_view text) {
  return fmt::format("IFCTEXT({})", StepText(text));
}
std::string IfcLabelValue(std::string_view label) {
  return fmt::format("IFCLABEL({})", StepText(label));
}

IfcFile::IfcFile(const std::optional<double>& north_rad) {
  AddOwner();
  AddUnits();
  AddContexts(north_rad);
}

void IfcFile::AddOwner() {
  const std::string organization = Add("IFCORGANIZATION", {"$", "'slcmap'", "$", "$", "$"});
  const std::string person = Add("IFCPERSON", {"$", "'unknown'", "$", "$", "$", "$", "$", "$"});
  const std::string both = Add("IFCPERSONANDORGANIZATION", {person, organization, "$"});
  const std::string application =
      Add("IFCAPPLICATION", {organization, StepText(kVersion), "'slcmap'", "'slcmap'"});
  // Without a date of a change, no other than this state is allowed; 0 is that of FILE_NAME.
  owner_ = Add("IFCOWNERHISTORY", {both, application, "$", ".NOCHANGE.", "$", "$", "$", "0"});
}

void IfcFile::AddUnits() {
  std::vector<std::string> units;
  for (const auto& [kind, name] :
       {std::pair(".LENGTHUNIT.", ".METRE."), std::pair(".AREAUNIT.", ".SQUARE_METRE."),
        std::pair(".VOLUMEUNIT.", ".CUBIC_METRE."), std::pair(".PLANEANGLEUNIT.", ".RADIAN.")}) {
    units.push_back(Add("IFCSIUNIT", {kStepDerived, kind, kStepUnset, name}));
  }
  units_ = Add("IFCUNITASSIGNMENT", {StepList(units)});
}

void IfcFile::AddContexts(const std::optional<double>& north_rad) {
  const std::string north =
      north_rad
          ? step_.Share("IFCDIRECTION",
                        {Coordinates(Eigen::Vector2d(-std::sin(*north_rad), std::cos(*north_rad)),
                                     kDirectionDecimals)})
          : kStepUnset;
  contexts_.model = Add("IFCGEOMETRICREPRESENTATIONCONTEXT",
                        {"$", "'Model'", "3", "1.E-05", Placement({}), north});
  const auto sub = [&](const char* identifier, const char* view) {
    return Add("IFCGEOMETRICREPRESENTATIONSUBCONTEXT", {StepText(identifier), "'Model'", "*", "*",
                                                        "*", "*", contexts_.model, "$", view, "$"});
  };
  contexts_.body = sub("Body", ".MODEL_VIEW.");
  contexts_.axis = sub("Axis", ".GRAPH_VIEW.");
  contexts_.annotation = sub("Annotation", ".MODEL_VIEW.");
  contexts_.footprint = sub("FootPrint", ".MODEL_VIEW.");
}

void IfcFile::AddMapConversion(const Georeference& place, const std::string& title,
                               const std::string& heights) {
  const bool is_listed = place.crs.starts_with("EPSG:");
  const std::string name = is_listed ? place.crs.substr(0, place.crs.find('+')) : place.crs;
  const std::string crs = Add(
      "IFCPROJECTEDCRS",
      {StepText(name.empty() ? "unknown" : name),
       StepText(title.empty() ? "As the poses or control points were given" : title), kStepUnset,
       heights.empty() ? kStepUnset : StepText(heights), kStepUnset, kStepUnset, kStepUnset});
  Add("IFCMAPCONVERSION",
      {contexts_.model, crs, StepReal(place.origin_m.x()), StepReal(place.origin_m.y()),
       StepReal(place.origin_m.z()), StepReal(std::cos(place.turn_rad), kDirectionDecimals),
       StepReal(std::sin(place.turn_rad), kDirectionDecimals),
       StepReal(place.scale, kDirectionDecimals)});
}

std::string IfcFile::Text() const {
  return step_.Text("map.ifc", "IFC4", "ViewDefinition [DesignTransferView_V1.0]",
                    fmt::format("slcmap {}", kVersion));
}

std::string IfcFile::AddRooted(std::string_view type, const std::string& content,
                               const std::vector<std::string>& attributes) {
  std::string name = fmt::format("{} {}", type, content);
  const int repeated = names_[name]++;
  if (repeated > 0) name += fmt::format(" {}", repeated);
  std::vector<std::string> all = {StepText(IfcGuid(name)), owner_};
  all.insert(all.end(), attributes.begin(), attributes.end());
  return step_.Add(type, all);
}

std::string IfcFile::Coordinates(const Eigen::Ref<const Eigen::VectorXd>& values, int decimals) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(StepReal(value, decimals));
  return StepList(texts);
}

std::string IfcFile::Point(const Eigen::Vector3d& point) {
  return Add("IFCCARTESIANPOINT", {Coordinates(point)});
}

std::string IfcFile::Point(const Eigen::Vector2d& point) {
  return step_.Share("IFCCARTESIANPOINT", {Coordinates(point)});
}

std::string IfcFile::Direction(const Eigen::Vector3d& direction) {
  return step_.Share("IFCDIRECTION", {Coordinates(direction, kDirectionDecimals)});
}

std::string IfcFile::Placement(const IfcPose& pose) {
  const Eigen::Vector2d along = pose.along.normalized();
  return step_.Share("IFCAXIS2PLACEMENT3D",
                     {step_.Share("IFCCARTESIANPOINT", {Coordinates(pose.origin)}),
                      Direction(Eigen::Vector3d::UnitZ()), Direction({along.x(), along.y(), 0})});
}

std::string IfcFile::LocalPlacement(const std::string& parent, const IfcPose& pose) {
  return Add("IFCLOCALPLACEMENT", {parent, Placement(pose)});
}

std::string IfcFile::Extruded(const std::string& profile, const std::string& placement,
                              double height_m) {
  return Add("IFCEXTRUDEDAREASOLID",
             {profile, placement, Direction(Eigen::Vector3d::UnitZ()), StepReal(height_m)});
}

std::string IfcFile::Box(const Eigen::Vector2d& centre, const Eigen::Vector2d& size, double low_m,
                         double height_m) {
  const std::string place = Add("IFCAXIS2PLACEMENT2D", {Point(centre), kStepUnset});
  const std::string profile =
      Add("IFCRECTANGLEPROFILEDEF",
          {".AREA.", kStepUnset, place, StepReal(size.x()), StepReal(size.y())});
  return Extruded(profile, Placement({{0, 0, low_m}, Eigen::Vector2d::UnitX()}), height_m);
}

std::string IfcFile::Prism(const Polygon& polygon, double low_m, double height_m) {
  std::vector<std::string> holes;
  for (const PlanPoints& hole : polygon.holes) holes.push_back(Polyline(hole, true));
  const std::string outline = Polyline(polygon.outline, true);
  const std::string profile =
      holes.empty() ? Add("IFCARBITRARYCLOSEDPROFILEDEF", {".AREA.", kStepUnset, outline})
                    : Add("IFCARBITRARYPROFILEDEFWITHVOIDS",
                          {".AREA.", kStepUnset, outline, StepList(holes)});
  return Extruded(profile, Placement({{0, 0, low_m}, Eigen::Vector2d::UnitX()}), height_m);
}

std::string IfcFile::Centre() {
  return step_.Share("IFCAXIS2PLACEMENT2D", {Point(Eigen::Vector2d(0, 0)), kStepUnset});
}

std::string IfcFile::ExtrudedAlong(const std::string& profile, const Eigen::Vector3d& start,
                                   const Eigen::Vector3d& end) {
  const Eigen::Vector3d along = (end - start).normalized();
  const bool is_upright = along.head<2>().norm() < kLeastUpright;
  const Eigen::Vector3d side = is_upright
                                   ? Eigen::Vector3d::UnitX().eval()
                                   : Eigen::Vector3d::UnitZ().cross(along).normalized().eval();
  const std::string place =
      Add("IFCAXIS2PLACEMENT3D", {Point(start), Direction(along), Direction(side)});
  return Extruded(profile, place, (end - start).norm());
}

std::string IfcFile::Bar(const Eigen::Vector3d& start, const Eigen::Vector3d& end, double width_m) {
  const std::string centre = Centre();
  return ExtrudedAlong(
      step_.Share("IFCRECTANGLEPROFILEDEF",
                  {".AREA.", kStepUnset, centre, StepReal(width_m), StepReal(width_m)}),
      start, end);
}

std::string IfcFile::RoundBar(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                              double radius_m) {
  const std::string centre = Centre();
  return ExtrudedAlong(
      step_.Share("IFCCIRCLEPROFILEDEF", {".AREA.", kStepUnset, centre, StepReal(radius_m)}), start,
      end);
}

std::string IfcFile::Polyline(const PlanPoints& points, bool closed) {
  std::vector<std::string> references;
  for (const Eigen::Vector2d& point : points) references.push_back(Point(point));
  if (closed) references.push_back(references.front());
  return Add("IFCPOLYLINE", {StepList(references)});
}

std::string IfcFile::Representation(const std::string& context, const char* identifier,
                                    const char* type, const std::vector<std::string>& items) {
  return Add("IFCSHAPEREPRESENTATION",
             {context, StepText(identifier), StepText(type), StepList(items)});
}

std::string IfcFile::Shape(const std::vector<std::string>& representations) {
  return Add("IFCPRODUCTDEFINITIONSHAPE", {kStepUnset, kStepUnset, StepList(representations)});
}

std::string IfcFile::SolidShape(const std::vector<std::string>& solids) {
  return Shape({Representation(contexts_.body, "Body", "SweptSolid", solids)});
}

std::string IfcFile::AddColour(const Colour& colour) {
  return step_.Share("IFCCOLOURRGB",
                     {kStepUnset, Part(colour.red), Part(colour.green), Part(colour.blue)});
}

void IfcFile::SetSurface(const std::string& item, const Colour& colour, double transparency) {
  const std::string shading =
      step_.Share("IFCSURFACESTYLESHADING", {AddColour(colour), StepReal(transparency)});
  const std::string style =
      step_.Share("IFCSURFACESTYLE", {kStepUnset, ".BOTH.", StepList({shading})});
  Add("IFCSTYLEDITEM", {item, StepList({style}), kStepUnset});
}

void IfcFile::SetCurve(const std::string& item, const Colour& colour) {
  const std::string style = step_.Share(
      "IFCCURVESTYLE", {kStepUnset, kStepUnset, kStepUnset, AddColour(colour), StepBool(true)});
  Add("IFCSTYLEDITEM", {item, StepList({style}), kStepUnset});
}

void IfcFile::AddProperties(const std::string& element, const std::string& content,
                            const char* name, const std::vector<IfcProperty>& properties) {
  std::vector<std::string> references;
  for (const IfcProperty& property : properties) {
    references.push_back(Add(property.is_list ? "IFCPROPERTYLISTVALUE" : "IFCPROPERTYSINGLEVALUE",
                             {StepText(property.name), kStepUnset, property.value, kStepUnset}));
  }
  const std::string set_name = fmt::format("slcmap_{}", name);
  RelateProperties(element, set_name + " of " + content,
                   AddRooted("IFCPROPERTYSET", set_name + " of " + content,
                             {StepText(set_name), kStepUnset, StepList(references)}));
}

void IfcFile::AddQuantities(const std::string& element, const std::string& content,
                            const char* name, const std::vector<std::string>& quantities) {
  RelateProperties(element, std::string(name) + " of " + content,
                   AddRooted("IFCELEMENTQUANTITY", std::string(name) + " of " + content,
                             {StepText(name), kStepUnset, kStepUnset, StepList(quantities)}));
}

void IfcFile::RelateProperties(const std::string& element, const std::string& content,
                               const std::string& definition) {
  AddRooted("IFCRELDEFINESBYPROPERTIES", content,
            {kStepUnset, kStepUnset, StepList({element}), definition});
}

std::string IfcFile::Length(const char* name, double length_m) {
  return Add("IFCQUANTITYLENGTH",
             {StepText(name), kStepUnset, kStepUnset, StepReal(length_m), kStepUnset});
}

std::string IfcFile::Area(const char* name, double area_m2) {
  return Add("IFCQUANTITYAREA",
             {StepText(name), kStepUnset, kStepUnset, StepReal(area_m2), kStepUnset});
}

}  // namespace slcmap::exporting
