#include "mapping/align/place_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <map>
#include <memory>
#include <numbers>

#include "mapping/align/map_overlap.h"
#include "mapping/align/pair_adjustment.h"
#include "mapping/map/place_index.h"
#include "tests/mapping/align/made_scenes.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScannedAlong;
using testing::ScannedMap;
using ::testing::SizeIs;
using testing::Turned;
using testing::TwoRoomFlat;

// The graph of pairs, of alignments that are given.

// Maps that walk along their x axes at their true places, and what aligning them gives.
class MapsToPlace : public ::testing::Test {
 protected:
  void AddMap(const RigidTransform& T_world_map, const std::string& storey = "") {
    MapToPlace map;
    map.name = fmt::format("m{}", maps_.size());
    map.storey = storey;
    for (int i = 0; i < 10; ++i) map.index.walk_world.emplace_back(i, 0, 0);
    maps_.push_back(map);
    truth_.push_back(T_world_map);
  }

  // That the pair fits where it truly does, but for what it is off by.
  void Fit(std::size_t first, std::size_t second, const RigidTransform& off = {},
           double support = 100) {
    AlignedPair& pair = pairs_[{first, second}];
    MapAlignment& found = pair.found.emplace();
    found.T_first_second = truth_[first].Inverse() * off * truth_[second];
    found.surfaces_m2 = support;
    found.information.of_turn_and_shift = Eigen::Vector4d(1e6, 1e4, 1e4, 1e4).asDiagonal();
  }

  void Doubt(std::size_t first, std::size_t second, const std::vector<RigidTransform>& places) {
    pairs_[{first, second}].reason = "found two places";
    pairs_[{first, second}].places = places;
  }

  MapPlacement Place() const {
    return PlaceMaps(maps_, [&](std::size_t first, std::size_t second) {
      const auto pair = pairs_.find({first, second});
      return pair == pairs_.end() ? AlignedPair{0, 0, {}, "found no place"} : pair->second;
    });
  }

  void ExpectTogether(const MapPlacement& placement, std::size_t a, std::size_t b) const {
    EXPECT_EQ(placement.maps[a].group, placement.maps[b].group);
    const RigidTransform T =
        placement.maps[a].T_group_map.Inverse() * placement.maps[b].T_group_map;
    EXPECT_LT((T.translation - (truth_[a].Inverse() * truth_[b]).translation).norm(), 0.03);
  }

  std::vector<MapToPlace> maps_;
  std::vector<RigidTransform> truth_;
  std::map<std::pair<std::size_t, std::size_t>, AlignedPair> pairs_;
};

TEST_F(MapsToPlace, PairsThatAgreePlaceAllAndAWrongOneIsRefusedByName) {
  for (int i = 0; i < 4; ++i) AddMap(Turned(30 * i, {0.5 * i, 1, 0.1 * i}));
  Fit(0, 1, Turned(0, {0.004, 0, 0}));
  Fit(1, 2, Turned(0, {0, 0.004, 0}));
  Fit(0, 3);
  Fit(1, 3);
  Fit(0, 2, Turned(0, {2.2, 0, 0}), 40);  // a door's period off
  const MapPlacement placement = Place();
  for (std::size_t i = 1; i < 4; ++i) ExpectTogether(placement, 0, i);
  ASSERT_THAT(placement.apart, SizeIs(1));
  EXPECT_EQ(placement.apart[0].first, 0u);
  EXPECT_EQ(placement.apart[0].second, 2u);
  EXPECT_THAT(placement.apart[0].reason, HasSubstr("2.20 m"));
  EXPECT_EQ(placement.used, 4u);
  EXPECT_LT(placement.closing_m, 0.01);
}

TEST_F(MapsToPlace, StoreysThatNoWalkJoinsLieAsTheirControlPointsSay) {
  AddMap(Turned(10, {1, 0, 0}), "0");
  AddMap(Turned(140, {0, 3, 3.4}), "1");
  AddMap(Turned(-70, {4, 1, 0.2}), "0");
  AddMap(Turned(30, {2, 2, 3.5}), "1");
  Fit(0, 2);
  Fit(1, 3);
  constexpr double kTurn_rad = 0.6, kScale = 0.9997;
  const auto place = [&](std::size_t map, const Vector3d& off) {
    Vector3d at = LevelTransform(kTurn_rad, Vector3d::Zero()) * truth_[map].translation;
    at.head<2>() *= kScale;
    maps_[map].on_earth = {"EPSG:25832", Vector3d(691000, 5334000, 500) + at + off,
                           kTurn_rad + ComputeYaw(truth_[map]), kScale};
  };
  place(0, {0.004, 0, 0});
  place(1, {0, 0.004, 0});
  place(3, Vector3d::Zero());
  const MapPlacement placement = Place();
  for (std::size_t i = 1; i < 4; ++i) ExpectTogether(placement, 0, i);
  maps_[3].on_earth->crs = "EPSG:25833";  // says nothing beside the others
  EXPECT_EQ(Place().maps[3].group, 0u);
  maps_[3].on_earth->crs = "EPSG:25832";
  maps_[3].on_earth->origin_m.x() += 5;  // contradicts its own storey
  EXPECT_EQ(Place().maps[3].group, 1u);
}

