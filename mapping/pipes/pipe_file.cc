#include "mapping/pipes/pipe_file.h"

#include <array>
#include <cmath>

#include "data/polygon_json.h"
#include "odometry/run_rows.h"

namespace slcmap {
namespace {

constexpr std::array<const char*, 5> kAxisNames = {"x", "y", "vertical", "none", "sloped"};
constexpr double kMostRadius_m = 1e3, kLeastRadius_m = 1e-4;
constexpr int kMostWorld = 1'000'000, kMostImages = 1'000'000'000;

LineAxis ParseAxis(const std::string& place, const Json& json) {
  const auto found = json.at("axis").get<std::string>();
  for (size_t i = 0; i < kAxisNames.size(); ++i) {
    if (found == kAxisNames[i]) return static_cast<LineAxis>(i);
  }
  throw DataError(fmt::format("{}: axis: found '{}', expected one of: x, y, vertical, none, sloped",
                              place, found));
}

// A hundredth of a millimetre is too coarse for what says how well something is known.
double Micrometres(double value_m) { return std::round(value_m * 1e6) / 1e6; }

Json PipeJson(const MapPipe& pipe) {
  return {{"id", pipe.id},
          {"segment", pipe.segment},
          {"axis", kAxisNames[static_cast<size_t>(pipe.axis)]},
          {"world", pipe.world},
          {"start", PointJson(pipe.start_world)},
          {"end", PointJson(pipe.end_world)},
          {"radius_m", RoundedForJson(pipe.radius_m)},
          {"sigma_m", Micrometres(pipe.sigma_m)},
          {"radius_sigma_m", Micrometres(pipe.radius_sigma_m)},
          {"images", pipe.images}};
}

MapPipe ParsePipe(const std::string& path, const Json& json, size_t index) {
  MapPipe pipe;
  pipe.id = BoundedAt<int64_t>(path, json, "id", 0, static_cast<int64_t>(kMaxId));
  const std::string place = fmt::format("{}: pipe {}", path, pipe.id);
  if (pipe.id != static_cast<int64_t>(index)) {
    throw DataError(
        fmt::format("{}: found it at place {}, expected ids to count from 0", place, index));
  }
  pipe.segment = BoundedAt(place, json, "segment", 0, static_cast<int>(kMaxSegment));
  pipe.axis = ParseAxis(place, json);
  pipe.world = BoundedAt(place, json, "world", -1, kMostWorld);
  pipe.start_world = ParsePoint<Eigen::Vector3d>(place, json.at("start"), kMaxCoordinate_m);
  pipe.end_world = ParsePoint<Eigen::Vector3d>(place, json.at("end"), kMaxCoordinate_m);
  if (pipe.start_world == pipe.end_world) {
    throw DataError(place + ": found an end that is its start, expected a length");
  }
  pipe.radius_m = BoundedAt(place, json, "radius_m", kLeastRadius_m, kMostRadius_m);
  pipe.sigma_m = BoundedAt(place, json, "sigma_m", 0.0, kMaxSigma_m);
  pipe.radius_sigma_m = BoundedAt(place, json, "radius_sigma_m", 0.0, kMaxSigma_m);
  pipe.images = BoundedAt(place, json, "images", 0, kMostImages);
  return pipe;
}

}  // namespace

void WritePipes(const std::string& path, const std::vector<MapPipe>& pipes) {
  Json json = Json::array();
  for (const MapPipe& pipe : pipes) json.push_back(PipeJson(pipe));
  WriteJsonFile(path, json);
}

std::vector<MapPipe> ReadPipes(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    if (!json.is_array()) throw DataError(path + ": found no list, expected a list of pipes");
    std::vector<MapPipe> pipes;
    for (const Json& pipe : json) pipes.push_back(ParsePipe(path, pipe, pipes.size()));
    return pipes;
  });
}

}  // namespace slcmap
