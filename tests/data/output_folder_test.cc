#include "data/output_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "data/error.h"
#include "data/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::ReadText;

const StageFiles kMap = {"a map", {"map.json", "points.ply"}};

class OutputFolderTest : public ::testing::Test {
 protected:
  testing::TempFolder temp_;
  const std::string path_ = temp_.Path("out");
};

TEST_F(OutputFolderTest, FilesAppearTogetherAndReplaceOlderOnes) {
  temp_.Write("out/map.json", "old");
  temp_.Write("out/points.ply", "old");
  temp_.Write("out/notes.txt", "mine");
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

TEST_F(OutputFolderTest, FoldersAreReplacedWithAllThatIsInThem) {
  const StageFiles files = {"an export", {"export.json", "model"}};
  for (const char* name : {"old.txt", "new.txt"}) {
    OutputFolder output(path_, files);
    MakeFolder(output.staging() + "/model");
    WriteFile(output.staging() + "/model/" + name, "text");
    WriteFile(output.staging() + "/export.json", "{}");
    output.Commit();
  }
  EXPECT_TRUE(fs::exists(path_ + "/model/new.txt"));
  EXPECT_FALSE(fs::exists(path_ + "/model/old.txt"));
}

TEST_F(OutputFolderTest, FilesThatAreNotOfTheStageAreNeitherReplacedNorRemoved) {
  temp_.Write("out/points.ply", "mine");
  EXPECT_THAT(MessageOf<ConfigError>([&] { OutputFolder(path_, kMap); }),
              HasSubstr("found points.ply, which is not of a map"));
  fs::remove(path_ + "/points.ply");
  temp_.Write("out/previous-1/points.ply", "mine");
  OutputFolder(path_, kMap).RemoveAside();
  EXPECT_EQ(ReadText(path_ + "/previous-1/points.ply"), "mine");
}

TEST_F(OutputFolderTest, NothingIsWrittenIntoWhatAnotherStageIsReadFrom) {
  temp_.Write("run/run.json", "{}");
  const std::string run = temp_.Path("run");
  for (const char* within : {"", "/.", "/deeper", "/previous-1/deeper"}) {
    EXPECT_THROW(OutputFolder(run + within, kMap, {run}), ConfigError) << within;
  }
  EXPECT_NO_THROW(OutputFolder(run + "s", kMap, {run}));
}

TEST_F(OutputFolderTest, WhatIsNotCommittedLeavesEverythingAsItWas) {
  temp_.Write("out/map.json", "old");
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

TEST_F(OutputFolderTest, AKilledWritersFilesAreNotTakenOver) {
  temp_.Write("out/.unfinished/lines.ply", "of a process that was killed");
  OutputFolder output(path_, kMap);
  WriteFile(output.staging() + "/map.json", "{}");
  output.Commit();
  EXPECT_FALSE(fs::exists(path_ + "/lines.ply"));
  EXPECT_FALSE(fs::exists(path_ + "/.unfinished"));
}

TEST_F(OutputFolderTest, OneAtATime) {
  {
    const OutputFolder first(path_, kMap);
    EXPECT_THAT(MessageOf<OutputError>([&] { OutputFolder second(path_, kMap); }),
                HasSubstr("out: in use"));
    EXPECT_THAT(MessageOf<DataError>([&] { InputLock reader(path_); }), HasSubstr("out: in use"));
  }
  const OutputFolder again(path_, kMap);
}

TEST_F(OutputFolderTest, ReadersKeepWritersOutButNotEachOther) {
  MakeFolder(path_);
  const InputLock one(path_), other(path_);
  EXPECT_THAT(MessageOf<OutputError>([&] { OutputFolder writer(path_, kMap); }),
              HasSubstr("out: in use"));
}

TEST_F(OutputFolderTest, InputsAreRefusedUnderAnyName) {
  MakeFolder(path_);
  fs::create_directory_symlink(path_, temp_.Path("link"));
  for (const std::string& name : {path_, path_ + "/", temp_.Path("link"), path_ + "/../out"}) {
    EXPECT_THAT(MessageOf<ConfigError>([&] { OutputFolder output(name, kMap, {path_}); }),
                HasSubstr("found the input"))
        << name;
  }
  const OutputFolder within(path_ + "/map", kMap, {path_});
}

TEST_F(OutputFolderTest, AnEmptyPathAndOtherStagesFoldersAreRefused) {
  EXPECT_THAT(MessageOf<ConfigError>([&] { OutputFolder output("", kMap); }),
              HasSubstr("output: found an empty path"));
  for (const char* mark : {"run.json", "export.json", "journal/header.json"}) {
    fs::remove_all(path_);
    temp_.Write(std::string("out/") + mark, "{}");
    EXPECT_THAT(MessageOf<ConfigError>([&] { OutputFolder output(path_, kMap); }),
                HasSubstr("expected a folder of its own for a map"))
        << mark;
  }
}

TEST_F(OutputFolderTest, OlderResultsMoveAsideOneByOneAndTheUsersFilesStay) {
  OutputFolder output(path_, kMap);
  EXPECT_EQ(output.MoveAside(), "");
  temp_.Write("out/map.json", "first");
  temp_.Write("out/notes.txt", "mine");
  EXPECT_EQ(output.MoveAside(), path_ + "/previous-1");
  temp_.Write("out/map.json", "second");
  EXPECT_EQ(output.MoveAside(), path_ + "/previous-2");
  EXPECT_EQ(ReadText(path_ + "/previous-1/map.json"), "first");
  EXPECT_EQ(ReadText(path_ + "/notes.txt"), "mine");
  temp_.Write("out/previous-1/notes.txt", "mine too");
  output.RemoveAside();
  EXPECT_FALSE(fs::exists(path_ + "/previous-2"));
  EXPECT_FALSE(fs::exists(path_ + "/previous-1/map.json"));
  EXPECT_EQ(ReadText(path_ + "/previous-1/notes.txt"), "mine too");
}

}  // namespace
}  // namespace slcmap
