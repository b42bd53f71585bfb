#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <limits>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/export.h"
#include "export/scene/formats.h"
#include "export/survey/survey_points.h"
#include "tests/export/web/room_map.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

// The room with surfaces of both kinds, and landmarks, in a surveyor's grid.
MapResult MakePlacedMap() {
  MapResult map = testing::MakeRoomMap();
  map.filled.assign(map.dense.begin(), map.dense.begin() + 50);
  for (DensePoint& point : map.filled) point.p_world.z() += 0.01;
  map.source.georeference = Georeference{"EPSG:25832", {451200.25, 5411300.5, 312}, 0.3, 0.9996};
  return map;
}

// The numbers of the rows of that name.
std::vector<std::vector<double>> Rows(const std::string& text, const std::string& name) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word != name) continue;
    rows.emplace_back();
    for (double value = 0; words >> value;) rows.back().push_back(value);
  }
  return rows;
}

Eigen::Vector3d Head(const std::vector<double>& row, std::size_t from = 0) {
  return {row.at(from), row.at(from + 1), row.at(from + 2)};
}

// All points of a map in its place, as they have to be read back.
std::vector<SurveyPoint> ExpectedPoints(const MapResult& map) {
  const Georeference place = FindPlace(map.source);
  std::vector<SurveyPoint> points;
  for (const PointSource source : kPointSources) {
    for (std::size_t i = 0; i < CountPoints(map, source); ++i) {
      points.push_back(PointAt(map, source, i));
      points.back().p = place * points.back().p;
      points.back().normal = TurnedNormal(place, points.back().normal);
    }
  }
  return points;
}

class SurveyCloudTest : public ::testing::Test {
 protected:
  std::string Las(const MapResult& map, const std::string& version = "1.2") const {
    return WriteLas(version, temp_.Path(), map).at(0);
  }
  std::string E57(const MapResult& map) const { return WriteE57(temp_.Path(), map).at(0); }

  testing::TempFolder temp_;
};

class LasTest : public SurveyCloudTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(LasTest, OthersReadAllPointsWithAllTheyHave) {
  if (!testing::HasNodeReader("copc")) GTEST_SKIP() << testing::NodeReaderMissing("copc");
  const MapResult map = MakePlacedMap();
  const auto [text, status] = testing::RunNodeReader("read_las.mjs", Las(map, GetParam()));
  ASSERT_EQ(status, 0) << text;
  EXPECT_THAT(text, HasSubstr(std::string("file ") + GetParam()));
  const std::vector<SurveyPoint> expected = ExpectedPoints(map);
  const std::vector<std::vector<double>> points = Rows(text, "point");
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::vector<double>& point = points[i];
    const SurveyPoint& truth = expected[i];
    EXPECT_LT((Head(point) - truth.p).cwiseAbs().maxCoeff(), 0.51e-4);
    for (std::size_t k = 3; k < 7; ++k) EXPECT_EQ(point[k], 257 * truth.grey);
    EXPECT_EQ(point[7], 1);
    EXPECT_EQ(point[8], truth.source == PointSource::kFilled ? 1 : 0);
    EXPECT_EQ(point[9], static_cast<double>(truth.source));
    EXPECT_LT((Head(point, 10) - truth.normal).norm(), 1e-6);
    EXPECT_NEAR(point[13], truth.sigma_m, 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, LasTest, ::testing::Values("1.2", "1.4"));

TEST_F(SurveyCloudTest, FilesNameTheGrid) {
  const MapResult map = MakePlacedMap();
  // GeoTIFF's key 3072 (ProjectedCSType) with 25832.
  const std::string key("\x00\x0c\x00\x00\x01\x00\xe8\x64", 8);
  EXPECT_THAT(ReadFile(Las(map)), HasSubstr(key));
  const std::string wkt = "PROJCS[\"ETRS89 / UTM zone 32N\"";
  EXPECT_THAT(ReadFile(Las(map, "1.4")), HasSubstr(wkt));
  EXPECT_THAT(ReadFile(E57(map)), HasSubstr(EscapeMarkup(wkt)));
  const MapResult nowhere = testing::MakeRoomMap();
  EXPECT_THAT(ReadFile(Las(nowhere)), Not(HasSubstr("LASF_Projection")));
  EXPECT_THAT(ReadFile(Las(nowhere, "1.4")), HasSubstr("LOCAL_CS[\"building"));
}

TEST_F(SurveyCloudTest, OthersReadE57) {
  if (!testing::HasNodeReader("web-e57")) GTEST_SKIP() << testing::NodeReaderMissing("web-e57");
  const MapResult map = MakePlacedMap();
  const auto [text, status] = testing::RunNodeReader("read_e57.mjs", E57(map));
  ASSERT_EQ(status, 0) << text;
  EXPECT_THAT(Rows(text, "scan"), ElementsAre(ElementsAre(400), ElementsAre(50), ElementsAre(4)));
  const std::vector<SurveyPoint> expected = ExpectedPoints(map);
  const std::vector<std::vector<double>> points = Rows(text, "point");
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((Head(points[i]) - expected[i].p).cwiseAbs().maxCoeff(), 5e-5);
    if (expected[i].source == PointSource::kLandmark) continue;
    for (std::size_t k = 3; k < 6; ++k) EXPECT_EQ(points[i].at(k), expected[i].grey);
  }
  EXPECT_THAT(text, HasSubstr("<nor:normalX type=\"Float\" precision=\"single\"/>"));
  EXPECT_THAT(text, HasSubstr("<description type=\"String\">surfaces, measured by stereo"));
}

