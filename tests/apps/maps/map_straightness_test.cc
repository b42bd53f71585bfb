#include "apps/maps/map_straightness.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "apps/maps/measured_map.h"
#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using testing::MessageOf;
using testing::TempFolder;

constexpr double kLength_m = 24;

struct Rectangle {
  Vector3d corner, u, v;
};

// A corridor of 24 m with rooms of 4.7 x 4 m along it.
std::vector<Rectangle> Building() {
  std::vector<Rectangle> all;
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    all.push_back({{x0, y0, 0}, {x1 - x0, y1 - y0, 0}, {0, 0, 2.6}});
  };
  const auto slabs = [&](double x0, double y0, double x1, double y1) {
    for (const double z : {0.0, 2.6}) {
      all.push_back({{x0, y0, z}, {x1 - x0, 0, 0}, {0, y1 - y0, 0}});
    }
  };
  wall(0, 0, kLength_m, 0), wall(0, 2.4, kLength_m, 2.4);
  wall(0, 0, 0, 2.4), wall(kLength_m, 0, kLength_m, 2.4);
  slabs(0, 0, kLength_m, 2.4);
  // Of unlike lengths: nothing looks the same when turned.
  const double ends[] = {0.05, 3.7, 3.82, 9, 9.12, 16.5, 16.62, 23.9};
  for (size_t i = 0; i < 8; i += 2) {
    const double x0 = ends[i], x1 = ends[i + 1];
    wall(x0, 2.55, x1, 2.55), wall(x0, 6.5, x1, 6.5), wall(x0, 2.55, x0, 6.5);
    wall(x1, 2.55, x1, 6.5), slabs(x0, 2.55, x1, 6.5);
  }
  return all;
}

// How a map is off its building.
struct Flaw {
  double noise_m = 0, sag_m = 0;
};

Vector3d Bent(Vector3d p, const Flaw& flaw) {
  const double s = p.x() / kLength_m;
  p.y() += 4 * flaw.sag_m * s * (1 - s);
  return p;
}

std::vector<Vector3d> Cloud(double points_a_m2, const Flaw& flaw, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  std::normal_distribution<double> noise(0, 1);
  std::vector<Vector3d> points;
  for (const Rectangle& r : Building()) {
    const Vector3d n = r.u.cross(r.v).normalized();
    const auto count = static_cast<int>(points_a_m2 * r.u.norm() * r.v.norm());
    for (int i = 0; i < count; ++i) {
      const double a = part(random), b = part(random);
      points.push_back(Bent(r.corner + a * r.u + b * r.v, flaw) + flaw.noise_m * noise(random) * n);
    }
  }
  return points;
}

// The edges of the building in pieces of about a length, each off by the noise.
std::vector<PlySegment> EdgePieces(double piece_m, const Flaw& flaw, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(0.5, 1.5);
  std::normal_distribution<double> noise(0, 1);
  std::vector<PlySegment> pieces;
  for (const Rectangle& r : Building()) {
    const Vector3d starts[] = {r.corner, r.corner + r.v, r.corner, r.corner + r.u};
    const Vector3d along[] = {r.u, r.u, r.v, r.v};
    for (int k = 0; k < 4; ++k) {
      const double length_m = along[k].norm();
      for (double from_m = 0; from_m < length_m - 0.05;) {
        const double to_m = std::min(length_m, from_m + piece_m * part(random));
        const Vector3d off = flaw.noise_m * Vector3d(noise(random), noise(random), noise(random));
        pieces.push_back({Bent(starts[k] + along[k] * from_m / length_m, flaw) + off,
                          Bent(starts[k] + along[k] * to_m / length_m, flaw) + off});
        from_m = to_m + 0.01;
      }
    }
  }
  return pieces;
}

const Eigen::Isometry3d kMoved = Eigen::Translation3d(31.3, -12.7, 3.1) *
                                 Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(1.2, Vector3d::UnitX());

