#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <span>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "export/scene/building_solids.h"
#include "export/scene/formats.h"
#include "export/web/cloud_tiles.h"
#include "export/web/page_writer.h"
#include "mapping/map/building.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline exporting {
namespace {

constexpr std::size_t kLinesOfTile = 10000;
constexpr Colour kPointColour{159, 176, 196};

double LengthOfLine(const MapLine& line) { return (line.end_world - line.start_world).norm(); }

Eigen::Vector3d ComputeMiddle(const MapLine& line) {
  return 0.5 * (line.start_world + line.end_world);
}

class LineTiler {
 public:
  LineTiler(const std::string& folder, const std::string& name, const MapResult& map,
            std::vector<std::string>* paths, const Progress& progress)
      : folder_(folder), name_(name), map_(map), paths_(paths), progress_(progress) {}

  TileOfSet Write() {
    MakeFolder(folder_ + "/" + name_);
    std::vector<std::size_t> lines(map_.lines.size());
    std::iota(lines.begin(), lines.end(), std::size_t{0});
    std::stable_sort(lines.begin(), lines.end(), [&](std::size_t a, std::size_t b) {
      return LengthOfLine(map_.lines[a]) > LengthOfLine(map_.lines[b]);
    });
    TileOfSet root = WriteTile(lines);
    root.json["extras"] = {{"layer", name_}, {"lines", lines.size()}};
    return root;
  }

 private:
  // Of lines by length, the longest first.
  TileOfSet WriteTile(std::span<std::size_t> lines) {
    progress_.ReportOrStop(static_cast<double>(done_) / static_cast<double>(map_.lines.size()));
    const std::size_t own = std::min(lines.size(), kLinesOfTile);
    TileOfSet tile;
    tile.json["refine"] = "ADD";
    const PartModel model = MakeLinesModel(map_, lines.first(own));
    tile.json["content"]["uri"] = AddFile(model.bytes);
    tile.box = model.box;
    done_ += own;
    lines = lines.subspan(own);
    tile.json["geometricError"] = lines.empty() ? 0 : LengthOfLine(map_.lines[lines[0]]);
    for (const auto half : Halves(lines)) {
      if (half.empty()) continue;
      const TileOfSet child = WriteTile(half);
      tile.box.extend(child.box);
      tile.json["children"].push_back(child.json);
    }
    tile.json["boundingVolume"] = BoundingVolume(tile.box);
    return tile;
  }

  // On either side of the middle one along the axis along which they are spread most. Their order
  // stays.
  std::array<std::span<std::size_t>, 2> Halves(std::span<std::size_t> lines) const {
    Eigen::AlignedBox3d box;
    for (const std::size_t i : lines) box.extend(ComputeMiddle(map_.lines[i]));
    if (lines.empty()) return {};
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto place_m = [&](std::size_t i) { return ComputeMiddle(map_.lines[i])[axis]; };
    std::vector<double> places_m;
    for (const std::size_t i : lines) places_m.push_back(place_m(i));
    const auto middle = places_m.begin() + std::ssize(places_m) / 2;
    std::nth_element(places_m.begin(), middle, places_m.end());
    const auto second = std::stable_partition(lines.begin(), lines.end(),
                                              [&](std::size_t i) { return place_m(i) < *middle; });
    const auto count = static_cast<std::size_t>(second - lines.begin());
    return {lines.first(count), lines.subspan(count)};
  }

  std::string AddFile(const std::string& bytes) {
    const std::string uri = fmt::format("{}/{}.glb", name_, files_++);
    paths_->push_back(folder_ + "/" + uri);
    WriteFile(paths_->back(), bytes);
    return uri;
  }

  const std::string folder_, name_;
  const MapResult& map_;
  std::vector<std::string>* paths_;
  const Progress& progress_;
  std::size_t done_ = 0;
  int files_ = 0;
};

}  // namespace