// More points than a packet holds, and more packets than a page.
TEST_F(SurveyCloudTest, LargeE57IsReadToItsEnd) {
  if (!testing::HasNodeReader("web-e57")) GTEST_SKIP() << testing::NodeReaderMissing("web-e57");
  MapResult map = testing::MakeRoomMap({.lines = 12, .dense_points = 10001});
  map.points.clear();
  const auto [text, status] = testing::RunNodeReader("read_e57.mjs", E57(map));
  ASSERT_EQ(status, 0) << text.substr(0, 1000);
  const std::vector<std::vector<double>> points = Rows(text, "point");
  ASSERT_EQ(points.size(), 10001u);
  EXPECT_LT((Head(points.back()) - map.dense.back().p_world).norm(), 1e-4);
}

// A reader that was made from the standard by someone who had not seen the writer.
TEST_F(SurveyCloudTest, AReaderOfTheStandardReadsAllOfE57) {
  const std::string python = "/usr/bin/python3";  // Debian's, with its packages
  if (std::system((python + " -c 'import numpy' 2>/dev/null").c_str()) != 0) {
    GTEST_SKIP() << "python3-numpy is not here: tests/install_readers.sh";
  }
  const std::string reader = SLCMAP_SOURCE_DIR "/tests/readers/read_e57.py";
  const MapResult map = MakePlacedMap();
  const std::string text = testing::OutputOf(python + " '" + reader + "' '" + E57(map) + "'");
  EXPECT_EQ(Rows(text, "point").size(), ExpectedPoints(map).size());
  EXPECT_THAT(text, HasSubstr("nor:normalX"));
  EXPECT_THAT(text, HasSubstr("slc:sigma"));
}

TEST_F(SurveyCloudTest, AMapWithoutPointsMakesFilesToo) {
  if (testing::HasNodeReader("copc")) {
    const auto las = testing::RunNodeReader("read_las.mjs", Las({}));
    EXPECT_THAT(las.text, HasSubstr("file 1.2 2 0 0 0 0 0 0 0"));
    EXPECT_EQ(las.status, 0) << las.text;
  }
  EXPECT_THAT(ReadFile(E57({})), HasSubstr("</e57Root>"));
}

TEST_F(SurveyCloudTest, WhatCannotBeWrittenIsTold) {
  MapResult map = testing::MakeRoomMap();
  map.dense[7].p_world.x() = std::numeric_limits<double>::quiet_NaN();
  for (const std::string format : {"las", "e57"}) {
    ExportOptions options;
    options.formats = {format};
    EXPECT_THAT([&] { ExportMap(map, temp_.Path("out"), options); },
                ThrowsMessage<DataError>(HasSubstr("point 7 of stereo")));
    EXPECT_FALSE(std::filesystem::exists(temp_.Path("out")));
  }
  map.dense[7].p_world.x() = 1e6;
  EXPECT_THAT([&] { Las(map); }, ThrowsMessage<DataError>(HasSubstr("at most 214748 m from")));
  ExportOptions of_no_version;
  of_no_version.las_version = "1.3";
  EXPECT_THAT([&] { CheckFormats(of_no_version); },
              ThrowsMessage<ConfigError>(HasSubstr("1.2 or 1.4")));
}

TEST_F(SurveyCloudTest, AFullDiskLeavesNothingBehind) {
  const MapResult map = testing::MakeRoomMap();
  for (const std::string format : {"las", "e57", "gpkg", "geojson"}) {
    ExportOptions options;
    options.formats = {format};
    const testing::FileSizeLimit limit(600);
    EXPECT_THROW(ExportMap(map, temp_.Path("out"), options), OutputError) << format;
    EXPECT_FALSE(std::filesystem::exists(temp_.Path("out"))) << format;
  }
}

}  // namespace
}  // namespace slcmap
