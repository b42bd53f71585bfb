#include "data/external/external_map.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/core/error.h"
#include "data/external/readers.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKinds =
    "a PLY, OBJ, DXF, PCD or LAS file, text with points or segments, or a folder of limap or of a "
    "map";

// What no reader here takes, by its first bytes, and what makes it one that they do.
struct Unread {
  std::string_view begins, name, remedy;
};
constexpr Unread kUnread[] = {
    {"DRACO", "points that Draco compressed", "decompress with draco_decoder -o FILE.ply"},
    {"\x1f\x8b", "a file that gzip compressed", "unpack with gunzip"},
    {"PK\x03\x04", "a ZIP archive", "unpack it and name what is in it"},
    {"ASTM-E57", "an E57 file", "convert it to LAS or PLY, as with CloudCompare"},
    {"glTF", "a glTF file", "export it as PLY or OBJ"},
    {"AutoCAD Binary DXF", "a binary DXF", "save it as ASCII DXF (R12)"},
    {"AC10", "a DWG drawing", "save it as DXF (R12)"},
    {"\x93NUMPY", "a NumPy array", "save it as text or OBJ (limap: limapio.save_obj)"},
    {"#ROSBAG", "a ROS bag", "write the message as text: rostopic echo -p, or as PCD or PLY"}};

std::string LowerExtension(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

void RefuseUnread(const std::string& path, std::string_view bytes) {
  for (const Unread& unread : kUnread) {
    if (!bytes.starts_with(unread.begins)) continue;
    throw DataError(
        fmt::format("{}: found {}, expected {}; {}", path, unread.name, kKinds, unread.remedy));
  }
  if (LowerExtension(path) == ".drc" || LowerExtension(path) == ".npz") {
    throw DataError(fmt::format("{}: found a {} file, expected {}; save it as PLY", path,
                                LowerExtension(path), kKinds));
  }
}

// Whether a point is one that was laid on a plane, where the file says so.
std::vector<bool> FilledPoints(const PlyElement& vertices) {
  std::vector<bool> filled(vertices.size(), false);
  for (const PlyProperty& property : vertices.properties) {
    if (property.name != "source") continue;
    for (size_t i = 0; i < filled.size(); ++i) filled[i] = property.values[i] == 1;
  }
  return filled;
}

void AddFaces(const std::string& path, const PlyFile& file,
              const std::vector<Eigen::Vector3d>& vertices, ExternalMap* map) {
  const auto count = static_cast<int32_t>(vertices.size());
  for (size_t i = 0; i < file.faces.size(); ++i) {
    const std::vector<int32_t>& face = file.faces[i];
    for (const int32_t vertex : face) {
      if (vertex < count) continue;
      throw DataError(fmt::format("{}: face row {}: found vertex {}, expected one of {}", path,
                                  i + 1, vertex, count));
    }
    for (size_t k = 2; k < face.size(); ++k) {
      const auto at = [&](size_t corner) { return vertices[static_cast<size_t>(face[corner])]; };
      map->triangles.push_back({at(0), at(k - 1), at(k)});
    }
  }
}

bool HasElement(const PlyFile& file, const char* name) {
  return std::any_of(file.elements.begin(), file.elements.end(),
                     [&](const PlyElement& e) { return e.name == name && e.size() > 0; });
}

// Of a file of edges, the points at which none of them ends.
void AddLooseVertices(const PlyFile& file, const std::string& path, ExternalMap* map) {
  const std::vector<Eigen::Vector3d> positions = Positions(file.Get("vertex", path), path);
  std::vector<bool> is_end(positions.size(), false);
  for (const char* end : {"vertex1", "vertex2"}) {
    for (const double vertex : file.Get("edge", path).Get(end, path).values) {
      is_end[static_cast<size_t>(vertex)] = true;
    }
  }
  for (size_t i = 0; i < positions.size(); ++i) {
    if (!is_end[i]) AddPoint(positions[i], map);
  }
  if (!map->points.empty()) map->format = "PLY with edges and points";
}

// Text may have more digits than its type, and then is no float.
double FindFloatStep(const PlyElement& vertices) {
  double largest = 0;
  for (const PlyProperty& property : vertices.properties) {
    const std::string& name = property.name;
    if ((name != "x" && name != "y" && name != "z") || property.type != PlyType::kFloat) continue;
    for (const double value : property.values) {
      if (!std::isfinite(value)) continue;
      if (static_cast<double>(static_cast<float>(value)) != value) return 0;
      largest = std::max(largest, std::abs(value));
    }
  }
  return largest > 0 ? GetFloatStep(largest) : 0;
}

ExternalMap ReadPlyMap(const std::string& path) {
  const PlyFile file = ReadPly(path);
  ExternalMap map;
  for (const PlyElement& element : file.elements) {
    if (element.name == "vertex") map.float_step = FindFloatStep(element);
  }
  if (HasElement(file, "edge")) {
    map.format = "PLY with edges";
    map.lines = Segments(file, path);
    AddLooseVertices(file, path, &map);
    return map;
  }
  if (!HasElement(file, "vertex")) {
    throw DataError(path + ": found a PLY without vertices, expected points, edges or faces");
  }
  const PlyElement& vertices = file.Get("vertex", path);
  if (!file.faces.empty()) {
    map.format = "PLY with faces";
    AddFaces(path, file, Positions(vertices, path), &map);
    return map;
  }
  map.format = "PLY with points";
  const std::vector<bool> filled = FilledPoints(vertices);
  const std::vector<double>&x = vertices.Get("x", path).values, &y = vertices.Get("y", path).values,
        &z = vertices.Get("z", path).values;
  ExternalMap laid;
  for (size_t i = 0; i < vertices.size(); ++i) {
    AddPoint({x[i], y[i], z[i]}, filled[i] ? &laid : &map);
  }
  map.filled = std::move(laid.points);
  map.left_out += laid.left_out;
  return map;
}

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// The files of a folder whose names begin so and end so, by name.
std::vector<std::string> ListNamed(const fs::path& folder, std::string_view begins,
                                   std::string_view ends) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begins) && name.ends_with(ends)) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

