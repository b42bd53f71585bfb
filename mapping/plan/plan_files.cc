#include "mapping/plan/plan_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "data/core/error.h"
#include "data/io/json.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

constexpr double kMostLength_m = 2000, kLeastLength_m = 2;  // of what a plan shows, across

Eigen::AlignedBox2d Extent(const BuildingPlan& plan) {
  Eigen::AlignedBox2d box;
  for (const PlannedFace& face : plan.faces) box.extend(face.start).extend(face.end);
  return box;
}

// Units are what is wrong most often.
void CheckExtent(const std::string& path, const std::vector<BuildingPlan>& plans) {
  for (const BuildingPlan& plan : plans) {
    const double size_m = Extent(plan).sizes().maxCoeff();
    if (size_m >= kLeastLength_m && size_m <= kMostLength_m) continue;
    throw DataError(fmt::format(
        "{}: found walls over {:.6g} m, expected {} to {} m: the plan has to be in metres, or say "
        "its unit",
        path, size_m, kLeastLength_m, kMostLength_m));
  }
}

std::string Extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// GeoJSON.

PlanPoints PointsAt(const std::string& path, const Json& json) {
  PlanPoints points;
  for (const Json& point : json) {
    points.emplace_back(point.at(0).get<double>(), point.at(1).get<double>());
    if (!(points.back().cwiseAbs().maxCoeff() < 1e7)) {
      throw DataError(fmt::format("{}: found the point {}, expected metres", path, point.dump()));
    }
  }
  return points;
}

void AddArea(const std::string& path, const Json& rings, BuildingPlan* plan) {
  Polygon area;
  for (const Json& ring : rings) {
    PlanPoints points = PointsAt(path, ring);
    if (points.size() > 1 && points.front() == points.back()) points.pop_back();
    if (points.size() < 3) continue;
    if (area.outline.empty())
      area.outline = points;
    else
      area.holes.push_back(points);
  }
  // Nothing else says whether an area is that of a wall or that of a room.
  if (!area.outline.empty()) AddFaces(area, MeanWidth(area) > kThickestWall_m, plan);
}

void AddGeometry(const std::string& path, const Json& json, BuildingPlan* plan,
                 std::vector<PlanPoints>* lines) {
  const auto type = json.at("type").get<std::string>();
  if (type == "FeatureCollection") {
    for (const Json& part : json.at("features")) AddGeometry(path, part, plan, lines);
  } else if (type == "Feature") {
    if (!json.at("geometry").is_null()) AddGeometry(path, json.at("geometry"), plan, lines);
  } else if (type == "GeometryCollection") {
    for (const Json& part : json.at("geometries")) AddGeometry(path, part, plan, lines);
  } else if (type == "Polygon") {
    AddArea(path, json.at("coordinates"), plan);
  } else if (type == "MultiPolygon") {
    for (const Json& rings : json.at("coordinates")) AddArea(path, rings, plan);
  } else if (type == "LineString") {
    lines->push_back(PointsAt(path, json.at("coordinates")));
  } else if (type == "MultiLineString") {
    for (const Json& line : json.at("coordinates")) lines->push_back(PointsAt(path, line));
  }
}

// Of a plan that slcmap exported, which says what its features are: rooms and lines would show the
// faces of walls a second time.
void AddExported(const std::string& path, const Json& json, BuildingPlan* plan) {
  for (const Json& feature : json.at("features")) {
    const auto kind = feature.at("properties").at("feature").get<std::string>();
    std::vector<PlanPoints> lines;
    if (kind == "wall") AddGeometry(path, feature, plan, &lines);
    if (kind != "opening") continue;
    AddGeometry(path, feature, plan, &lines);
    for (const PlanPoints& line : lines) {
      if (line.size() == 2) plan->openings.push_back({line.front(), line.back()});
    }
  }
}

std::vector<BuildingPlan> ReadGeoJsonPlan(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    BuildingPlan plan;
    std::vector<PlanPoints> lines;
    if (json.contains("slcmap")) {
      AddExported(path, json, &plan);
    } else {
      AddGeometry(path, json, &plan, &lines);
    }
    AddLines(lines, &plan);
    return std::vector<BuildingPlan>{plan};
  });
}

}  // namespace

// The extent of an upright plane along it.
PlannedFace FaceFrom(const BuildingPlane& plane) {
  const Vector2d normal = plane.normal.head<2>().normalized(), along(-normal.y(), normal.x());
  double from_m = 1e9, to_m = -1e9;
  for (const Eigen::Vector3d& p : plane.outline_world) {
    from_m = std::min(from_m, along.dot(p.head<2>()));
    to_m = std::max(to_m, along.dot(p.head<2>()));
  }
  const double offset_m = plane.offset_m / plane.normal.head<2>().norm();
  return {offset_m * normal + from_m * along, offset_m * normal + to_m * along, plane.sigma_m};
}

std::vector<PlannedOpening> OpeningsIn(const PlanWall& wall) {
  const Vector2d along = (wall.end - wall.start).normalized();
  const Vector2d middle = wall.start + 0.5 * wall.thickness_m * Vector2d(-along.y(), along.x());
  std::vector<PlannedOpening> openings;
  for (const PlanOpening& opening : wall.openings) {
    openings.push_back({middle + opening.from_m * along, middle + opening.to_m * along});
  }
  return openings;
}

namespace {

std::vector<BuildingPlan> ReadMapPlans(const std::string& folder) {
  const Building building = ReadBuilding(folder);
  std::vector<BuildingPlan> plans;
  for (const Storey& storey : building.storeys) {
    BuildingPlan plan;
    plan.name = fmt::format("storey {}", storey.id);
    for (const BuildingPlane& plane : building.planes) {
      if (plane.kind != PlaneKind::kWall || plane.inferred || plane.storey != storey.id) continue;
      plan.faces.push_back(FaceFrom(plane));
    }
    for (const PlanWall& wall : building.walls) {
      if (wall.storey != storey.id) continue;
      for (const PlannedOpening& opening : OpeningsIn(wall)) plan.openings.push_back(opening);
    }
    if (!plan.faces.empty()) plans.push_back(plan);
  }
  return plans;
}

std::vector<BuildingPlan> ReadAny(const std::string& path, double pixel_m) {
  namespace fs = std::filesystem;
  if (fs::is_directory(path)) return ReadMapPlans(path);
  if (fs::path(path).filename() == "plan.json") {
    const std::string folder = fs::path(path).parent_path();
    return ReadMapPlans(folder.empty() ? "." : folder);
  }
  const std::string extension = Extension(path);
  if (extension == ".dxf") return ReadDxfPlans(path);
  if (extension == ".ifc") return ReadIfcPlans(path);
  if (extension == ".geojson" || extension == ".json") return ReadGeoJsonPlan(path);
  return ReadImagePlan(path, pixel_m);
}

}  // namespace

std::vector<BuildingPlan> ReadPlans(const std::string& path, double pixel_m) {
  std::vector<BuildingPlan> plans = ReadAny(path, pixel_m);
  std::erase_if(plans, [](const BuildingPlan& plan) { return plan.faces.empty(); });
  if (plans.empty()) {
    throw DataError(fmt::format(
        "{}: found no wall, expected a plan: dark walls in an image, lines on layers named WALL in "
        "DXF, IfcWall in IFC, polygons or lines in metres, not degrees, in GeoJSON, or a map with "
        "walls",
        path));
  }
  CheckExtent(path, plans);
  for (BuildingPlan& plan : plans) {
    if (plan.openings.empty()) FindOpenings(&plan);
  }
  return plans;
}

}  // namespace slcmap::mapping
