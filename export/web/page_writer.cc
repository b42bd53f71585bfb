#include "export/web/page_writer.h"

#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

#include "data/core/error.h"
#include "data/io/json.h"
#include "data/version.h"
#include "export/scene/map_layers.h"
#include "export/scene/meshes.h"
#include "export/scene/scene.h"
#include "mapping/map/building.h"
#include "mapping/map/names.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline exporting {
namespace {

constexpr int kPageVersion = 1;

template <typename Value>
Json OptionalJson(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// The middle of what is there, in whole metres: coordinates relative to it are small.
Eigen::Vector3d GetOrigin(const MapResult& map) {
  Eigen::AlignedBox3d bounds;
  for (const StampedPose& pose : map.trajectory) bounds.extend(pose.T_world_imu.translation);
  for (const MapLine& line : map.lines) {
    bounds.extend(line.start_world);
    bounds.extend(line.end_world);
  }
  for (const MapPoint& point : map.points) bounds.extend(point.p_world);
  if (bounds.isEmpty()) return Eigen::Vector3d::Zero();
  return bounds.center().array().round();
}

void Append(const Eigen::Vector3d& p_m, std::vector<float>* values) {
  for (const double value : p_m) values->push_back(static_cast<float>(value));
}

// The same value of all lines, then of all marks, as an array.
template <typename Value, typename Get>
void AddOfLines(const MapResult& map, const std::string& name, Get get, PageArrays* arrays) {
  std::vector<Value> values;
  values.reserve(map.lines.size() + map.marks.size());
  for (const std::vector<MapLine>* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) values.push_back(static_cast<Value>(get(line)));
  }
  arrays->Add(name, values);
}

void AddLines(const MapResult& map, const Eigen::Vector3d& origin_world, PageArrays* arrays) {
  std::vector<float> ends;
  for (const std::vector<MapLine>* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) {
      Append(line.start_world - origin_world, &ends);
      Append(line.end_world - origin_world, &ends);
    }
  }
  arrays->Add("line_ends", ends);
  const auto add = [&]<typename Value>(const char* name, Value, auto member) {
    AddOfLines<Value>(
        map, name, [&](const MapLine& line) { return line.*member; }, arrays);
  };
  add("line_id", double{}, &MapLine::id);  // whole numbers, exact to 2^53
  add("line_axis", uint8_t{}, &MapLine::axis);
  add("line_kind", uint8_t{}, &MapLine::kind);
  add("line_recent", uint8_t{}, &MapLine::recent);
  add("line_world", int32_t{}, &MapLine::world);
  add("line_observations", int32_t{}, &MapLine::observations);
  add("line_sigma", float{}, &MapLine::sigma_m);
  add("line_deviation", float{}, &MapLine::deviation_rad);
  add("line_deviation_sigma", float{}, &MapLine::deviation_sigma_rad);
}

// From start to end, then the radius and the standard deviations of axis and radius.
void AddPipes(const MapResult& map, const Eigen::Vector3d& origin_world, PageArrays* arrays) {
  std::vector<float> pipes;
  for (const MapPipe& pipe : map.pipes) {
    Append(pipe.start_world - origin_world, &pipes);
    Append(pipe.end_world - origin_world, &pipes);
    for (const double value_m : {pipe.radius_m, pipe.sigma_m, pipe.radius_sigma_m}) {
      pipes.push_back(static_cast<float>(value_m));
    }
  }
  arrays->Add("pipes", pipes);
}

void AddPoints(const MapResult& map, const Eigen::Vector3d& origin_world, PageArrays* arrays) {
  std::vector<float> positions, sigmas;
  std::vector<int32_t> observations;
  for (const MapPoint& point : map.points) {
    Append(point.p_world - origin_world, &positions);
    sigmas.push_back(static_cast<float>(point.sigma_m));
    observations.push_back(point.observations);
  }
  arrays->Add("point_positions", positions);
  arrays->Add("point_sigma", sigmas);
  arrays->Add("point_observations", observations);
}

// Returns the chunks.
Json AddDense(const MapResult& map, const Eigen::Vector3d& origin_world, PageArrays* arrays,
              const Progress& progress) {
  const PagePoints points = ChunkPoints(map, origin_world, progress);
  arrays->Add("dense_x", points.x);
  arrays->Add("dense_y", points.y);
  arrays->Add("dense_z", points.z);
  arrays->Add("dense_grey", points.grey);
  arrays->Add("dense_sigma", points.sigma);
  arrays->Add("dense_source", points.source);
  Json chunks = Json::array();
  for (const PageChunk& chunk : points.chunks) {
    chunks.push_back(
        {{"corner", PointJson(chunk.corner_m)}, {"from", chunk.from}, {"count", chunk.count}});
  }
  return chunks;
}