TEST_F(MapsToPlace, ControlPointsHaveTheirSayBesideWhatMapsShare) {
  AddMap(Turned(0, {0, 0, 0}));
  AddMap(Turned(0, {3, 0, 0}));
  Fit(0, 1, Turned(0, {0.06, 0, 0}));
  const auto off_m = [&] { return Place().maps[1].T_group_map.translation.x() - 3; };
  EXPECT_NEAR(off_m(), 0.06, 1e-6);
  for (std::size_t i = 0; i < 2; ++i) {
    maps_[i].on_earth = {"EPSG:25832", Vector3d(691000, 5334000, 500) + truth_[i].translation};
  }
  EXPECT_GT(off_m(), 0.01);
  EXPECT_LT(off_m(), 0.05);
  maps_[1].on_earth->origin_m.x() += 0.5;  // too far off to be believed
  EXPECT_NEAR(off_m(), 0.06, 1e-6);
}

TEST_F(MapsToPlace, OfThreePairsThatDoNotCloseNoneIsTaken) {
  for (int i = 0; i < 3; ++i) AddMap(Turned(0, {0.1 * i, 0, 0}));
  Fit(0, 1);
  Fit(0, 2);
  Fit(1, 2, Turned(0, {0, 0, 3}), 110);
  const MapPlacement placement = Place();
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(placement.maps[i].group, i);
  ASSERT_THAT(placement.apart, SizeIs(3));
  EXPECT_THAT(placement.apart[0].reason, AllOf(HasSubstr("m0"), HasSubstr("m1"), HasSubstr("m2")));
}

// The first walks through both storeys.
TEST_F(MapsToPlace, LookAlikeStoreysThatAThirdMapKnowsAreNotLaidOnEachOther) {
  for (const double z_m : {0, 0, 3}) AddMap(Turned(0, {0, 0, z_m}));
  Doubt(0, 1, {Turned(0, {0, 0, 0}), Turned(0, {0, 0, 3})});
  Doubt(0, 2, {Turned(0, {0, 0, 0}), Turned(0, {0, 0, 3})});
  Fit(1, 2, Turned(0, {0, 0, -3}));
  const MapPlacement placement = Place();
  EXPECT_NE(placement.maps[1].group, placement.maps[2].group);
  ASSERT_THAT(placement.apart, SizeIs(3));
  EXPECT_THAT(placement.apart[2].reason, AllOf(HasSubstr("m1"), HasSubstr("two places")));
  maps_[1].storey = maps_[2].storey = "ground";  // if the site says so, they are
  EXPECT_EQ(Place().maps[1].group, Place().maps[2].group);
}

// A walk that fits a map of one storey alone may as well be on the other.
TEST_F(MapsToPlace, AMapOfOneStoreyDoesNotTellWhichItIs) {
  for (int i = 0; i < 3; ++i) AddMap({});
  for (int i = 0; i < 10; ++i) maps_[0].index.walk_world.emplace_back(i, 0, 3);
  Fit(0, 1);
  Doubt(0, 2, {Turned(0, {0, 0, 0}), Turned(0, {0, 0, 3})});
  Fit(1, 2);
  const MapPlacement placement = Place();
  EXPECT_EQ(placement.maps[0].group, placement.maps[1].group);
  EXPECT_NE(placement.maps[1].group, placement.maps[2].group);
}

// It has looked at both places of the third, and tells them apart.
TEST_F(MapsToPlace, AMapThatSawBothTwinsSaysWhichPairIsWrong) {
  for (const double z_m : {0, 0, 3}) AddMap(Turned(0, {0, 0, z_m}));
  for (int i = 0; i < 10; ++i) maps_[0].index.walk_world.emplace_back(i, 0, 3);
  Fit(0, 1);
  Fit(0, 2);
  Fit(1, 2, Turned(0, {0, 0, -3}), 120);
  const MapPlacement placement = Place();
  ExpectTogether(placement, 0, 1);
  ExpectTogether(placement, 0, 2);
  ASSERT_THAT(placement.apart, SizeIs(1));
  EXPECT_EQ(placement.apart[0].first, 1u);
}

TEST_F(MapsToPlace, StoreysThatAreSaidHaveTheirHeights) {
  AddMap({}, "ground");
  AddMap({}, "first");
  Fit(0, 1);
  const MapPlacement placement = Place();
  EXPECT_NE(placement.maps[0].group, placement.maps[1].group);
  EXPECT_THAT(placement.apart[0].reason, HasSubstr("expected more than 1.5 m"));
}

