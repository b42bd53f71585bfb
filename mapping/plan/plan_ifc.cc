#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "mapping/plan/plan_files.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

using StepArguments = std::vector<std::string_view>;

struct StepEntity {
  std::string_view type;
  StepArguments arguments;
};

// Those of a list "(a,(b,c),'d')" at its top level.
StepArguments SplitStep(std::string_view list) {
  StepArguments parts;
  int depth = 0;
  bool in_text = false;
  std::size_t from = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const char c = list[i];
    if (c == '\'') in_text = !in_text;
    if (in_text) continue;
    if (c == '(' && depth++ == 0) from = i + 1;
    const bool ends = c == ')' && --depth == 0;
    if (!ends && !(c == ',' && depth == 1)) continue;
    if (i > from) parts.push_back(list.substr(from, i - from));
    from = i + 1;
    if (ends) break;
  }
  return parts;
}

// The entities of a STEP file by their number. Throws DataError where a reference leads nowhere.
class StepModel {
 public:
  explicit StepModel(const std::string& path) : path_(path), text_(ReadFile(path)) {
    if (!text_.starts_with("ISO-10303-21")) {
      throw DataError(path + ": found no ISO-10303-21 at its start, expected an IFC file (STEP)");
    }
    if (text_.find("END-ISO-10303-21") == std::string::npos) {
      spdlog::warn("{}: found no END-ISO-10303-21: it was cut short; what is there is taken", path);
    }
    // Rows may be broken anywhere between words.
    std::erase_if(text_, [](char c) { return c == '\n' || c == '\r'; });
    TakeOutComments();
    bool in_text = false;
    std::size_t from = 0;
    for (std::size_t i = 0; i < text_.size(); ++i) {
      if (text_[i] == '\'') in_text = !in_text;
      if (in_text || text_[i] != ';') continue;
      AddRow(std::string_view(text_).substr(from, i - from));
      from = i + 1;
    }
  }

  const std::map<int64_t, StepEntity>& entities() const { return entities_; }

  const StepEntity& At(std::string_view reference) const {
    const auto id = ParseNumber(reference.substr(std::min<std::size_t>(1, reference.size())));
    const auto entity = entities_.find(id ? static_cast<int64_t>(*id) : -1);
    if (entity != entities_.end()) return entity->second;
    throw DataError(fmt::format("{}: found the reference '{}', expected one to an entity", path_,
                                reference.substr(0, 40)));
  }

  std::string_view Argument(const StepEntity& entity, std::size_t which) const {
    if (which < entity.arguments.size()) return entity.arguments[which];
    throw DataError(fmt::format("{}: found {} attributes of {}, expected more than {}", path_,
                                entity.arguments.size(), entity.type, which));
  }

  std::vector<double> Numbers(std::string_view list) const {
    std::vector<double> numbers;
    for (const std::string_view part : SplitStep(list)) numbers.push_back(Number(part));
    return numbers;
  }

  double Number(std::string_view text) const {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.remove_suffix(1);
    const auto number = ParseNumber(text);
    if (number && std::abs(*number) < 1e9) return *number;
    throw DataError(fmt::format("{}: found '{}', expected a number within 1e9", path_, text));
  }

 private:
  void TakeOutComments() {
    std::string left;
    bool in_text = false;
    for (std::size_t i = 0; i < text_.size(); ++i) {
      if (text_[i] == '\'') in_text = !in_text;
      if (in_text || text_.compare(i, 2, "/*") != 0) {
        left += text_[i];
        continue;
      }
      const std::size_t end = text_.find("*/", i + 2);
      if (end == std::string::npos) break;
      i = end + 1;
    }
    text_ = std::move(left);
  }

  void AddRow(std::string_view row) {
    const std::size_t start = row.find('#'), equals = row.find('='), open = row.find('(');
    if (start == std::string_view::npos || equals > open || open == std::string_view::npos) return;
    const auto id = ParseNumber(Trim(row.substr(start + 1, equals - start - 1)));
    if (!id) return;
    entities_[static_cast<int64_t>(*id)] = {Trim(row.substr(equals + 1, open - equals - 1)),
                                            SplitStep(row.substr(open))};
  }

  static std::string_view Trim(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
  }

  const std::string path_;
  std::string text_;
  std::map<int64_t, StepEntity> entities_;
};