WallStraightness OfCloud(std::vector<Vector3d> points) {
  const SurfaceMap map(std::move(points));
  const MapSamples samples = SampleSurfaces(map);
  return MeasureWalls(map, samples.axes, FindFaces(map, samples.axes.axes.col(2)));
}

WallStraightness Turned(std::vector<Vector3d> points) {
  for (Vector3d& p : points) p = kMoved * p;
  return OfCloud(std::move(points));
}

const Flaw kStraight{0.003, 0}, kBent{0.003, 0.06}, kNoisy{0.02, 0};

// Of a cloud with 400 points a square metre, as it is and however it was sampled.
class WallsOfAnyMap : public ::testing::Test {
 protected:
  static WallStraightness Measure(const Flaw& flaw, unsigned seed) {
    const WallStraightness whole = OfCloud(Cloud(400, flaw, seed));
    EXPECT_EQ(whole.straightedges.size(), 3u);
    // Those of the rooms mostly go on in each other.
    EXPECT_NEAR(static_cast<double>(whole.walls), 14, 3);
    EXPECT_LT(whole.tilt_deg, 0.2);
    // Where noise is a fifth of what partitions are thick, their faces mix, the more the fewer
    // points there are: a limit of the measure.
    const double within = flaw.noise_m < 0.01 ? 0.05 : 0.3;
    for (const WallStraightness& other :
         {OfCloud(Cloud(120, flaw, 2)), Turned(Cloud(400, flaw, 4))}) {
      for (size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(other.straightedges[i].rms_m / whole.straightedges[i].rms_m, 1, within) << i;
      }
      EXPECT_NEAR(other.thickness_m / whole.thickness_m, 1, 0.05);
    }
    return whole;
  }
};

TEST_F(WallsOfAnyMap, ThatIsStraightAreStraight) {
  const WallStraightness straight = Measure(kStraight, 1);
  EXPECT_NEAR(straight.straightedges[2].rms_m, 0.003, 0.0002);
  EXPECT_LT(straight.straightedges[2].gap_worst_m, 0.001);
  EXPECT_NEAR(straight.thickness_m, 0.003, 0.0003);
}

// An arc of 60 mm over 24 m: 10.4 mm over 10 m, of which a line leaves 3.1 mm (RMS).
TEST_F(WallsOfAnyMap, ThatIsBentAreBent) {
  const WallStraightness bent = Measure(kBent, 2);
  EXPECT_NEAR(bent.straightedges[2].gap_worst_m, 0.0104, 0.0012);
  EXPECT_NEAR(bent.straightedges[2].rms_m, std::hypot(0.0031, 0.003), 0.0004);
  EXPECT_NEAR(bent.thickness_m, 0.003, 0.0004);
}

TEST_F(WallsOfAnyMap, ThatIsNoisyAreThickButStraight) {
  const WallStraightness noisy = Measure(kNoisy, 3);
  EXPECT_NEAR(noisy.straightedges[2].rms_m, 0.02, 0.001);
  EXPECT_NEAR(noisy.thickness_m, 0.02, 0.002);
  EXPECT_LT(noisy.straightedges[2].gap_median_m, 0.2 * kNoisy.noise_m);
}

TEST_F(WallsOfAnyMap, MayBendAsTheStandardHasIt) {
  for (const auto& [length_m, gap_m] :
       {std::pair{0.1, 0.003}, {4.0, 0.010}, {7.0, 0.015}, {40.0, 0.025}}) {
    EXPECT_DOUBLE_EQ(AllowedGap_m(length_m), gap_m);
  }
}

TEST_F(WallsOfAnyMap, AreNotGuessedWhereTheyWereNotSeen) {
  std::vector<StraightSample> samples;
  for (double along_m = 0; along_m <= 10; along_m += 0.05) {
    for (const double up_m : {0.2, 1.0, 2.0}) {
      if (along_m < 1.5 || along_m > 8.5) samples.push_back({along_m, up_m, 0});
    }
  }
  const std::vector<LaidStraightedge> laid = LayStraightedges(samples, 0.001);
  ASSERT_EQ(laid.size(), 1u);
  EXPECT_EQ(laid[0].length_m, 1);
}