void AddVoxels(const MapResult& map, const Eigen::Vector3d& origin_world, PageArrays* arrays) {
  std::vector<float> centres, sizes;
  for (const Voxel& voxel : map.occupancy.OccupiedVoxels()) {
    Append(voxel.centre_world - origin_world, &centres);
    sizes.push_back(static_cast<float>(voxel.size_m));
  }
  arrays->Add("voxel_centres", centres);
  arrays->Add("voxel_sizes", sizes);
}

void AddTrajectory(const MapResult& map, const Eigen::Vector3d& origin_world, PageArrays* arrays) {
  std::vector<float> positions, keyframes;
  std::vector<double> times_s, keyframe_times_s;
  const int64_t start_ns = map.trajectory.empty() ? 0 : map.trajectory.front().stamp_ns;
  for (const StampedPose& pose : map.trajectory) {
    Append(pose.T_world_imu.translation - origin_world, &positions);
    times_s.push_back(ToSeconds(pose.stamp_ns - start_ns));
  }
  for (const StampedPose& keyframe : map.keyframes) {
    const RigidTransform T_world_camera = keyframe.T_world_imu * map.rectified_rig.T_imu_camera[0];
    Append(T_world_camera.translation - origin_world, &keyframes);
    for (const double value : T_world_camera.rotation.coeffs()) {  // x, y, z, w
      keyframes.push_back(static_cast<float>(value));
    }
    keyframe_times_s.push_back(ToSeconds(keyframe.stamp_ns - start_ns));
  }
  arrays->Add("trajectory_positions", positions);
  arrays->Add("trajectory_times", times_s);
  arrays->Add("keyframe_poses", keyframes);
  arrays->Add("keyframe_times", keyframe_times_s);
}

void AddImages(const std::vector<PageImage>& images, PageArrays* arrays) {
  std::vector<uint8_t> bytes;
  std::vector<int32_t> keyframes, ends;
  for (const PageImage& image : images) {
    bytes.insert(bytes.end(), image.jpeg.begin(), image.jpeg.end());
    keyframes.push_back(static_cast<int32_t>(image.keyframe));
    ends.push_back(static_cast<int32_t>(bytes.size()));
  }
  arrays->Add("image_bytes", bytes);
  arrays->Add("image_keyframe", keyframes);
  arrays->Add("image_end", ends);
}

std::vector<Eigen::Vector3d> Relative(std::vector<Eigen::Vector3d> points,
                                      const Eigen::Vector3d& origin_world) {
  for (Eigen::Vector3d& point : points) point -= origin_world;
  return points;
}

PlanPoints Relative(PlanPoints points, const Eigen::Vector3d& origin_world) {
  for (Eigen::Vector2d& point : points) point -= origin_world.head<2>();
  return points;
}

Json PlaneJson(const BuildingPlane& plane, const Building& building,
               const Eigen::Vector3d& origin_world) {
  Json openings = Json::array();
  for (const PlaneOpening& opening : plane.openings) {
    openings.push_back({{"kind", GetName(opening.kind)},
                        {"walked", opening.walked},
                        {"width_m", RoundedForJson(opening.clear_width_m)},
                        {"height_m", RoundedForJson(opening.clear_height_m)},
                        {"outline", PointsJson(Relative(opening.outline_world, origin_world))}});
  }
  Json holes = Json::array();
  for (const auto& hole_world : LevelHoles(plane, building)) {
    holes.push_back(PointsJson(Relative(hole_world, origin_world)));
  }
  const Eigen::Vector3d& normal = plane.normal;
  return {{"id", plane.id},
          {"kind", GetName(plane.kind)},
          {"storey", plane.storey},
          {"normal", {normal.x(), normal.y(), normal.z()}},
          {"offset_m", plane.offset_m - normal.dot(origin_world)},
          {"sigma_m", plane.sigma_m},
          {"inferred", plane.inferred},
          {"outline", PointsJson(Relative(plane.outline_world, origin_world))},
          {"openings", openings},
          {"holes", holes},
          {"rooms", plane.room_ids}};
}

Json RoomJson(const Room& room, const Eigen::Vector3d& origin_world) {
  Json holes = Json::array();
  for (const PlanPoints& hole : room.polygon.holes) {
    holes.push_back(PointsJson(Relative(hole, origin_world)));
  }
  return {{"id", room.id},
          {"name", room.name},
          {"storey", room.storey},
          {"area_m2", room.area_m2},
          {"floor_m", RoundedForJson(room.floor_m - origin_world.z())},
          {"height_m", OptionalJson(room.height_m)},
          {"bounded", room.bounded},
          {"seen_share", OptionalJson(room.seen_share)},
          {"outline", PointsJson(Relative(room.polygon.outline, origin_world))},
          {"holes", holes}};
}