TileOfSet WriteLineTiles(const std::string& folder, const std::string& name, const MapResult& map,
                         std::vector<std::string>* paths, const Progress& progress) {
  return LineTiler(folder, name, map, paths, progress).Write();
}

namespace {

// What of a map is drawn of a storey.
MapResult PartOfStorey(const MapResult& map, std::optional<int64_t> storey) {
  MapResult part;
  part.building = map.building;
  const auto id = [&](std::optional<std::size_t> index) {
    return index ? std::optional(map.building.storeys[*index].id) : std::nullopt;
  };
  const auto elsewhere = [&](const auto& it) {
    return id(StoreyOfId(map.building, it.storey)) != storey;
  };
  std::erase_if(part.building.walls, elsewhere);
  std::erase_if(part.building.planes, elsewhere);
  for (const MapPipe& pipe : map.pipes) {
    if (id(StoreyAtMiddle(map.building, pipe)) == storey) part.pipes.push_back(pipe);
  }
  return part;
}

// From a frame with x to the east, y to the north and z up to the axes of the Earth, at a place on
// the ellipsoid of WGS 84.
Eigen::Isometry3d EastNorthUpOnEarth(double latitude_rad, double longitude_rad, double height_m) {
  constexpr double kRadius_m = 6378137, kFlattening = 1 / 298.257223563;
  constexpr double kEccentricity2 = kFlattening * (2 - kFlattening);
  const double sine = std::sin(latitude_rad), cosine = std::cos(latitude_rad);
  const double across_m = kRadius_m / std::sqrt(1 - kEccentricity2 * sine * sine);
  const Eigen::Vector3d outward(cosine * std::cos(longitude_rad), cosine * std::sin(longitude_rad),
                                sine);
  const Eigen::Vector3d east(-std::sin(longitude_rad), std::cos(longitude_rad), 0);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << east, outward.cross(east), outward;
  T.translation() = (across_m + height_m) * outward;
  T.translation().z() -= kEccentricity2 * across_m * sine;
  return T;
}

// From the map to the axes of the Earth (EPSG:4978), where it lies in a system that PROJ knows. A
// metre stays a metre. Heights are taken as over the ellipsoid, as systems of heights are seldom
// told.
std::optional<Eigen::Isometry3d> TransformToEarth(const std::optional<Georeference>& georeference) {
  if (!georeference || georeference->crs.empty()) return std::nullopt;
  const CoordinateSystem system(georeference->crs);
  const std::optional<PlaceOnEarth> place = system.At(georeference->origin_m);
  if (!place) {
    spdlog::warn("tiles: the map lies beyond the area of {}: they do not say where on Earth it is",
                 georeference->crs);
    return std::nullopt;
  }
  const auto turn =
      Eigen::AngleAxisd(georeference->turn_rad - place->true_north_rad, Eigen::Vector3d::UnitZ());
  return EastNorthUpOnEarth(kDegree * place->latitude_deg, kDegree * place->longitude_deg,
                            georeference->origin_m.z()) *
         turn;
}

class TilesetMaker {
 public:
  TilesetMaker(const MapResult& map, const std::string& folder) : map_(map), folder_(folder) {}

  void AddClouds(const Progress& progress) {
    const auto grey = [](const std::vector<DensePoint>& dense) {
      return [&dense](std::size_t i) {
        return Colour{dense[i].grey, dense[i].grey, dense[i].grey};
      };
    };
    const auto place = [](const auto& points) {
      return [&points](std::size_t i) { return points[i].p_world; };
    };
    AddCloud({"dense", map_.dense.size(), place(map_.dense), grey(map_.dense)},
             progress.Part(0, 0.7));
    AddCloud({"filled", map_.filled.size(), place(map_.filled), grey(map_.filled)},
             progress.Part(0.7, 0.9));
    AddCloud({"points", map_.points.size(), place(map_.points),
              [](std::size_t) { return kPointColour; }},
             progress.Part(0.9, 1));
  }