TEST(EdgesOfAnyMap, AreMeasuredAsTheyAre) {
  const LineStraightness straight = MeasureLines(EdgePieces(1.5, {0.002, 0}, 1));
  const LineStraightness bent = MeasureLines(EdgePieces(1.5, {0.002, 0.06}, 2));
  const LineStraightness noisy = MeasureLines(EdgePieces(1.5, {0.01, 0}, 3));
  ASSERT_EQ(straight.straightedges.size(), 3u);
  EXPECT_LT(straight.straightedges[2].rms_m, bent.straightedges[2].rms_m);
  EXPECT_LT(straight.straightedges[2].rms_m, noisy.straightedges[2].rms_m);
  ASSERT_TRUE(straight.directions && bent.directions && noisy.directions);
  EXPECT_LT(straight.directions->dispersion_deg, bent.directions->dispersion_deg);
  EXPECT_LT(straight.directions->dispersion_deg, noisy.directions->dispersion_deg);
}

TEST(EdgesOfAnyMap, AreTheSameHoweverTheyWereCut) {
  for (const Flaw& flaw : {Flaw{0.002, 0}, Flaw{0.002, 0.06}, Flaw{0.01, 0}}) {
    const std::vector<PlySegment> pieces = EdgePieces(1.5, flaw, 1);
    std::vector<PlySegment> cut, twice = pieces, turned;
    for (const auto& [start, end] : pieces) {
      for (int i = 0; i < 3; ++i) {
        cut.push_back({start + (end - start) * i / 3, start + (end - start) * (i + 1) / 3});
      }
      twice.push_back({end, start});
      turned.push_back({kMoved * start, kMoved * end});
    }
    const LineStraightness whole = MeasureLines(pieces);
    for (const auto& lines : {cut, twice, turned}) {
      const LineStraightness other = MeasureLines(lines);
      EXPECT_NEAR(other.edges_m / whole.edges_m, 1, 0.02);
      ASSERT_TRUE(other.directions && whole.directions);
      EXPECT_NEAR(other.directions->dispersion_deg / whole.directions->dispersion_deg, 1, 0.05);
      for (size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(other.straightedges[i].rms_m / whole.straightedges[i].rms_m, 1, 0.05) << i;
      }
    }
  }
}

// Three edges that meet in a corner, in pieces of any length.
TEST(EdgesOfAnyMap, ThatMeetStayApartHoweverFineTheyAre) {
  const auto cut = [](int count) {
    std::vector<PlySegment> pieces;
    for (const Vector3d& end : {Vector3d(4, 0, 0), Vector3d(0, 3, 0), Vector3d(0, 0, 2.6)}) {
      for (int i = 0; i < count; ++i) pieces.push_back({end * i / count, end * (i + 1) / count});
    }
    return pieces;
  };
  for (const int count : {1, 60, 61, 600, 3000}) {
    const LineStraightness lines = MeasureLines(cut(count));
    EXPECT_NEAR(lines.edges_m, 9.6, 0.1) << count;
    EXPECT_EQ(lines.edges, 3) << count;
    ASSERT_EQ(lines.straightedges.size(), 3u);
    for (const auto& straightedge : lines.straightedges) {
      if (straightedge.pieces > 0) EXPECT_LT(straightedge.rms_m, 1e-6) << count;
    }
  }
}

std::string WriteCloud(const TempFolder& folder, const std::string& name,
                       const std::vector<Vector3d>& points, double scale = 1) {
  PlyElement vertices{"vertex", {}};
  for (const char* axis : {"x", "y", "z"}) vertices.Add(axis, PlyType::kDouble);
  for (const Vector3d& p : points) {
    vertices.AppendRow({scale * p.x(), scale * p.y(), scale * p.z()});
  }
  WritePly(folder.Path(name), {{}, {vertices}, {}});
  return folder.Path(name);
}

