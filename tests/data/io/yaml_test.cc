#include "data/io/yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::Not;
using testing::TempFolder;

TEST(YamlSection, OverridesOnlyWhatIsThere) {
  const TempFolder folder;
  YamlSection root = YamlSection::FromFile(folder.Write(
      "a.yaml", "points: {max_count: 99, weights: [1, 2.5]}\nname: hall\nfast: true\n"));
  int max_count = 1, other = 7;
  bool fast = false;
  std::string name;
  std::vector<double> weights;
  YamlSection points = root.Section("points");
  points.Read("max_count", &max_count);
  points.Read("other", &other);
  points.Read("weights", &weights);
  points.Finish();
  root.Read("name", &name);
  root.Read("fast", &fast);
  YamlSection absent = root.Section("absent");
  absent.Read("other", &other);
  absent.Finish();
  root.Finish();
  EXPECT_EQ(max_count, 99);
  EXPECT_EQ(other, 7);
  EXPECT_EQ(name, "hall");
  EXPECT_TRUE(fast);
  EXPECT_THAT(weights, ElementsAre(1, 2.5));
}

TEST(YamlSection, AnUnknownKeyIsNamedWithThoseThereAre) {
  const TempFolder folder;
  YamlSection root = YamlSection::FromFile(folder.Write("a.yaml", "points: {max_cuont: 99}\n"));
  YamlSection points = root.Section("points");
  int max_count = 0;
  points.Read("max_count", &max_count);
  EXPECT_THAT(MessageOf<ConfigError>([&] { points.Finish(); }),
              AllOf(HasSubstr("a.yaml: points.max_cuont: unknown key"), HasSubstr("max_count")));
  YamlSection twice = YamlSection::FromFile(folder.Write("a.yaml", "a: 1\na: 2\n"));
  twice.Read("a", &max_count);
  EXPECT_THAT(MessageOf<ConfigError>([&] { twice.Finish(); }), HasSubstr("a: found twice"));
}

TEST(YamlSection, RetiredKeysAreTakenWithAWarningUnlessTheFileIsKept) {
  const TempFolder folder;
  const std::string path = folder.Write("a.yaml", "points: {radius: 9, count: 2}\n");
  const auto warning = [&](ConfigOrigin origin) {
    ::testing::internal::CaptureStdout();
    ReadConfigFile(path, origin, [](YamlSection& root) {
      YamlSection points = root.Section("points");
      points.Retire({"radius", "width", "count"});
      points.Finish();
      return 0;
    });
    return ::testing::internal::GetCapturedStdout();
  };
  EXPECT_THAT(warning(ConfigOrigin::kUser),
              AllOf(HasSubstr("a.yaml: found points.radius, points.count, which are no options"),
                    Not(HasSubstr("width"))));
  EXPECT_EQ(warning(ConfigOrigin::kKept), "");
}

template <typename T>
std::string ReadError(const std::string& value) {
  const TempFolder folder;
  YamlSection root = YamlSection::FromFile(folder.Write("a.yaml", "key: " + value + "\n"));
  T read{};
  return MessageOf<ConfigError>([&] { root.Read("key", &read); });
}

TEST(YamlSection, AValueOfAnotherTypeIsShownWithTheTypeExpected) {
  EXPECT_THAT(ReadError<int>("1.5"),
              HasSubstr("a.yaml: key: found '1.5', expected a whole number"));
  EXPECT_THAT(ReadError<double>("far"), HasSubstr("found 'far', expected a finite number"));
  EXPECT_THAT(ReadError<double>(".nan"), HasSubstr("expected a finite number"));
  EXPECT_THAT(ReadError<bool>("3"), HasSubstr("expected true or false"));
  EXPECT_THAT(ReadError<std::vector<double>>("[1, x]"), HasSubstr("expected a list"));
  EXPECT_THAT(ReadError<int>(""), HasSubstr("found nothing, expected a whole number"));
}

TEST(YamlSection, FilesThatAreNoMappingsAreErrors) {
  const TempFolder folder;
  EXPECT_THAT(MessageOf<ConfigError>([&] { YamlSection::FromFile(folder.Path("none.yaml")); }),
              HasSubstr("none.yaml: cannot be opened: No such file"));
  const std::string broken = folder.Write("broken.yaml", "a: 1\nb: [1, 2\n");
  EXPECT_THAT(MessageOf<ConfigError>([&] { YamlSection::FromFile(broken); }),
              HasSubstr("broken.yaml: found no valid YAML: row"));
  const std::string escape = folder.Write("escape.yaml", "a: \"\\\n b\\\x01\"\n");
  EXPECT_THAT(MessageOf<ConfigError>([&] { YamlSection::FromFile(escape); }),
              ::testing::Not(::testing::ContainsRegex("[\x01-\x1f]")));
  const std::string list = folder.Write("list.yaml", "- 1\n- 2\n");
  EXPECT_THAT(MessageOf<ConfigError>([&] { YamlSection::FromFile(list); }),
              HasSubstr("expected keys with values"));
  EXPECT_NO_THROW(YamlSection::FromFile(folder.Write("empty.yaml", "# nothing\n")).Finish());
}

TEST(YamlSection, AByteOrderMarkIsNoObstacle) {
  const TempFolder folder;
  int value = 0;
  for (const char* text : {"\xef\xbb\xbfkey: 7\n", "\xef\xbb\xbf%YAML:1.0\nkey: 7\n"}) {
    YamlSection root = YamlSection::FromFile(folder.Write("a.yaml", text));
    root.Read("key", &value);
    EXPECT_NO_THROW(root.Finish());
    EXPECT_EQ(value, 7);
    value = 0;
  }
}

const std::vector<std::string> kNames = {"points-mono", "points", "points-lines", "slc"};

TEST(NearestName, IsThatOfTheFewestEditsOrNoneWhereNothingIsNear) {
  for (const auto& [word, name] : {std::pair{"slk", "slc"},
                                   {"scl", "slc"},
                                   {"Points", "points"},
                                   {"point", "points"},
                                   {"points_line", "points-lines"}}) {
    EXPECT_EQ(DidYouMean(word, kNames), std::string("; did you mean '") + name + "'?");
  }
  for (const std::string& word : {std::string("orb"), std::string(), std::string(1000000, 's')}) {
    EXPECT_EQ(DidYouMean(word, kNames), "");
  }
  EXPECT_EQ(DidYouMean("slc", {}), "");
}

}  // namespace
}  // namespace slcmap
