// Text of a STEP file (ISO 10303-21), and the parts that all of an IFC4 file is made of. Metres.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/core/coordinate_system.h"
#include "data/core/polygon.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {

inline constexpr const char* kStepUnset = "$";
inline constexpr const char* kStepDerived = "*";

// The character that begins at *at, which is moved on; what is no UTF-8 becomes the replacement
// character.
uint32_t NextCharacter(std::string_view utf8, std::size_t* at);

// Attributes as the file holds them. Numbers have six decimals, a micrometre, or as many as said;
// throws DataError for one that is not finite.
std::string StepReal(double value, int decimals = 6);
std::string StepText(std::string_view utf8);  // in quotes
std::string StepBool(bool value);
std::string StepList(const std::vector<std::string>& values);

class StepFile {
 public:
  // Adds an entity, its attributes as above, and returns the reference to it, as "#12".
  std::string Add(std::string_view type, const std::vector<std::string>& attributes);

  // Adds an entity unless there is one that says the same: of things without identity.
  std::string Share(std::string_view type, const std::vector<std::string>& attributes);

  // The whole file. Its stamp is always the same, so that one map gives the same bytes each time.
  std::string Text(std::string_view name, std::string_view schema, std::string_view view,
                   std::string_view writer) const;

 private:
  int count_ = 0;
  std::string data_;
  std::map<std::string, std::string> shared_;
};

// Identifiers of IFC that say the same of the same content.

// The 22 characters that IFC has for a UUID (first 0 to 3, all of 0-9A-Za-z_$): here for that of
// version 5 (RFC 4122) of a name.
std::string IfcGuid(std::string_view name);

// The parts that all of an IFC4 file is made of. Metres.

// References to a representation's context, which says what it is of a product.
struct IfcContexts {
  std::string model, body, axis, annotation, footprint;
};

// Where something is and how it is turned: x along a direction of the plan, z up.
struct IfcPose {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();
};

// A property of a set of its own, as "sigma_m" and "IFCLENGTHMEASURE(0.003)", or a list of such
// values (StepList).
struct IfcProperty {
  std::string name, value;
  bool is_list = false;
};
std::string IfcLengthValue(double length_m);
std::string IfcIntegerValue(int64_t value);
std::string IfcBooleanValue(bool value);
std::string IfcRatioValue(double ratio);  // 0 to 1
std::string IfcTextValue(std::string_view text);
std::string IfcLabelValue(std::string_view label);

class IfcFile {
 public:
  // With owner, units and contexts. north_rad: where true north is, counterclockwise from y.
  explicit IfcFile(const std::optional<double>& north_rad = std::nullopt);

  const IfcContexts& contexts() const { return contexts_; }
  // The model lies there: a map conversion. `title` is what the system is called.
  void AddMapConversion(const Georeference& place, const std::string& title,
                        const std::string& heights);
  const std::string& units() const { return units_; }
  std::string Text() const;

  // Adds what has an identity; `attributes` are those after OwnerHistory. The identity follows from
  // the type and what `content` says of it; of things that say the same, each has its own.
  std::string AddRooted(std::string_view type, const std::string& content,
                        const std::vector<std::string>& attributes);
  std::string Add(std::string_view type, const std::vector<std::string>& attributes) {
    return step_.Add(type, attributes);
  }

  std::string Point(const Eigen::Vector3d& point);
  std::string Point(const Eigen::Vector2d& point);
  std::string Direction(const Eigen::Vector3d& direction);
  std::string Placement(const IfcPose& pose);  // IfcAxis2Placement3D
  std::string LocalPlacement(const std::string& parent, const IfcPose& pose);  // parent or "$"

  // A rectangle about a centre, extruded upwards from z = low_m.
  std::string Box(const Eigen::Vector2d& centre, const Eigen::Vector2d& size, double low_m,
                  double height_m);
  // A polygon with its holes, extruded upwards from z = low_m.
  std::string Prism(const Polygon& polygon, double low_m, double height_m);
  // A bar of square section between two points.
  std::string Bar(const Eigen::Vector3d& start, const Eigen::Vector3d& end, double width_m);
  // One of round section.
  std::string RoundBar(const Eigen::Vector3d& start, const Eigen::Vector3d& end, double radius_m);
  std::string Polyline(const PlanPoints& points, bool closed);

  // A representation of one product ("Body" and "SweptSolid"), and the shape that they make.
  std::string Representation(const std::string& context, const char* identifier, const char* type,
                             const std::vector<std::string>& items);
  std::string Shape(const std::vector<std::string>& representations);
  std::string SolidShape(const std::vector<std::string>& solids);  // with a body only

  void SetSurface(const std::string& item, const Colour& colour, double transparency);
  void SetCurve(const std::string& item, const Colour& colour);

  // A property set "slcmap_NAME" of an element.
  void AddProperties(const std::string& element, const std::string& content, const char* name,
                     const std::vector<IfcProperty>& properties);
  // Areas and lengths of an element, as entities IFCQUANTITY..., under a name of the standard's.
  void AddQuantities(const std::string& element, const std::string& content, const char* name,
                     const std::vector<std::string>& quantities);
  std::string Length(const char* name, double length_m);
  std::string Area(const char* name, double area_m2);

 private:
  static std::string Coordinates(const Eigen::Ref<const Eigen::VectorXd>& values, int decimals = 6);
  void AddOwner();
  void AddUnits();
  void AddContexts(const std::optional<double>& north_rad);
  std::string Centre();
  std::string ExtrudedAlong(const std::string& profile, const Eigen::Vector3d& start,
                            const Eigen::Vector3d& end);
  std::string Extruded(const std::string& profile, const std::string& placement, double height_m);
  std::string AddColour(const Colour& colour);
  void RelateProperties(const std::string& element, const std::string& content,
                        const std::string& definition);

  StepFile step_;
  std::map<std::string, int> names_;  // how often each was given
  IfcContexts contexts_;
  std::string owner_, units_;
};

}  // namespace slcmap::exporting