std::vector<Vector3d> Moved(std::vector<Vector3d> points) {
  const Eigen::Isometry3d level =
      Eigen::Translation3d(31.3, -12.7, 3.1) * Eigen::AngleAxisd(2.3, Vector3d::UnitZ());
  for (Vector3d& p : points) p = level * p;
  return points;
}

TEST(MapsAgainstAScan, AreLaidOnItAndRanked) {
  const TempFolder folder;
  const std::string scan = WriteCloud(folder, "scan.ply", Cloud(900, {0.001, 0}, 9));
  MapsToMeasure maps;
  maps.truth = scan;
  maps.maps = {{"noisy", WriteCloud(folder, "n.ply", Moved(Cloud(400, kNoisy, 1))), 1},
               {"bent", WriteCloud(folder, "b.ply", Moved(Cloud(400, kBent, 2))), 1},
               {"straight", WriteCloud(folder, "s.ply", Moved(Cloud(400, kStraight, 3))), 1},
               {"thin", WriteCloud(folder, "t.ply", Moved(Cloud(120, kStraight, 4))), 1}};
  WriteLinesPly(folder.Path("l.ply"), EdgePieces(1.5, {0.002, 0}, 5));
  maps.maps.push_back({"lines", folder.Path("l.ply"), 1});
  const std::vector<MeasuredMap> measured = MeasureMaps(maps).maps;
  ASSERT_EQ(measured.size(), 5u);
  const auto f_2cm = [&](size_t i) { return measured[i].truth->scores[0].f; };
  EXPECT_GT(f_2cm(2), 0.97);
  EXPECT_LT(f_2cm(0), 0.85);
  EXPECT_LT(f_2cm(1), f_2cm(2));
  EXPECT_NEAR(f_2cm(3) / f_2cm(2), 1, 0.05);
  EXPECT_GT(measured[1].truth->whole_bend_m, 0.03);
  EXPECT_LT(measured[2].truth->whole_bend_m, 0.003);
  EXPECT_GT(measured[4].truth->scores[1].accuracy, 0.95);
  const std::vector<std::string> ranking = Ranking(measured);
  ASSERT_FALSE(ranking.empty());
  EXPECT_LT(ranking[0].find("straight "), ranking[0].find("bent ")) << ranking[0];
  EXPECT_LT(ranking[0].find("bent "), ranking[0].find("noisy ")) << ranking[0];
  for (const MeasuredMap& map : measured) {
    EXPECT_NE(MapTable(measured).find(map.name), std::string::npos);
  }
}

// A room with a partition of 10 cm at round numbers and a box, in points every 3 cm.
std::vector<Vector3d> EvenRoom() {
  constexpr double kStep_m = 0.03;
  const Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 2.6);
  std::vector<Rectangle> all = {
      {{0, 0, 0}, 6 * x, z}, {{0, 4, 0}, 6 * x, z},     {{0, 0, 0}, 4 * y, z},
      {{6, 0, 0}, 4 * y, z}, {{0, 0, 0}, 6 * x, 4 * y}, {z, 6 * x, 4 * y},
      {{2, 0, 0}, 2 * y, z}, {{2.1, 0, 0}, 2 * y, z},   {{4, 2, 0.4}, 0.4 * x, 0.4 * y}};
  for (const double at : {0.0, 0.4}) {
    all.push_back({{4, 2 + at, 0}, 0.4 * x, {0, 0, 0.4}});
    all.push_back({{4 + at, 2, 0}, 0.4 * y, {0, 0, 0.4}});
  }
  std::vector<Vector3d> points;
  for (const Rectangle& r : all) {
    const double width_m = r.u.norm(), height_m = r.v.norm();
    for (double a_m = kStep_m / 2; a_m < width_m; a_m += kStep_m) {
      for (double b_m = kStep_m / 2; b_m < height_m; b_m += kStep_m) {
        points.push_back(r.corner + a_m / width_m * r.u + b_m / height_m * r.v);
      }
    }
  }
  return points;
}

// Sheared to the side by that share of its height, by x and by y.
std::vector<Vector3d> Leaning(std::vector<Vector3d> points, double share) {
  for (Vector3d& p : points) p += share * p.z() * Vector3d(1, 1, 0);
  return points;
}