Json WallJson(const PlanWall& wall, const Eigen::Vector3d& origin_world) {
  Json openings = Json::array();
  for (const PlanOpening& opening : wall.openings) {
    openings.push_back({{"kind", GetName(opening.kind)},
                        {"walked", opening.walked},
                        {"name", opening.name},
                        {"from_m", RoundedForJson(opening.from_m)},
                        {"to_m", RoundedForJson(opening.to_m)},
                        {"sill_m", RoundedForJson(opening.sill_m)},
                        {"height_m", RoundedForJson(opening.clear_height_m)}});
  }
  const Eigen::Vector2d origin = origin_world.head<2>();
  return {{"id", wall.id},
          {"storey", wall.storey},
          {"start", PointJson(Eigen::Vector2d(wall.start - origin))},
          {"end", PointJson(Eigen::Vector2d(wall.end - origin))},
          {"thickness_m", wall.thickness_m},
          {"thickness_assumed", wall.thickness_assumed},
          {"sigma_m", wall.sigma_m},
          {"planes", wall.plane_ids},
          {"seen_share", OptionalJson(wall.seen_share)},
          {"openings", openings}};
}

Json StoreyJson(const Storey& storey, const Eigen::Vector3d& origin_world) {
  std::optional<double> ceiling_m = storey.ceiling_m;
  if (ceiling_m) *ceiling_m -= origin_world.z();
  return {{"id", storey.id},
          {"name", storey.name},
          {"floor_m", storey.floor_m - origin_world.z()},
          {"ceiling_m", OptionalJson(ceiling_m)}};
}

template <typename Part, typename ToJson>
Json PartsJson(const std::vector<Part>& parts, const Eigen::Vector3d& origin_world,
               ToJson part_json) {
  Json json = Json::array();
  for (const Part& part : parts) json.push_back(part_json(part, origin_world));
  return json;
}

Json BuildingJson(const Building& building, const Eigen::Vector3d& origin_world) {
  const Eigen::Vector3d x_axis =
      building.T_map_world.rotation.conjugate() * Eigen::Vector3d::UnitX();
  const auto plane_json = [&](const BuildingPlane& plane, const Eigen::Vector3d& origin) {
    return PlaneJson(plane, building, origin);
  };
  return {{"name", building.name},
          {"heading_rad", std::atan2(x_axis.y(), x_axis.x())},
          {"storeys", PartsJson(building.storeys, origin_world, StoreyJson)},
          {"planes", PartsJson(building.planes, origin_world, plane_json)},
          {"rooms", PartsJson(building.rooms, origin_world, RoomJson)},
          {"walls", PartsJson(building.walls, origin_world, WallJson)}};
}

// What was built otherwise than it was planned.
Json DeviationsJson(const MapResult& map, const Eigen::Vector3d& origin_world) {
  Json parts = Json::array();
  if (!map.plan) return parts;
  const RigidTransform T_world_plan = map.plan->T_plan_world.Inverse();
  const auto place = [&](const Eigen::Vector2d& p_plan) {
    const Eigen::Vector3d p_world = T_world_plan * Eigen::Vector3d(p_plan.x(), p_plan.y(), 0);
    return PointJson(Eigen::Vector2d((p_world - origin_world).head<2>()));
  };
  const auto add = [&](const auto& part) {
    if (part.status == PlanStatus::kAsPlanned) return;
    parts.push_back({{"status", GetName(part.status)},
                     {"storey", map.plan->storey},
                     {"start", place(part.start_plan)},
                     {"end", place(part.end_plan)},
                     {"text", WriteDeviation(part)}});
  };
  for (const WallDeviation& wall : map.plan->walls) add(wall);
  for (const OpeningDeviation& opening : map.plan->openings) add(opening);
  return parts;
}

// Where the page's axes end in the coordinates of a file of names, and its origin.
Json NamesJson(const MapSource& source, const Eigen::Vector3d& origin_world) {
  const std::array<Eigen::Vector3d, 4> world = FrameOfNames(source);
  Json frame = Json::array();
  for (int i = 0; i < 4; ++i) {
    Eigen::Vector3d p = origin_world;
    if (i < 3) p[i] += 1;
    Eigen::Vector3d place = world[3];
    for (int k = 0; k < 3; ++k) place += p[k] * (world[static_cast<std::size_t>(k)] - world[3]);
    frame.push_back({place.x(), place.y(), place.z()});
  }
  return {{"crs", source.georeference ? source.georeference->crs : ""}, {"frame", frame}};
}

Json ArraysJson(const PageArrays& arrays) {
  Json json = Json::object();
  for (const PageArrays::Entry& entry : arrays.entries()) {
    json[entry.name] = {{"type", entry.type}, {"offset", entry.offset}, {"count", entry.count}};
  }
  return json;
}