// Walls as areas of the plan, with their holes cut out, by storey.
class IfcWalls {
 public:
  explicit IfcWalls(const std::string& path) : model_(path) {
    for (const auto& [id, entity] : model_.entities()) {
      const std::string self = fmt::format("#{}", id);
      if (entity.type == "IFCUNITASSIGNMENT") {
        for (const std::string_view unit : SplitStep(model_.Argument(entity, 0))) {
          if (const auto metres = FindMetres(model_.At(unit))) unit_m_ = *metres;
        }
      }
      if (entity.type == "IFCRELVOIDSELEMENT") {
        holes_[std::string(model_.Argument(entity, 4))].push_back(
            &model_.At(model_.Argument(entity, 5)));
      }
      if (entity.type == "IFCRELCONTAINEDINSPATIALSTRUCTURE") {
        for (const std::string_view part : SplitStep(model_.Argument(entity, 4))) {
          storeys_[std::string(part)] = model_.Argument(entity, 5);
        }
      }
    }
    for (const auto& [id, entity] : model_.entities()) {
      if (entity.type == "IFCWALL" || entity.type == "IFCWALLSTANDARDCASE") {
        AddWall(fmt::format("#{}", id), entity);
      }
    }
  }

  std::vector<BuildingPlan> Plans() const {
    std::vector<BuildingPlan> plans;
    for (const auto& [storey, walls] : walls_) {
      plans.emplace_back();
      plans.back().name = storey;
      for (const Polygon& area : Union(walls, kIfcGrid_m)) AddFaces(area, false, &plans.back());
    }
    return plans;
  }

  int left_out() const { return left_out_; }

 private:
  static constexpr double kIfcGrid_m = 1e-3;
  static constexpr int kDeepest = 50;  // what goes in a circle is no placement, and no unit

  // Of a unit of length: IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.), or feet and inches as
  // IFCCONVERSIONBASEDUNIT(#,.LENGTHUNIT.,'FOOT',#) of an
  // IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(0.3048),#).
  std::optional<double> FindMetres(const StepEntity& unit, int depth = 0) const {
    static const std::map<std::string_view, double> prefixes = {
        {"$", 1}, {".MILLI.", 1e-3}, {".CENTI.", 1e-2}, {".DECI.", 0.1}, {".KILO.", 1e3}};
    const bool is_si = unit.type == "IFCSIUNIT", is_other = unit.type == "IFCCONVERSIONBASEDUNIT";
    if ((!is_si && !is_other) || model_.Argument(unit, 1) != ".LENGTHUNIT.") return std::nullopt;
    if (is_si) {
      const auto prefix = prefixes.find(model_.Argument(unit, 2));
      return prefix == prefixes.end() ? std::nullopt : std::optional(prefix->second);
    }
    const StepEntity& measure = model_.At(model_.Argument(unit, 3));
    if (depth >= kDeepest) return std::nullopt;
    const auto base_m = FindMetres(model_.At(model_.Argument(measure, 1)), depth + 1);
    if (!base_m) return std::nullopt;
    return *base_m * model_.Number(Inside(model_.Argument(measure, 0)));
  }

  void AddWall(const std::string& self, const StepEntity& wall) {
    std::vector<Polygon> areas = FootprintsIn(wall);
    if (areas.empty()) ++left_out_;
    std::vector<PlanPoints> cuts;
    for (const StepEntity* hole : holes_[self]) {
      for (const Polygon& area : FootprintsIn(*hole)) cuts.push_back(area.outline);
    }
    const auto storey = storeys_.find(self);
    std::string name =
        storey == storeys_.end() ? "" : std::string(model_.Argument(model_.At(storey->second), 2));
    std::erase(name, '\'');
    for (const Polygon& area : areas) {
      for (Polygon& left : Difference(area, cuts, kIfcGrid_m)) {
        walls_[name].push_back(std::move(left));
      }
    }
  }

  // What the bodies of a product cover in the plan; none of bodies that are no upright prisms.
  std::vector<Polygon> FootprintsIn(const StepEntity& product) const {
    std::vector<Polygon> areas;
    const Eigen::Isometry3d placed = PlacementAt(model_.Argument(product, 5));
    const std::string_view shape = model_.Argument(product, 6);
    if (shape == "$") return areas;
    for (const std::string_view part : SplitStep(model_.Argument(model_.At(shape), 2))) {
      const StepEntity& representation = model_.At(part);
      for (const std::string_view item : SplitStep(model_.Argument(representation, 3))) {
        AddFootprint(model_.At(item), placed, &areas);
      }
    }
    return areas;
  }

  void AddFootprint(const StepEntity& item, const Eigen::Isometry3d& placed,
                    std::vector<Polygon>* areas) const {
    if (item.type == "IFCBOOLEANCLIPPINGRESULT" || item.type == "IFCBOOLEANRESULT") {
      return AddFootprint(model_.At(model_.Argument(item, 1)), placed, areas);
    }
    if (item.type != "IFCEXTRUDEDAREASOLID") return;
    Eigen::Isometry3d at = placed;
    if (const std::string_view own = model_.Argument(item, 1); own != "$") at = at * AxesAt(own);
    Polygon area = ProfileAt(model_.At(model_.Argument(item, 0)));
    for (Vector2d& p : area.outline) p = (at * Vector3d(p.x(), p.y(), 0)).head<2>();
    if (area.outline.size() >= 3 && std::abs(SignedArea(area.outline)) > 1e-6) {
      areas->push_back(area);
    }
  }