MeasuredMap Single(const MapsToMeasure& maps) { return MeasureMaps(maps).maps.at(0); }

TEST(MapsAgainstAScan, ThatAreItAreWithoutAFault) {
  const TempFolder folder;
  for (const auto& points : {EvenRoom(), Cloud(200, kNoisy, 1)}) {
    const std::string scan = WriteCloud(folder, "scan.ply", points);
    const TruthAgreement agreement = *Single({{{"itself", scan, 1}}, scan, 1, true}).truth;
    EXPECT_LT(agreement.rms_m, 1e-6);
    for (const AgreementScore& score : agreement.scores) {
      EXPECT_DOUBLE_EQ(score.accuracy, 1) << score.tolerance_m;
      EXPECT_GT(score.completeness, 0.99) << score.tolerance_m;
    }
  }
}

TEST(MapsAgainstAScan, ScoreTheSameInFloatsAndInUtm) {
  const TempFolder folder;
  const std::vector<Vector3d> room = EvenRoom();
  std::vector<Vector3d> floats = room, utm = room;
  for (Vector3d& p : floats) p = p.cast<float>().cast<double>();
  for (Vector3d& p : utm) p += Vector3d(500000, 5400000, 300);
  const std::string scan = WriteCloud(folder, "scan.ply", room);
  const auto measure = [&](const std::string& map) {
    return Single({{{"map", map, 1}}, scan, 1, false});
  };
  const MeasuredMap whole = measure(scan);
  EXPECT_EQ(whole.walls->walls, 6);
  for (const auto& points : {floats, utm}) {
    const MeasuredMap other = measure(WriteCloud(folder, "other.ply", points));
    EXPECT_EQ(other.walls->walls, whole.walls->walls);
    EXPECT_NEAR(other.walls->length_m, whole.walls->length_m, 0.3);
    EXPECT_NEAR(other.walls->thickness_m, whole.walls->thickness_m, 1e-3);
    for (size_t i = 0; i < 3; ++i) {
      const AgreementScore &score = other.truth->scores[i], &expected = whole.truth->scores[i];
      EXPECT_NEAR(score.accuracy, expected.accuracy, 0.005) << i;
      EXPECT_NEAR(score.completeness, expected.completeness, 0.005) << i;
    }
  }
}

TEST(MapsAgainstAScan, ThatLeanDoSoByTheirFloorsOrTheirZ) {
  const TempFolder folder;
  const std::vector<Vector3d> leaning = Leaning(EvenRoom(), 0.02);
  const WallStraightness by_floors = OfCloud(leaning);
  EXPECT_NEAR(by_floors.lean_rms_m, 0.055, 0.002);
  EXPECT_LT(by_floors.tilt_deg, 0.1);
  std::vector<Vector3d> walls;
  for (const Vector3d& p : leaning) {
    if (p.z() > 0.005 && p.z() < 2.595) walls.push_back(p);
  }
  const MeasuredMap by_z =
      Single({{{"walls", WriteCloud(folder, "walls.ply", walls), 1}}, "", 1, true});
  EXPECT_NEAR(by_z.walls->lean_rms_m, 0.055, 0.002);
  EXPECT_TRUE(std::isnan(by_z.walls->tilt_deg));
}

TEST(MapsAgainstAScan, TieWhereTheyPrintTheSame) {
  const TempFolder folder;
  const std::string room = WriteCloud(folder, "room.ply", EvenRoom());
  const auto bent = [&](double sag_m) {
    std::vector<Vector3d> points = EvenRoom();
    for (Vector3d& p : points) p = Bent(p, {0, sag_m});
    return WriteCloud(folder, "bent.ply", points);
  };
  const auto ranking = [&](const std::string& other) {
    return Ranking(MeasureMaps({{{"z", room, 1}, {"b", other, 1}}, "", 1, false}).maps).at(0);
  };
  EXPECT_NE(ranking(room).find("first: z and b 0.00 mm"), std::string::npos) << ranking(room);
  const std::string apart = ranking(bent(0.5));
  EXPECT_NE(apart.find("first: z 0.00 mm, b "), std::string::npos) << apart;
}