ExternalMap ReadOwnMap(const fs::path& folder) {
  ExternalMap map;
  if (Exists(folder / "lines.ply")) map = ReadPlyMap(folder / "lines.ply");
  if (Exists(folder / "dense.ply")) {
    ExternalMap cloud = ReadPlyMap(folder / "dense.ply");
    map.points = std::move(cloud.points);
    map.filled = std::move(cloud.filled);
    map.left_out = cloud.left_out;
  }
  map.format = "map of slcmap";
  return map;
}

ExternalMap ReadFolder(const fs::path& folder) {
  if (Exists(folder / "map.json") || Exists(folder / "dense.ply")) return ReadOwnMap(folder);
  const fs::path tracks = Exists(folder / "finaltracks") ? folder / "finaltracks" : folder;
  ExternalMap map;
  for (const std::string& track : ListNamed(tracks, "track_", ".txt")) AddTrack(track, &map);
  if (!map.lines.empty()) {
    map.format = "limap's tracks";
    return map;
  }
  if (Exists(folder / "alltracks.txt")) return ReadExternalMap(folder / "alltracks.txt");
  const std::vector<std::string> drawn = ListNamed(folder, "triangulated_lines", ".obj");
  if (!drawn.empty()) return ReadExternalMap(drawn.front());
  throw DataError(fmt::format(
      "{}: found a folder without finaltracks, alltracks.txt, triangulated_lines_nv*.obj, map.json "
      "or dense.ply, expected {}",
      folder.string(), kKinds));
}

ExternalMap ReadMapFile(const std::string& path) {
  const std::string bytes = ReadFile(path);
  if (bytes.empty()) throw DataError(fmt::format("{}: found no bytes, expected {}", path, kKinds));
  RefuseUnread(path, bytes);
  if (bytes.starts_with("ply")) return ReadPlyMap(path);
  if (bytes.starts_with("LASF")) return ReadLas(path, bytes);
  const std::string extension = LowerExtension(path);
  if (extension == ".obj") return ReadObj(path, bytes);
  if (extension == ".dxf") return ReadDxf(path, bytes);
  if (extension == ".pcd" || bytes.starts_with("# .PCD")) return ReadPcd(path, bytes);
  if (bytes.find('\0') != std::string::npos) {
    throw DataError(
        fmt::format("{}: found a binary file of no known kind, expected {}", path, kKinds));
  }
  return ReadMapText(path, bytes);
}

}  // namespace

void AddPoint(const Eigen::Vector3d& p, ExternalMap* map) {
  if (p.allFinite()) {
    map->points.push_back(p);
  } else {
    ++map->left_out;
  }
}

ExternalMap ReadExternalMap(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    throw DataError(fmt::format("{}: found nothing, expected {}", path, kKinds));
  }
  ExternalMap map = fs::is_directory(path, error) ? ReadFolder(path) : ReadMapFile(path);
  const size_t pieces = map.lines.size();
  std::erase_if(map.lines, [](const PlySegment& s) {
    return !s.start_world.allFinite() || !s.end_world.allFinite() ||
           (s.end_world - s.start_world).norm() <= 0;
  });
  map.left_out += static_cast<int64_t>(pieces - map.lines.size());
  if (map.lines.empty() && map.points.empty() && map.triangles.empty()) {
    throw DataError(fmt::format(
        "{} ({}): found no points, no lines and no faces{}, expected a map "
        "with something in it",
        path, map.format,
        map.left_out > 0 ? fmt::format(" ({} left out, not finite or noise)", map.left_out) : ""));
  }
  if (map.left_out > 0) {
    spdlog::warn("{}: left out {} places that are not finite, without length, or noise", path,
                 map.left_out);
  }
  return map;
}

}  // namespace slcmap::data