  Polygon ProfileAt(const StepEntity& profile) const {
    Polygon area;
    if (profile.type == "IFCRECTANGLEPROFILEDEF") {
      const double x = 0.5 * unit_m_ * model_.Number(model_.Argument(profile, 3));
      const double y = 0.5 * unit_m_ * model_.Number(model_.Argument(profile, 4));
      Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
      if (const std::string_view own = model_.Argument(profile, 2); own != "$") at = AxesAt(own);
      for (const Vector2d& p : PlanPoints{{-x, -y}, {x, -y}, {x, y}, {-x, y}}) {
        area.outline.push_back((at * Vector3d(p.x(), p.y(), 0)).head<2>());
      }
    } else if (profile.type.starts_with("IFCARBITRARYCLOSEDPROFILEDEF") ||
               profile.type.starts_with("IFCARBITRARYPROFILEDEFWITHVOIDS")) {
      area.outline = CurveAt(model_.At(model_.Argument(profile, 2)));
    }
    return area;
  }

  PlanPoints CurveAt(const StepEntity& curve) const {
    PlanPoints points;
    if (curve.type == "IFCPOLYLINE") {
      for (const std::string_view point : SplitStep(model_.Argument(curve, 0))) {
        points.push_back(PointAt(point).head<2>());
      }
    } else if (curve.type == "IFCINDEXEDPOLYCURVE") {
      const StepEntity& list = model_.At(model_.Argument(curve, 0));
      for (const std::string_view row : SplitStep(model_.Argument(list, 0))) {
        const std::vector<double> p = model_.Numbers(fmt::format("({})", Inside(row)));
        if (p.size() >= 2) points.push_back(unit_m_ * Vector2d(p[0], p[1]));
      }
    }
    if (points.size() > 1 && (points.front() - points.back()).norm() < 1e-6) points.pop_back();
    return points;
  }

  static std::string_view Inside(std::string_view list) {
    const std::size_t open = list.find('('), close = list.rfind(')');
    if (open == std::string_view::npos || close == std::string_view::npos) return list;
    return list.substr(open + 1, close - open - 1);
  }

  Vector3d VectorAt(std::string_view reference) const {
    const std::vector<double> values = model_.Numbers(model_.Argument(model_.At(reference), 0));
    Vector3d v = Vector3d::Zero();
    for (std::size_t i = 0; i < std::min<std::size_t>(3, values.size()); ++i) {
      v[static_cast<Eigen::Index>(i)] = values[i];
    }
    return v;
  }
  Vector3d PointAt(std::string_view reference) const { return unit_m_ * VectorAt(reference); }

  // IfcAxis2Placement2D and 3D.
  Eigen::Isometry3d AxesAt(std::string_view reference) const {
    const StepEntity& axes = model_.At(reference);
    const bool is_flat = axes.type == "IFCAXIS2PLACEMENT2D";
    Vector3d z = Vector3d::UnitZ(), x = Vector3d::UnitX();
    if (!is_flat && model_.Argument(axes, 1) != "$") z = VectorAt(model_.Argument(axes, 1));
    const std::string_view along = model_.Argument(axes, is_flat ? 1 : 2);
    if (along != "$") x = VectorAt(along);
    z.normalize();
    x = (x - z.dot(x) * z).normalized();
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    at.linear() << x, z.cross(x), z;
    at.translation() = PointAt(model_.Argument(axes, 0));
    return at;
  }

  Eigen::Isometry3d PlacementAt(std::string_view reference) const {
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    for (int depth = 0; reference != "$" && depth < kDeepest; ++depth) {
      const StepEntity& placement = model_.At(reference);
      if (placement.type != "IFCLOCALPLACEMENT") break;
      at = AxesAt(model_.Argument(placement, 1)) * at;
      reference = model_.Argument(placement, 0);
    }
    return at;
  }

  StepModel model_;
  double unit_m_ = 1;
  int left_out_ = 0;
  std::map<std::string, std::vector<const StepEntity*>> holes_;
  std::map<std::string, std::string_view> storeys_;
  std::map<std::string, std::vector<Polygon>> walls_;
};

}  // namespace

std::vector<BuildingPlan> ReadIfcPlans(const std::string& path) {
  const IfcWalls walls(path);
  if (walls.left_out() > 0) {
    spdlog::warn("{}: {} walls are no upright prisms, and are left out", path, walls.left_out());
  }
  return walls.Plans();
}

}  // namespace slcmap::mapping