TEST(MapsAgainstAScan, AreMeasuredBesideOnesThatCannotBe) {
  const TempFolder folder;
  const NamedMap good{"good", WriteCloud(folder, "good.ply", EvenRoom()), 1},
      bad{"bad", folder.Write("bad.ply", "ply\nformat ascii 1.0\n"), 1};
  const MapMeasures measured = MeasureMaps({{bad, good}, "", 1, false});
  ASSERT_EQ(measured.maps.size(), 1u);
  EXPECT_EQ(measured.maps[0].name, "good");
  EXPECT_NE(measured.failures.find(bad.path), std::string::npos) << measured.failures;
  EXPECT_NE(MessageOf<DataError>([&] {
              MeasureMaps({{bad}, "", 1, false});
            }).find(bad.path),
            std::string::npos);
}

// Rounding makes the cosine of two parallel normals more than 1 in some directions.
TEST(AnglesOfWalls, AreKnownBesideParallelFaces) {
  constexpr double kOff_rad = 0.025;
  const SurfaceMap nothing({});
  const auto wall = [](double turn_rad, double aside_m) {
    FoundFace face;
    face.normal = {std::cos(turn_rad), std::sin(turn_rad), 0};
    face.upwards = Vector3d::UnitZ();
    face.along = face.upwards.cross(face.normal);
    face.middle = aside_m * face.normal;
    face.length_m = 4, face.height_m = 2.6;
    return face;
  };
  for (int i = 0; i < 1000; ++i) {
    const double turn_rad = 0.001 * i;
    const std::vector<FoundFace> faces = {wall(turn_rad, 0), wall(turn_rad, 0.1),
                                          wall(turn_rad + M_PI / 2 - kOff_rad, 0)};
    const WallStraightness measured = MeasureWalls(nothing, {}, faces);
    EXPECT_EQ(measured.angles, 2) << turn_rad;
    EXPECT_NEAR(measured.angle_rms_deg, kOff_rad * 180 / M_PI, 1e-6) << turn_rad;
  }
}

TEST(MapsAgainstAScan, InOtherUnitsOrOfAnotherBuildingAreRefused) {
  const TempFolder folder;
  const std::vector<Vector3d> points = Cloud(150, kStraight, 1);
  const auto refusal = [&](const std::string& map, const std::string& truth) {
    MapsToMeasure maps;
    maps.maps = {{"map", map, 1}};
    maps.truth = truth;
    return MessageOf<DataError>([&] { MeasureMaps(maps); });
  };
  const std::string map = WriteCloud(folder, "map.ply", points);
  const std::vector<Vector3d> scan = Cloud(250, {0.001, 0}, 2);
  EXPECT_EQ(refusal(map, WriteCloud(folder, "m.ply", scan)), "");
  EXPECT_NE(refusal(map, WriteCloud(folder, "mm.ply", scan, 1000)).find("millimetres"),
            std::string::npos);
  EXPECT_NE(refusal(map, WriteCloud(folder, "ft.ply", scan, 1 / 0.3048)).find("feet"),
            std::string::npos);
  std::vector<Vector3d> blob;
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 3);
  for (int i = 0; i < 20000; ++i) {
    Vector3d p(normal(random), normal(random), normal(random));
    blob.push_back(8 * p.normalized());
  }
  EXPECT_NE(refusal(map, WriteCloud(folder, "ball.ply", blob)).find("same building"),
            std::string::npos);
  WriteLinesPly(folder.Path("lines.ply"), EdgePieces(1.5, {0, 0}, 5));
  EXPECT_NE(refusal(map, folder.Path("lines.ply")).find("lines alone"), std::string::npos);
  EXPECT_NE(refusal(WriteCloud(folder, "few.ply", {points.begin(), points.begin() + 20}), "")
                .find("on no surface"),
            std::string::npos);
}

}  // namespace
}  // namespace slcmap
