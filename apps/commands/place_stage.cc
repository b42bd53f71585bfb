#include "apps/commands/place_stage.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <list>
#include <map>
#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/map_stage.h"
#include "data/core/math.h"
#include "data/io/json.h"
#include "data/version.h"
#include "mapping/align/map_overlap.h"
#include "mapping/align/merge_maps.h"
#include "mapping/align/pair_adjustment.h"
#include "mapping/map/map_folder.h"

namespace slcmap::inline commands {
namespace {

constexpr char kPlacementFormat[] = "slcmap placement", kPairsFormat[] = "slcmap aligned pairs";
constexpr int kPlacementVersion = 1;
constexpr double kFarthestPoint_m = 1e6;
constexpr std::size_t kMapsHeld = 12;    // a few MB each, without their points
constexpr double kWalkForChanges = 0.2;  // share of a walk, of which the other tells what changed
constexpr double kSameChange = 0.5;      // of boxes, which several pairs tell of

std::string RunOfMap(const std::string& folder) { return MapSourceIn(folder).run_id; }

// Why a map cannot be placed beside those before it: one of its runs is in them already. "" where
// it can, by folder.
std::vector<std::string> FindRunsTwice(const std::vector<MapFolder>& folders) {
  std::map<std::string, std::string> by_run;
  std::vector<std::string> reasons;
  for (const MapFolder& folder : folders) {
    MapResult map;
    map.source = MapSourceIn(folder.path);
    std::string& reason = reasons.emplace_back();
    for (const std::string& run : CollectRuns(map)) {
      const auto [found, is_new] = by_run.emplace(run, folder.name);
      if (run.empty() || is_new) continue;
      reason = fmt::format(
          "{}: found run {} in both maps, here and in {}, expected maps of "
          "different runs",
          folder.name, run, found->second);
    }
  }
  return reasons;
}

// Those that were asked for last.
class HeldMaps {
 public:
  HeldMaps(const std::vector<MapFolder>& folders, bool accept_changed)
      : folders_(folders), accept_changed_(accept_changed) {}

  const ComparableMap& Get(std::size_t folder) {
    const auto held = std::ranges::find(held_, folder, &Held::folder);
    if (held != held_.end()) {
      held_.splice(held_.begin(), held_, held);
    } else {
      held_.push_front({folder, std::make_unique<ComparableMap>(Read(folder))});
      if (held_.size() > kMapsHeld) held_.pop_back();
    }
    return *held_.front().map;
  }

 private:
  struct Held {
    std::size_t folder = 0;
    std::unique_ptr<ComparableMap> map;
  };

  MapResult Read(std::size_t folder) const {
    MapResult map = ReadMapToShow(folders_[folder].path, accept_changed_);
    try {
      return PrepareToUnite(std::move(map)).map;
    } catch (const DataError& error) {
      throw DataError(folders_[folder].name + ": " + error.what());
    }
  }

  const std::vector<MapFolder>& folders_;
  const bool accept_changed_;
  std::list<Held> held_;  // the last one first
};

Json TransformJson(const RigidTransform& T) {
  const Eigen::Vector3d& p = T.translation;
  return {{"position_m", {p.x(), p.y(), p.z()}}, {"yaw_rad", ComputeYaw(T)}};
}

RigidTransform ParseTransform(const std::string& place, const Json& json) {
  const auto p = ParsePoint<Eigen::Vector3d>(place, json.at("position_m"), kFarthestPoint_m);
  return LevelTransform(BoundedAt(place, json, "yaw_rad", -4.0, 4.0), p);
}

Json PairJson(const AlignedPair& pair) {
  Json json = {{"reason", pair.reason}, {"places", Json::array()}};
  for (const RigidTransform& T : pair.places) json["places"].push_back(TransformJson(T));
  if (!pair.found) return json;
  json["found"] = TransformJson(pair.found->T_first_second);
  json["surfaces_m2"] = pair.found->surfaces_m2;
  json["lines_m"] = pair.found->lines_m;
  const Eigen::Vector3d& centre = pair.found->information.centre_first;
  json["centre"] = {centre.x(), centre.y(), centre.z()};
  for (const double value : pair.found->information.of_turn_and_shift.reshaped()) {
    json["information"].push_back(value);
  }
  return json;
}

AlignedPair ParsePair(const std::string& path, const Json& json) {
  AlignedPair pair;
  pair.reason = json.at("reason");
  for (const Json& T : json.at("places")) pair.places.push_back(ParseTransform(path, T));
  if (!json.contains("found")) return pair;
  MapAlignment& found = pair.found.emplace();
  found.T_first_second = ParseTransform(path, json.at("found"));
  found.surfaces_m2 = json.at("surfaces_m2");
  found.lines_m = json.at("lines_m");
  found.information.centre_first =
      ParsePoint<Eigen::Vector3d>(path, json.at("centre"), kFarthestPoint_m);
  found.information.of_turn_and_shift =
      ParsePoint<Eigen::Vector<double, 16>>(path, json.at("information"), 1e15).reshaped(4, 4);
  return pair;
}

// What aligning two maps gave, by the ids of both: the same maps need not be aligned again.
class KeptPairs {
 public:
  explicit KeptPairs(std::string path) : path_(std::move(path)) {
    if (path_.empty() || !Exists(path_)) return;
    try {
      json_ = ParseJsonFile(path_, [&](const Json& json) {
        CheckFormat(path_, json, kPairsFormat, kPlacementVersion, kPlacementVersion);
        return json.at("slcmap") == kVersion ? json.at("pairs") : Json::object();
      });
    } catch (const DataError& damage) {
      spdlog::warn("{}; pairs are aligned again", damage.what());
    }
  }

