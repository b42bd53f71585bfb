#include "data/io/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "data/core/error.h"
#include "data/io/output_folder.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::ReadText;

TEST(File, ErrorsNameTheFileAndTheCause) {
  const testing::TempFolder folder;
  ASSERT_EQ(mkfifo(folder.Path("pipe").c_str(), 0600), 0);  // nobody will ever write into it
  for (const auto& [name, found] : {std::pair{"none", "none: cannot be opened: No such file"},
                                    {"", "found a folder"},
                                    {"pipe", "pipe: found a pipe, expected a file"}}) {
    EXPECT_THAT(MessageOf<DataError>([&] { ReadFile(folder.Path(name)); }), HasSubstr(found));
  }
  const auto write = [](const std::string& path, const std::string& text) {
    return MessageOf<OutputError>([&] { WriteFile(path, text); });
  };
  EXPECT_THAT(write(folder.Path("none/a"), "a"),
              HasSubstr("none/a: cannot be created: No such file"));
  // Small enough to wait in a buffer until the file is closed, and too large for that.
  for (const std::size_t size : {1, 1000000}) {
    EXPECT_THAT(write("/dev/full", std::string(size, 'x')),
                HasSubstr("/dev/full: cannot be written: No space"));
  }
}

TEST(File, LinksStayAndWhatTheyLeadToIsReplaced) {
  const testing::TempFolder folder;
  fs::create_symlink("target", folder.Path("link"));
  fs::create_symlink(folder.Path("link"), folder.Path("outer"));
  EXPECT_EQ(LinkTarget(folder.Path("outer")), folder.Path("target"));
  for (const char* text : {"where nothing was", "where something was"}) {
    ReplaceFile(folder.Path("outer"), text);
    EXPECT_TRUE(fs::is_symlink(folder.Path("outer")));
    EXPECT_EQ(ReadFile(folder.Path("target")), text);
  }
  EXPECT_FALSE(fs::exists(folder.Path("target.unfinished")));
}

TEST(File, WhatIsNoFileIsNotReplaced) {
  const testing::TempFolder folder;
  EXPECT_THAT(MessageOf<OutputError>([] { ReplaceFile("/dev/null", "a"); }),
              HasSubstr("/dev/null: found a device, expected a file"));
  EXPECT_THAT(MessageOf<OutputError>([&] { ReplaceFile(folder.Path(), "a"); }),
              HasSubstr("found a folder"));
  EXPECT_EQ(NoFileAt(folder.Path("none")), "");
}

TEST(File, FoldersAreMadeWithThoseAbove) {
  const testing::TempFolder folder;
  MakeFolder(folder.Path("a/b/c"));
  MakeFolder(folder.Path("a/b/c"));
  EXPECT_TRUE(std::filesystem::is_directory(folder.Path("a/b/c")));
  folder.Write("file", "");
  EXPECT_THROW(MakeFolder(folder.Path("file")), OutputError);
  EXPECT_THROW(MakeFolder("/proc/none"), OutputError);
}

const StageFiles kMap = {"a map", {"map.json", "points.ply"}};
constexpr char kComplete[] = R"({"format": "slcmap map", "complete": true})";
constexpr char kPartial[] = R"({"format": "slcmap map", "complete": false})";

class OutputFolderTest : public ::testing::Test {
 protected:
  // Writes a map of nothing but a summary.
  static void Write(OutputFolder* output, const char* summary, bool complete) {
    WriteFile(output->staging() + "/map.json", summary);
    output->Commit(complete);
  }

  testing::TempFolder temp_;
  const std::string path_ = temp_.Path("out");
};

