#include "data/io/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(File, BytesComeBack) {
  const testing::TempFolder folder;
  std::string bytes("a\0\r\n\xff", 5);
  bytes.append(200000, 'x');  // more than a block
  WriteFile(folder.Path("a"), "longer than what replaces it" + bytes);
  WriteFile(folder.Path("a"), bytes);
  EXPECT_EQ(ReadFile(folder.Path("a")), bytes);
  WriteFile(folder.Path("a"), "");
  EXPECT_EQ(ReadFile(folder.Path("a")), "");
}

TEST(File, ErrorsNameTheFileAndTheCause) {
  const testing::TempFolder folder;
  EXPECT_THAT([&] { ReadFile(folder.Path("none")); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("none"), HasSubstr("No such file"))));
  EXPECT_THAT([&] { ReadFile(folder.Path()); },
              ThrowsMessage<DataError>(HasSubstr("Is a directory")));
  EXPECT_THAT([&] { WriteFile(folder.Path("none/a"), "a"); },
              ThrowsMessage<OutputError>(HasSubstr("none/a: cannot be created: No such file")));
  // Small enough to wait in a buffer until the file is closed, and too large for that.
  for (const std::size_t size : {1, 1000000}) {
    EXPECT_THAT([&] { WriteFile("/dev/full", std::string(size, 'x')); },
                ThrowsMessage<OutputError>(HasSubstr("/dev/full: cannot be written: No space")));
  }
}

TEST(File, LinksStayAndWhatTheyLeadToIsReplaced) {
  namespace fs = std::filesystem;
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
  EXPECT_THAT([&] { ReplaceFile("/dev/null", "a"); },
              ThrowsMessage<OutputError>(HasSubstr("/dev/null: found a device, expected a file")));
  EXPECT_THAT([&] { ReplaceFile(folder.Path(), "a"); },
              ThrowsMessage<OutputError>(HasSubstr("found a folder")));
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

}  // namespace
}  // namespace slcmap
