// PLY files as Open3D reads them back.
#include <gmock/gmock.h>

#include "export/export.h"
#include "tests/export/page/room_map.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

const char* const kPython = "/usr/bin/python3";  // that for which Debian has packages

class PlyReadersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    int status = 0;
    testing::OutputOf(std::string(kPython) + " -c 'import open3d'", &status);
    if (status != 0) GTEST_SKIP() << "Open3D is not here: tests/install_readers.sh";
    ExportOptions options;
    options.formats = {"ply", "cloud"};
    ExportMap(testing::MakeRoomMap(), folder_.Path("export"), options);
  }

  std::string Read(const std::string& what, const std::string& file) const {
    return testing::OutputOf(std::string(kPython) +
                             " " SLCMAP_SOURCE_DIR "/tests/readers/read_ply.py " + what + " " +
                             folder_.Path("export/" + file));
  }

  testing::TempFolder folder_;
};

TEST_F(PlyReadersTest, Points) {
  EXPECT_THAT(Read("points", "points.ply"),
              HasSubstr("points.ply 4 101.500 202.500 1.000 102.250 202.500 1.000 coloured"));
  EXPECT_THAT(Read("points", "dense.ply"), HasSubstr("dense.ply 400 100.0"));
}

TEST_F(PlyReadersTest, Text) {
  ExportOptions options;
  options.formats = {"ply", "cloud"};
  options.ply.ascii = true;
  ExportMap(testing::MakeRoomMap(), folder_.Path("export"), options);
  EXPECT_THAT(Read("points", "points.ply"),
              HasSubstr("points.ply 4 101.500 202.500 1.000 102.250 202.500 1.000 coloured"));
  EXPECT_THAT(Read("points", "dense.ply"), HasSubstr("dense.ply 400 100.0"));
  EXPECT_THAT(Read("lines", "lines.ply"),
              HasSubstr("lines.ply 12 100.000 200.000 0.000 104.000 205.000 2.600"));
  EXPECT_THAT(Read("mesh", "voxels.ply"), HasSubstr("voxels.ply 12 103.000 204.000"));
}

TEST_F(PlyReadersTest, Lines) {
  EXPECT_THAT(Read("lines", "lines.ply"),
              HasSubstr("lines.ply 12 100.000 200.000 0.000 104.000 205.000 2.600"));
  EXPECT_THAT(Read("lines", "trajectory.ply"), HasSubstr("trajectory.ply 19 101.000 202.500"));
}

TEST_F(PlyReadersTest, Meshes) {
  EXPECT_THAT(Read("mesh", "voxels.ply"),
              HasSubstr("voxels.ply 12 103.000 204.000 0.000 103.100 204.100 0.100 coloured"));
  EXPECT_THAT(Read("mesh", "line_bars.ply"), HasSubstr("line_bars.ply 144 "));
}

}  // namespace
}  // namespace slcmap