TEST_F(OutputFolderTest, WhatIsOfOthersOrReadIsRefused) {
  const char* const kRun = R"({"format": "slcmap run"})";
  for (const auto& [file, text] : {std::pair{"run/run.json", kRun},
                                   {"exported/export.json", R"({"format": "slcmap export"})"},
                                   {"begun/journal/header.json", kRun},
                                   {"points/points.ply", "mine"},
                                   {"x/map.json", "x"},
                                   {"keyless/map.json", "{}"},
                                   {"other/map.json", kRun},
                                   {"list/map.json", "[1]"},
                                   {"sequence/mav0/a", ""},
                                   {"in/notes.txt", "mine"},
                                   {"map/map.json", kComplete},
                                   {"map/points.ply", "an input"},
                                   {"map/previous-1/map.json", kComplete},
                                   {"map/mine.yaml", ""}}) {
    temp_.Write(file, text);
  }
  fs::create_directory_symlink(temp_.Path("in"), temp_.Path("link"));
  fs::create_symlink(temp_.Path("map/points.ply"), temp_.Path("link.ply"));
  const struct {
    const char *folder, *input, *message;  // "" where it is taken
  } kRows[] = {{"run", "", "expected a folder of its own for a map"},
               {"exported", "", "expected a folder of its own for a map"},
               {"begun", "", "expected a folder of its own for a map"},
               {"points", "", "found points.ply, which is not of a map"},
               {"x", "", "found map.json, which is not of a map"},
               {"keyless", "", "found map.json, which is not of a map"},
               {"other", "", "found map.json, which is not of a map"},
               {"list", "", "found map.json, which is not of a map"},
               {"in", "in", "found the input"},
               {"in/", "in", "found the input"},
               {"link", "in", "found the input"},
               {"in/../in", "in", "found the input"},
               {"in/map", "in", ""},
               {"run/.", "run", "found the input"},
               {"run/deeper", "run", "nothing is written into what is read"},
               {"run/previous-1/deeper", "run", "nothing is written into what is read"},
               {"runs", "run", ""},
               {"sequence/x", "sequence", "nothing is written into what is read"},
               {"sequence/mav0/x/y", "sequence", "nothing is written into what is read"},
               {"map", "map/points.ply", "in it, expected another folder: it would be replaced"},
               {"map", "link.ply", "in it, expected another folder: it would be replaced"},
               {"map", "map/previous-1", "in it, expected another folder: it would be replaced"},
               {"map", "map/previous-1/map.json", "in it, expected another folder: it would"},
               {"map", "map/mine.yaml", ""}};
  for (const auto& [folder, input, message] : kRows) {
    std::vector<std::string> inputs;
    if (*input != '\0') inputs.push_back(temp_.Path(input));
    const std::string refusal =
        MessageOf<ConfigError>([&] { OutputFolder output(temp_.Path(folder), kMap, inputs); });
    EXPECT_THAT(refusal, HasSubstr(message)) << folder << " " << input;
    EXPECT_EQ(refusal.empty(), *message == '\0') << folder << " " << input << " " << refusal;
  }
  EXPECT_THAT(MessageOf<ConfigError>([&] { OutputFolder output("", kMap); }),
              HasSubstr("output: found an empty path"));
}

TEST_F(OutputFolderTest, FilesAppearTogetherAndReplaceOlderOnes) {
  temp_.Write("out/map.json", kComplete);
  temp_.Write("out/points.ply", "old");
  temp_.Write("out/notes.txt", "mine");
  temp_.Write("out/.unfinished/lines.ply", "of a process that was killed");
  OutputFolder output(path_, kMap);
  WriteFile(output.staging() + "/points.ply", "new");
  WriteFile(output.staging() + "/map.json", "{}");
  EXPECT_EQ(ReadText(path_ + "/points.ply"), "old");
  output.Commit();
  EXPECT_EQ(ReadText(path_ + "/points.ply"), "new");
  EXPECT_EQ(ReadText(path_ + "/map.json"), "{}");
  EXPECT_EQ(ReadText(path_ + "/notes.txt"), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(path_), {}), 3);
}

TEST_F(OutputFolderTest, FoldersAreReplacedWhole) {
  temp_.Write("out/map.json", kComplete);
  for (const char* storey : {"0", "1"}) {
    temp_.Write(std::string("out/plan/storey_") + storey + ".svg", "old");
  }
  OutputFolder output(path_, {"a map", {"map.json", "plan"}});
  MakeFolder(output.staging() + "/plan");
  WriteFile(output.staging() + "/plan/storey_0.svg", "new");
  Write(&output, "{}", true);
  EXPECT_EQ(ReadText(path_ + "/plan/storey_0.svg"), "new");
  EXPECT_FALSE(fs::exists(path_ + "/plan/storey_1.svg"));
}

TEST_F(OutputFolderTest, FilesThatAreNotOfTheStageAreNotRemoved) {
  temp_.Write("out/previous-1/points.ply", "mine");
  OutputFolder output(path_, kMap);
  Write(&output, kComplete, true);
  EXPECT_EQ(ReadText(path_ + "/previous-1/points.ply"), "mine");
}

TEST_F(OutputFolderTest, WhatIsNotCommittedLeavesEverythingAsItWas) {
  temp_.Write("out/map.json", kComplete);
  temp_.Write("out/points.ply", "old");
  {
    OutputFolder output(path_, kMap);
    WriteFile(output.staging() + "/points.ply", "new");
    OutputFolder made(temp_.Path("made"), kMap);
    WriteFile(made.staging() + "/points.ply", "new");
  }
  EXPECT_EQ(ReadText(path_ + "/points.ply"), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(path_), {}), 2);
  EXPECT_FALSE(fs::exists(temp_.Path("made")));
}

