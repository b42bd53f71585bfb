// Maps and runs on disk.
#include <pybind11/stl/filesystem.h>
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <optional>

#include "apps/evaluation/trajectory_metrics.h"
#include "apps/python/arrays.h"
#include "data/core/verdict.h"
#include "export/scene/map_layers.h"
#include "mapping/map/map_folder.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline python {
namespace {

using namespace py::literals;
using LoadedMap = py::class_<MapResult>;

// A property whose columns the map keeps.
template <typename Rows, typename Member>
void AddColumn(LoadedMap& map, const char* name, Rows MapResult::*rows, Member member,
               const char* words, int columns = 0) {
  map.def_property_readonly(
      name,
      [=](const py::object& self) {
        return Column(self.cast<const MapResult&>().*rows, member, self, columns);
      },
      words);
}

constexpr const char* kAxisNames[] = {"x", "y", "vertical", "none", "sloped"};

py::list AxisNames(const std::vector<MapLine>& lines) {
  py::list names;
  for (const MapLine& line : lines) names.append(kAxisNames[static_cast<int>(line.axis)]);
  return names;
}

py::list KindNames(const MapResult& map) {
  py::list names;
  for (const MapLine& line : map.lines)
    names.append(IsJunction(line) ? "junction" : GetName(line.kind));
  return names;
}

// The ends lie side by side.
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
static_assert(offsetof(MapLine, end_world) ==
              offsetof(MapLine, start_world) + sizeof(Eigen::Vector3d));

void AddLines(LoadedMap& map) {
  AddColumn(map, "lines", &MapResult::lines, &MapLine::start_world,
            "n x 6: start and end in the world. A line with gaps has a row for each piece.", 6);
  AddColumn(map, "marks", &MapResult::marks, &MapLine::start_world,
            "The same of lines that are on surfaces, and no edges of them.", 6);
  AddColumn(map, "line_ids", &MapResult::lines, &MapLine::id, "n");
  AddColumn(map, "line_probability", &MapResult::lines, &MapLine::edge_probability,
            "n: that it is an edge, and no mark.");
  AddColumn(map, "line_sigma_m", &MapResult::lines, &MapLine::sigma_m,
            "n: standard deviation across it, where that is largest.");
  AddColumn(map, "line_deviation_rad", &MapResult::lines, &MapLine::deviation_rad,
            "n: between it and its axis.");
  AddColumn(map, "line_observations", &MapResult::lines, &MapLine::observations,
            "n: views that saw it; 0 of junctions.");
  map.def_property_readonly(
      "line_axes", [](const MapResult& m) { return AxisNames(m.lines); },
      "n of 'x', 'y', 'vertical', 'none', 'sloped'.");
  map.def_property_readonly("line_kinds", &KindNames,
                            "n of 'edge', 'unknown', 'pipe', 'junction' (of planes, not seen).");
}

void AddClouds(LoadedMap& map) {
  AddColumn(map, "points", &MapResult::points, &MapPoint::p_world, "n x 3: the sparse cloud.");
  AddColumn(map, "point_sigma_m", &MapResult::points, &MapPoint::sigma_m, "n");
  AddColumn(map, "point_line_ids", &MapResult::points, &MapPoint::line_id,
            "n: of the line that it lies on, or -1.");
  AddColumn(map, "dense", &MapResult::dense, &DensePoint::p_world, "n x 3: measured by stereo.");
  AddColumn(map, "dense_normals", &MapResult::dense, &DensePoint::normal_world,
            "n x 3: towards the cameras.");
  AddColumn(map, "dense_grey", &MapResult::dense, &DensePoint::grey,
            "n, uint8: the images' colour.");
  AddColumn(map, "dense_sigma_m", &MapResult::dense, &DensePoint::sigma_m, "n: along the normals.");
  AddColumn(map, "filled", &MapResult::filled, &DensePoint::p_world,
            "n x 3: derived, on planes of the building where nothing was measured.");
  AddColumn(map, "filled_normals", &MapResult::filled, &DensePoint::normal_world, "n x 3.");
  map.def_property_readonly(
      "occupied",
      [](const MapResult& m) {
        std::vector<Eigen::Vector4d> voxels;
        for (const Voxel& voxel : m.occupancy.OccupiedVoxels()) {
          voxels.emplace_back();
          voxels.back() << voxel.centre_world, voxel.size_m;
        }
        return ToArray(voxels);
      },
      "n x 4: middles and edges of occupied voxels.");
  map.def_property_readonly("voxel_m",
                            [](const MapResult& m) { return m.occupancy.resolution_m(); });
}

py::dict ToDict(const BuildingPlane& plane) {
  return py::dict("id"_a = plane.id, "kind"_a = GetName(plane.kind), "storey"_a = plane.storey,
                  "normal"_a = plane.normal, "offset_m"_a = plane.offset_m,
                  "sigma_m"_a = plane.sigma_m, "outline"_a = ToArray(plane.outline_world),
                  "room_ids"_a = plane.room_ids, "inferred"_a = plane.inferred);
}

py::dict ToDict(const Room& room) {
  py::list holes;
  for (const PlanPoints& hole : room.polygon.holes) holes.append(ToArray(hole));
  return py::dict("id"_a = room.id, "name"_a = GetTitle(room), "storey"_a = room.storey,
                  "polygon"_a = ToArray(room.polygon.outline), "holes"_a = holes,
                  "area_m2"_a = room.area_m2, "floor_m"_a = room.floor_m,
                  "height_m"_a = room.height_m);
}

py::dict ToDict(const PlanWall& wall) {
  return py::dict("id"_a = wall.id, "storey"_a = wall.storey, "start"_a = wall.start,
                  "end"_a = wall.end, "thickness_m"_a = wall.thickness_m,
                  "thickness_assumed"_a = wall.thickness_assumed, "sigma_m"_a = wall.sigma_m,
                  "plane_ids"_a = wall.plane_ids);
}

py::dict ToDict(const MapPipe& pipe) {
  return py::dict("id"_a = pipe.id, "axis"_a = kAxisNames[static_cast<int>(pipe.axis)],
                  "start"_a = pipe.start_world, "end"_a = pipe.end_world,
                  "radius_m"_a = pipe.radius_m, "sigma_m"_a = pipe.sigma_m);
}

template <typename Rows>
py::list ToDicts(const Rows& rows) {
  py::list dicts;
  for (const auto& row : rows) dicts.append(ToDict(row));
  return dicts;
}

py::list Openings(const MapResult& map) {
  py::list dicts;
  for (const BuildingPlane& plane : map.building.planes) {
    for (const PlaneOpening& opening : plane.openings) {
      dicts.append(py::dict("plane_id"_a = plane.id, "kind"_a = GetName(opening.kind),
                            "walked"_a = opening.walked, "clear_width_m"_a = opening.clear_width_m,
                            "clear_height_m"_a = opening.clear_height_m,
                            "outline"_a = ToArray(opening.outline_world)));
    }
  }
  return dicts;
}

void AddBuilding(LoadedMap& map) {
  map.def_property_readonly(
         "planes", [](const MapResult& m) { return ToDicts(m.building.planes); },
         "Dicts: id, kind ('wall', 'floor', 'ceiling', 'other'), normal and "
         "offset_m (normal . p = offset_m), outline (n x 3), sigma_m ...")
      .def_property_readonly("openings", &Openings,
                             "Dicts: kind ('door', 'window', 'passage'), plane_id, clear_width_m, "
                             "clear_height_m, outline (n x 3), walked.")
      .def_property_readonly(
          "rooms", [](const MapResult& m) { return ToDicts(m.building.rooms); },
          "Dicts: id, name, polygon (n x 2, counter-clockwise), holes, area_m2, "
          "floor_m, height_m (None where no ceiling was seen).")
      .def_property_readonly(
          "walls", [](const MapResult& m) { return ToDicts(m.building.walls); },
          "Dicts of the plan: start and end (2) of the face, thickness_m ...")
      .def_property_readonly(
          "pipes", [](const MapResult& m) { return ToDicts(m.pipes); },
          "Dicts: start and end (3) of the axis, radius_m ...");
}

std::string VerdictWord(const std::optional<Verdict>& verdict) {
  return verdict ? VerdictLevelName(verdict->level) : "";
}

std::vector<std::string> VerdictReasons(const std::optional<Verdict>& verdict) {
  std::vector<std::string> reasons;
  if (!verdict) return reasons;
  for (const VerdictReason& reason : verdict->reasons) reasons.push_back(InWords(reason));
  return reasons;
}

std::string Describe(const MapResult& map) {
  return fmt::format("<slcmap.Map {} poses, {} lines, {} points, {} dense, {} planes, {} rooms{}>",
                     map.trajectory.size(), map.lines.size(), map.points.size(), CountDense(map),
                     map.building.planes.size(), map.building.rooms.size(),
                     map.complete ? "" : ", partial");
}

void AddMapClass(py::module_& module) {
  LoadedMap map(module, "Map",
                "A map folder in memory: metres, z up, in the world of the map. "
                "Arrays are views that keep the map.");
  map.def_static(
         "load",
         [](const std::filesystem::path& folder, bool accept_changed) {
           return WithoutLock(
               [&] { return ReadMapFolder(folder.string(), {.accept_changed = accept_changed}); });
         },
         py::arg("folder"), py::arg("accept_changed") = false, "Throws DataError.")
      .def_property_readonly("complete", [](const MapResult& m) { return m.complete; })
      .def_property_readonly("method", [](const MapResult& m) { return m.method; })
      .def_property_readonly(
          "warnings", [](const MapResult& m) { return m.warnings; }, "Counts by kind.")
      .def_property_readonly(
          "verdict", [](const MapResult& m) { return VerdictWord(m.verdict); },
          "'good', 'doubtful', 'failed' or ''.")
      .def_property_readonly(
          "trajectory", [](const MapResult& m) { return PyTrajectory{m.trajectory}; },
          "A pose an image.")
      .def_property_readonly("keyframes",
                             [](const MapResult& m) { return PyTrajectory{m.keyframes}; })
      .def_property_readonly(
          "rig", [](const MapResult& m) { return m.rectified_rig; }, "The rectified cameras.")
      .def("__repr__", &Describe);
  AddLines(map);
  AddClouds(map);
  AddBuilding(map);
}

void AddRunClass(py::module_& module) {
  py::class_<OdometryRun>(module, "Run", "A run folder in memory: what odometry found.")
      .def_static(
          "load",
          [](const std::filesystem::path& folder) {
            return WithoutLock([&] { return ReadRunFolder(folder.string()); });
          },
          py::arg("folder"), "Throws DataError.")
      .def_readonly("method", &OdometryRun::method)
      .def_readonly("complete", &OdometryRun::complete)
      .def_readonly("warnings", &OdometryRun::warnings, "Counts by kind.")
      .def_property_readonly(
          "verdict", [](const OdometryRun& r) { return VerdictWord(r.verdict); },
          "'good', 'doubtful' or 'failed'.")
      .def_property_readonly(
          "reasons", [](const OdometryRun& r) { return VerdictReasons(r.verdict); },
          "Of the verdict, the worst first, with remedies.")
      .def_property_readonly(
          "trajectory", [](const OdometryRun& r) { return PyTrajectory{OnlinePoses(r.states)}; },
          "A pose an image, without look-ahead.")
      .def("__repr__", [](const OdometryRun& r) {
        return fmt::format("<slcmap.Run '{}': {} poses, {} keyframes, {} landmarks, {} lines, {}>",
                           r.method, r.states.size(), r.keyframes.size(), r.landmarks.size(),
                           r.lines.size(), VerdictWord(r.verdict));
      });
}

}  // namespace

void AddMap(py::module_& module) {
  AddMapClass(module);
  AddRunClass(module);
}

}  // namespace slcmap::python