TEST_F(MapsToPlace, EachMapIsTriedWithFew) {
  for (int i = 0; i < 12; ++i) AddMap({});
  std::size_t asked = 0;
  PlaceMaps(maps_, [&](std::size_t, std::size_t) {
    ++asked;
    return AlignedPair{0, 0, {}, "found no place"};
  });
  EXPECT_LE(asked, 4u * 12u);
}

// From maps to places.

MapPlacement PlaceScanned(std::vector<MapResult> scanned) {
  std::vector<MapToPlace> maps;
  std::vector<std::unique_ptr<ComparableMap>> compared;
  for (MapResult& map : scanned) {
    maps.push_back({map.source.run_id, "", MakePlaceIndex(map)});
    compared.push_back(std::make_unique<ComparableMap>(std::move(map)));
  }
  return PlaceMaps(maps, [&](std::size_t first, std::size_t second) {
    return AlignTwo(compared[first]->Get(), compared[second]->Get());
  });
}

TEST(PlaceMaps, WalksOfOneBuildingLieTogetherAndAnotherBuildingApart) {
  const RigidTransform T = Turned(127, {3.2, -1.4, 0.7}), truth = T.Inverse();
  std::vector<MapResult> scanned;
  scanned.push_back(ScannedMap(TwoRoomFlat(), testing::kWholeWay));
  scanned.push_back(ScannedMap(TwoRoomFlat(), testing::kWestWay, T, "b"));
  scanned.push_back(ScannedMap(testing::OtherBuilding(), testing::kOtherWay, {}, "c"));

  const IndexedMap all(MakePlaceIndex(scanned[0])), west(MakePlaceIndex(scanned[1])),
      other(MakePlaceIndex(scanned[2]));
  const MapOverlap found = all.FindOverlap(west);
  EXPECT_GT(found.log_odds, 5);
  EXPECT_LT((found.start.p_world - truth.translation).norm(), 0.3);
  EXPECT_LT(std::abs(std::remainder(found.start.yaw_rad - ComputeYaw(truth), 2 * std::numbers::pi)),
            2 * kDegree);
  EXPECT_LT(all.FindOverlap(other).log_odds, 0.1 * found.log_odds);  // two boxes are the same
  EXPECT_GT(all.ShareOfWalk(west, truth), 0.9);
  EXPECT_EQ(all.ShareOfWalk(west, Turned(0, {0, 0, 3})), 0);

  const MapPlacement placement = PlaceScanned(std::move(scanned));
  EXPECT_EQ(placement.maps[1].group, 0u);
  EXPECT_EQ(placement.maps[2].group, 2u);
  EXPECT_LT((placement.maps[1].T_group_map.translation - truth.translation).norm(), 0.01);
}

TEST(PlaceMaps, NoneOfTwinRoomsIsLaidOnTheOther) {
  const RigidTransform worlds[] = {{}, Turned(20, {1, -1, 0}), Turned(40, {2, -2, 0})};
  std::vector<MapResult> scanned;
  scanned.push_back(ScannedAlong(testing::TwinRooms(), testing::kAllOfTwins));
  scanned.push_back(ScannedMap(testing::TwinRooms(), testing::kFirstTwin, worlds[1], "b"));
  scanned.push_back(ScannedMap(testing::TwinRooms(), testing::kSecondTwin, worlds[2], "c"));
  const MapPlacement placement = PlaceScanned(std::move(scanned));
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a + 1; b < 3; ++b) {
      if (placement.maps[a].group != placement.maps[b].group) continue;
      const RigidTransform T =
          placement.maps[a].T_group_map.Inverse() * placement.maps[b].T_group_map;
      const RigidTransform truth = worlds[a] * worlds[b].Inverse();
      EXPECT_LT((T.translation - truth.translation).norm(), 0.1) << a << " and " << b;
    }
  }
  EXPECT_NE(placement.maps[1].group, placement.maps[2].group);
}

TEST(PlaceIndex, ComesBackFromAFolderInSomeKilobytes) {
  const testing::TempFolder folder;
  const PlaceIndex index = MakePlaceIndex(ScannedMap(TwoRoomFlat(), testing::kWestWay));
  WritePlaceIndex(folder.Path(kPlaceFile), index);
  EXPECT_LT(std::filesystem::file_size(folder.Path(kPlaceFile)), 10'000u);
  const PlaceIndex read = ReadPlaceIndex(folder.Path());
  ASSERT_THAT(read.edges, SizeIs(index.edges.size()));
  ASSERT_THAT(read.walk_world, SizeIs(index.walk_world.size()));
  EXPECT_LT((read.edges.back().end_world - index.edges.back().end_world).norm(), 0.01);
}

}  // namespace
}  // namespace slcmap