  std::optional<AlignedPair> Find(const std::string& key) const {
    if (!json_.contains(key)) return std::nullopt;
    return WithJsonErrors(path_, [&] { return ParsePair(path_, json_.at(key)); });
  }

  void Keep(const std::string& key, const AlignedPair& pair) {
    if (path_.empty()) return;
    json_[key] = PairJson(pair);
    ReplaceFile(path_, JsonText({{"format", kPairsFormat},
                                 {"version", kPlacementVersion},
                                 {"slcmap", kVersion},
                                 {"pairs", json_}}));
  }

 private:
  const std::string path_;
  Json json_ = Json::object();
};

// Whether two pairs of maps tell of one change: most of the smaller box is in the other.
bool IsSameChange(const DatedChange& a, const DatedChange& b) {
  if (a.group != b.group || a.change.is_new != b.change.is_new) return false;
  constexpr double kLeastSize_m = 0.2;  // of what is thin
  const auto size = [=](const Eigen::Vector3d& least,
                        const Eigen::Vector3d& most) -> Eigen::Vector3d {
    return (most - least).array() + kLeastSize_m;
  };
  const Eigen::Vector3d common = size(a.change.least_world.cwiseMax(b.change.least_world),
                                      a.change.most_world.cwiseMin(b.change.most_world));
  if (common.minCoeff() <= 0) return false;
  const double smaller = std::min(size(a.change.least_world, a.change.most_world).prod(),
                                  size(b.change.least_world, b.change.most_world).prod());
  return common.prod() > kSameChange * smaller;
}

// Of what several pairs tell, the largest stays, between the dates nearest to each other.
void AddChange(DatedChange change, std::vector<DatedChange>* changes) {
  const auto known = std::ranges::find_if(
      *changes, [&](const DatedChange& other) { return IsSameChange(change, other); });
  if (known == changes->end()) {
    changes->push_back(std::move(change));
    return;
  }
  known->after = std::max(known->after, change.after);
  known->by = std::min(known->by, change.by);
  if (known->change.area_m2 < change.change.area_m2) known->change = std::move(change.change);
}

// In the world of a group.
MapChange Moved(MapChange change, const RigidTransform& T) {
  Eigen::Vector3d least = Eigen::Vector3d::Constant(kFarthestPoint_m), most = -least;
  for (SurfaceSample& sample : change.surfaces) {
    sample.p_world = T * sample.p_world;
    sample.normal_world = T.rotation * sample.normal_world;
    least = least.cwiseMin(sample.p_world);
    most = most.cwiseMax(sample.p_world);
  }
  change.least_world = least;
  change.most_world = most;
  return change;
}

std::vector<DatedChange> CollectChanges(const std::vector<MapFolder>& folders,
                                        const std::vector<MapToPlace>& maps,
                                        const MapPlacement& placement, HeldMaps* held) {
  std::vector<IndexedMap> indexed;
  for (const MapToPlace& map : maps) indexed.emplace_back(map.index);
  std::vector<DatedChange> changes;
  for (std::size_t a = 0; a < folders.size(); ++a) {
    for (std::size_t b = 0; b < folders.size(); ++b) {
      const PlacedMap &earlier = placement.maps[a], &later = placement.maps[b];
      const bool is_earlier = !folders[a].date.empty() && folders[a].date < folders[b].date;
      if (!is_earlier || earlier.group != later.group) continue;
      const RigidTransform T = earlier.T_group_map.Inverse() * later.T_group_map;
      if (indexed[a].ShareOfWalk(indexed[b], T) < kWalkForChanges) continue;
      const ComparableMap& before = held->Get(a);
      for (MapChange& change : FindChanges(before.Get(), held->Get(b).Get(), T)) {
        AddChange({earlier.group, folders[a].date, folders[b].date,
                   Moved(std::move(change), earlier.T_group_map)},
                  &changes);
      }
    }
  }
  std::ranges::stable_sort(changes, {}, &DatedChange::by);
  return changes;
}

FolderPlace FindPlace(const std::string& placement, const char* key, const std::string& value) {
  return ParseJsonFile(placement, [&](const Json& json) {
    CheckFormat(placement, json, kPlacementFormat, kPlacementVersion, kPlacementVersion);
    for (const Json& entry : json.at("placed")) {
      if (entry.at(key) != value) continue;
      return FolderPlace{entry.at("group"), ParseTransform(placement, entry), entry.at("date")};
    }
    throw DataError(fmt::format("{}: found no {} {}, expected its place", placement, key, value));
  });
}

}  // namespace

PlacedFolders PlaceFolders(const std::vector<MapFolder>& folders, bool accept_changed,
                           const std::string& kept, const Progress& progress) {
  const std::vector<std::string> twice = FindRunsTwice(folders);
  std::vector<MapToPlace> maps;
  std::vector<std::string> ids;
  for (const MapFolder& folder : folders) {
    maps.push_back({folder.name, folder.storey, ReadPlaceIndex(folder.path),
                    MapSourceIn(folder.path).georeference});
    ids.push_back(Checksum(ReadFile(folder.path + "/map.json")));
  }
  HeldMaps held(folders, accept_changed);
  KeptPairs pairs(kept);
  // While a pair is looked at, what was last told is told again, to ask whether to go on.
  double told = 0;
  const Progress of_pairs([&](double done) { return progress.Report(told = done); });
  const Progress of_pair(
      [&](double done) { return progress.Report(maps.size() > 2 ? told : std::max(told, done)); });
  const auto align = [&](std::size_t first, std::size_t second) {
    AlignedPair pair;
    for (const std::size_t map : {first, second}) pair.reason += twice[map];
    const std::string key = ids[first] + " " + ids[second];
    if (!pair.reason.empty()) return pair;
    if (const auto known = pairs.Find(key)) return *known;
    try {
      const ComparableMap& ours = held.Get(first);
      pair = AlignTwo(ours.Get(), held.Get(second).Get(),
                      BetweenPlaces(maps[first].on_earth, maps[second].on_earth), of_pair);
    } catch (const DataError& error) {  // of a map that cannot be merged at all
      pair.reason = error.what();
    }
    pairs.Keep(key, pair);
    return pair;
  };
  PlacedFolders placed;
  placed.placement = PlaceMaps(maps, align, of_pairs);
  if (maps.size() > 2 || placed.placement.used > 0) {
    spdlog::info("places: {} of {} pairs of {} maps agree, to {:.1f} mm", placed.placement.used,
                 placed.placement.tried, maps.size(), 1e3 * placed.placement.closing_m);
  }
  placed.changes = CollectChanges(folders, maps, placed.placement, &held);
  return placed;
}

void WritePlacement(const std::string& path, const std::vector<MapFolder>& folders,
                    const PlacedFolders& placed) {
  Json json = {{"format", kPlacementFormat},
               {"version", kPlacementVersion},
               {"pairs_tried", placed.placement.tried},
               {"pairs_used", placed.placement.used},
               {"closing_m", RoundedForJson(placed.placement.closing_m)},
               {"placed", Json::array()}};
  for (std::size_t i = 0; i < folders.size(); ++i) {
    const PlacedMap& map = placed.placement.maps[i];
    Json entry = {{"map", folders[i].name},
                  {"run", RunOfMap(folders[i].path)},
                  {"group", map.group},
                  {"date", folders[i].date}};
    entry.update(TransformJson(map.T_group_map));
    json["placed"].push_back(entry);
  }
  ReplaceFile(path, JsonText(json));
}

FolderPlace FindPlaceOfName(const std::string& placement, const std::string& name) {
  return FindPlace(placement, "map", name);
}

FolderPlace FindPlaceOfFolder(const std::string& placement, const std::string& folder) {
  return FindPlace(placement, "run", RunOfMap(folder));
}

}  // namespace slcmap::commands