std::string Block(const Json& document, const PageArrays& arrays) {
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  const auto behind_length = text.size() + sizeof(uint32_t);
  text.append(
      (PageArrays::kAlignment - behind_length % PageArrays::kAlignment) % PageArrays::kAlignment,
      ' ');
  const auto length = static_cast<uint32_t>(text.size());
  std::string block(sizeof length, '\0');
  std::memcpy(block.data(), &length, sizeof length);
  return block + text + arrays.bytes();
}

}  // namespace

std::string PackForPage(const MapResult& map, const std::string& title,
                        const std::vector<PageImage>& images, const Progress& progress) {
  const Eigen::Vector3d origin_world = GetOrigin(map);
  PageArrays arrays;
  AddLines(map, origin_world, &arrays);
  AddPipes(map, origin_world, &arrays);
  AddPoints(map, origin_world, &arrays);
  const Json chunks = AddDense(map, origin_world, &arrays, progress);
  AddVoxels(map, origin_world, &arrays);
  AddTrajectory(map, origin_world, &arrays);
  AddImages(images, &arrays);
  Json document = {
      {"format", "slcmap page"},
      {"version", kPageVersion},
      {"title", title},
      {"slcmap", kVersion},
      {"map", map.id},
      {"run", map.source.run_id},
      {"method", map.method},
      {"complete", map.complete},
      {"partial_reason", map.partial_reason},
      {"seen_share", OptionalJson(map.seen_share)},
      {"origin", {origin_world.x(), origin_world.y(), origin_world.z()}},
      {"georeference", GeoreferenceJson(map.source.georeference)},
      {"marks", map.marks.size()},
      {"chunk_m", kPageChunk_m},
      {"dense_chunks", chunks},
      {"trajectory_gap_s", TrajectoryGap_s(map.trajectory)},
      {"camera_corners", PointsJson(FrustumCorners(map.rectified_rig.cameras[0], 1.0))},
      {"names", NamesJson(map.source, origin_world)},
      {"building", BuildingJson(map.building, origin_world)},
      {"deviations", DeviationsJson(map, origin_world)}};
  document["arrays"] = ArraysJson(arrays);
  return Block(document, arrays);
}

namespace {

constexpr std::string_view kMark = "@SLCMAP_MAP@";

// In the zlib format, which browsers call "deflate".
std::string Deflate(std::string bytes, const Progress& progress) {
  z_stream stream{};
  if (deflateInit(&stream, Z_DEFAULT_COMPRESSION) != Z_OK) throw Error("zlib: cannot be set up");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, deflateEnd);
  constexpr std::size_t kStep = 1 << 20;
  std::string compressed, room(kStep, '\0');
  std::size_t done = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    progress.ReportOrStop(static_cast<double>(done) / static_cast<double>(bytes.size() + 1));
    const std::size_t part = std::min(kStep, bytes.size() - done);
    stream.next_in = reinterpret_cast<Bytef*>(bytes.data() + done);
    stream.avail_in = static_cast<uInt>(part);
    done += part;
    // What earlier parts left inside may need more room than this part does.
    do {
      stream.next_out = reinterpret_cast<Bytef*>(room.data());
      stream.avail_out = static_cast<uInt>(room.size());
      state = deflate(&stream, done == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
      compressed.append(room, 0, room.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  }
  return compressed;
}

std::string Base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < count ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text.push_back(k <= count ? kDigits[(group >> (18 - 6 * k)) & 63] : '=');
    }
  }
  return text;
}

std::size_t FindMark(const std::string& page_template) {
  const std::size_t at = page_template.find(kMark);
  const bool once =
      at != std::string::npos && page_template.find(kMark, at + 1) == std::string::npos;
  if (once) return at;
  throw ConfigError(fmt::format("page: found a template {} the mark {}, expected it once",
                                at == std::string::npos ? "without" : "with several of", kMark));
}

}  // namespace

std::string MakePage(const MapResult& map, const std::string& page_template,
                     const std::string& title, const std::vector<PageImage>& images,
                     const Progress& progress) {
  const std::size_t mark = FindMark(page_template);
  std::string pack =
      PackForPage(map, title.empty() ? map.id : title, images, progress.Part(0, 0.3));
  const std::string text = Base64(Deflate(std::move(pack), progress.Part(0.3, 0.95)));
  std::string page;
  page.reserve(page_template.size() + text.size());
  page.append(page_template, 0, mark).append(text);
  page.append(page_template, mark + kMark.size());
  return page;
}

std::string MakeTilesPage(const std::string& page_template,
                          const std::vector<std::string>& tilesets) {
  std::string list = Json(tilesets).dump(-1, ' ', true, Json::error_handler_t::replace);
  // In a script's element only "</" could end it.
  for (std::size_t at = 0; (at = list.find('<', at)) != list.npos;) list.replace(at, 1, "\\u003c");
  return std::string(page_template).replace(FindMark(page_template), kMark.size(), list);
}

}  // namespace slcmap::exporting