  void AddLines(const Progress& progress) {
    if (map_.lines.empty()) return;
    Add(WriteLineTiles(folder_, "lines", map_, &paths_, progress));
  }

  void AddStoreys() {
    std::set<std::optional<int64_t>> storeys = {std::nullopt};
    for (const Storey& storey : map_.building.storeys) storeys.insert(storey.id);
    for (const std::optional<int64_t>& storey : storeys) AddStorey(storey);
  }

  // Writes the tileset and returns the paths of all files.
  std::vector<std::string> Finish(const std::string& page) {
    if (!page.empty()) AddFile("index.html", MakeTilesPage(page, {"tileset.json"}));
    AddFile("tileset.json", JsonText(Tileset()));
    return paths_;
  }

  bool empty() const { return children_.empty(); }

 private:
  void AddCloud(const PointsToTile& points, const Progress& progress) {
    if (points.count > 0) Add(WriteCloudTiles(folder_, points, &paths_, progress));
  }

  void AddStorey(std::optional<int64_t> storey) {
    const PartModel model = MakeBuildingModel(PartOfStorey(map_, storey));
    if (model.box.isEmpty()) return;
    const std::string uri =
        "structure/" + (storey ? fmt::format("storey_{}", *storey) : "other") + ".glb";
    MakeFolder(folder_ + "/structure");
    AddFile(uri, model.bytes);
    Json extras = {{"layer", "structure"}};
    if (storey) extras["storey"] = *storey;
    Add({{{"boundingVolume", BoundingVolume(model.box)},
          {"geometricError", 0},
          {"content", {{"uri", uri}}},
          {"extras", extras}},
         model.box});
  }

  void Add(const TileOfSet& tile) {
    children_.push_back(tile.json);
    box_.extend(tile.box);
  }

  Json Tileset() const {
    const double diagonal_m = box_.diagonal().norm();
    Json storeys = Json::array();
    for (const Storey& storey : map_.building.storeys) {
      storeys.push_back({{"id", storey.id},
                         {"floor_m", storey.floor_m},
                         {"ceiling_m", storey.ceiling_m ? Json(*storey.ceiling_m) : Json()}});
    }
    Json root = {{"boundingVolume", BoundingVolume(box_)},
                 {"geometricError", diagonal_m},
                 {"refine", "ADD"},
                 {"children", children_}};
    if (const auto T_earth_map = TransformToEarth(map_.source.georeference)) {
      const Eigen::Matrix4d& matrix = T_earth_map->matrix();
      root["transform"] = std::vector<double>(matrix.data(), matrix.data() + matrix.size());
    }
    return {{"asset", {{"version", "1.1"}}},
            {"extras",
             {{"generator", "slcmap"},
              {"map", map_.id},
              {"run", map_.source.run_id},
              {"georeference", GeoreferenceJson(map_.source.georeference)},
              {"storeys", storeys}}},
            {"geometricError", diagonal_m},
            {"root", root}};
  }

  void AddFile(const std::string& name, const std::string& bytes) {
    paths_.push_back(folder_ + "/" + name);
    WriteFile(paths_.back(), bytes);
  }

  const MapResult& map_;
  const std::string folder_;
  std::vector<std::string> paths_;
  Json children_ = Json::array();
  Eigen::AlignedBox3d box_;
};

}  // namespace

std::vector<std::string> WriteTiles(const std::string& page, const std::string& folder,
                                    const MapResult& map, const Progress& progress) {
  MakeFolder(folder + "/tiles");
  TilesetMaker maker(map, folder + "/tiles");
  maker.AddClouds(progress.Part(0, 0.9));
  maker.AddLines(progress.Part(0.9, 0.97));
  maker.AddStoreys();
  progress.ReportOrStop(0.99);
  if (maker.empty()) {
    spdlog::warn("tiles: the map has no points, lines and planes, no tileset is written");
    return {};
  }
  return maker.Finish(page);
}

}  // namespace slcmap::exporting