TEST_F(OutputFolderTest, OneAtATime) {
  {
    OutputFolder first(path_, kMap);
    first.Open();
    EXPECT_THAT(MessageOf<OutputError>([&] { OutputFolder(path_, kMap).Open(); }),
                HasSubstr("out: in use"));
    EXPECT_THAT(MessageOf<DataError>([&] { InputLock reader(path_); }), HasSubstr("out: in use"));
  }
  OutputFolder(path_, kMap).Open();
  // Readers keep writers out, but not each other.
  MakeFolder(path_);
  const InputLock one(path_), other(path_);
  EXPECT_THAT(MessageOf<OutputError>([&] { OutputFolder(path_, kMap).Open(); }),
              HasSubstr("out: in use"));
}

TEST_F(OutputFolderTest, OlderResultsMoveAsideOneByOneAndTheUsersFilesStay) {
  OutputFolder output(path_, kMap);
  EXPECT_EQ(output.MoveAside(), "");
  temp_.Write("out/map.json", kPartial);
  temp_.Write("out/notes.txt", "mine");
  EXPECT_EQ(output.MoveAside(), path_ + "/previous-1");
  temp_.Write("out/map.json", kComplete);
  EXPECT_EQ(output.MoveAside(), path_ + "/previous-2");
  EXPECT_EQ(ReadText(path_ + "/previous-1/map.json"), kPartial);
  EXPECT_EQ(ReadText(path_ + "/notes.txt"), "mine");
  temp_.Write("out/previous-1/notes.txt", "mine too");
  Write(&output, kComplete, true);
  EXPECT_FALSE(fs::exists(path_ + "/previous-2"));
  EXPECT_FALSE(fs::exists(path_ + "/previous-1/map.json"));
  EXPECT_EQ(ReadText(path_ + "/previous-1/notes.txt"), "mine too");
}

TEST_F(OutputFolderTest, PartialResultsReplaceNoCompleteOnes) {
  temp_.Write("out/map.json", kComplete);
  temp_.Write("out/points.ply", "complete");
  OutputFolder output(path_, kMap);
  for (int i = 0; i < 2; ++i) {  // the second ones replace partial ones
    Write(&output, kPartial, false);
    EXPECT_EQ(ReadText(path_ + "/map.json"), kPartial);
    EXPECT_EQ(ReadText(path_ + "/previous-1/map.json"), kComplete);
    EXPECT_EQ(ReadText(path_ + "/previous-1/points.ply"), "complete");
    EXPECT_FALSE(fs::exists(path_ + "/points.ply"));
    EXPECT_FALSE(fs::exists(path_ + "/previous-2"));
  }
  Write(&output, kComplete, true);
  EXPECT_FALSE(fs::exists(path_ + "/previous-1"));
}

TEST_F(OutputFolderTest, ANameAloneMakesNoFolderOurs) {
  temp_.Write("out/run.json", "x");  // not a run's, and a map leaves it alone
  OutputFolder output(path_, kMap);
  Write(&output, kComplete, true);
  EXPECT_EQ(ReadText(path_ + "/run.json"), "x");
}

TEST_F(OutputFolderTest, WhatIsDamagedIsKeptAside) {
  for (const std::string& damaged : {std::string(kComplete).substr(0, 30), std::string()}) {
    fs::remove_all(path_);
    temp_.Write("out/map.json", damaged);
    temp_.Write("out/points.ply", "old");
    OutputFolder output(path_, kMap);
    for (int i = 0; i < 2; ++i) Write(&output, kComplete, true);
    EXPECT_EQ(ReadText(path_ + "/previous-1/map.json"), damaged);
    EXPECT_EQ(ReadText(path_ + "/previous-1/points.ply"), "old");
  }
}

TEST_F(OutputFolderTest, OnlyFoldersThatItMovedAsideAreRemoved) {
  temp_.Write("out/map.json", kComplete);
  for (const char* name : {"previous-1", "previous-", "previous-best", "previous-1b"}) {
    temp_.Write("out/" + std::string(name) + "/map.json", kComplete);
  }
  OutputFolder output(path_, kMap);
  Write(&output, kComplete, true);
  EXPECT_FALSE(fs::exists(path_ + "/previous-1"));
  for (const char* name : {"previous-", "previous-best", "previous-1b"}) {
    EXPECT_TRUE(fs::exists(path_ + "/" + name + "/map.json")) << name;
  }
}

TEST_F(OutputFolderTest, FoldersThatStayEmptyGoAwayAgain) {
  {
    OutputFolder output(path_ + "/deep/er", kMap);
    output.Open();
    EXPECT_TRUE(fs::exists(path_ + "/deep/er"));
  }
  EXPECT_FALSE(fs::exists(path_));
  MakeFolder(path_);
  OutputFolder(path_, kMap).Open();
  EXPECT_TRUE(fs::exists(path_)) << "was there before";
}

}  // namespace
}  // namespace slcmap
