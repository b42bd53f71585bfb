#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(SplitRow, TakesCommasOrBlanksAndCarriageReturns) {
  EXPECT_THAT(SplitRow("1, 2 ,3\r"), ElementsAre("1", "2", "3"));
  EXPECT_THAT(SplitRow(" 1  2\t3 \r"), ElementsAre("1", "2", "3"));
  EXPECT_THAT(SplitRow("12,my picture.png"), ElementsAre("12", "my picture.png"));
  EXPECT_THAT(SplitRow("1,,3,"), ElementsAre("1", "", "3"));
  EXPECT_THAT(SplitRow("1; 2 ;3\r"), ElementsAre("1", "2", "3"));
  EXPECT_THAT(SplitRow("1,a;b"), ElementsAre("1", "a;b"));
  EXPECT_THAT(SplitRow("1;-0,5;2"), ElementsAre("1", "-0,5", "2"));
  EXPECT_THAT(SplitRow("\"1\",\"-0,5\", \"a b\""), ElementsAre("1", "-0,5", "a b"));
  EXPECT_THAT(SplitRow("  \r"), IsEmpty());
  EXPECT_THAT(SplitRow("# stamp, x"), IsEmpty());
}

TEST(ParseNumber, ReadsWholeFieldsOnly) {
  EXPECT_EQ(ParseNumber("-1.5e-3"), -1.5e-3);
  EXPECT_EQ(ParseNumber("+2"), 2.0);
  EXPECT_TRUE(std::isnan(*ParseNumber("nan")));
  EXPECT_EQ(ParseNumber("1.5x"), std::nullopt);
  EXPECT_EQ(ParseNumber(""), std::nullopt);
}

TEST(ParseScaledInteger, KeepsEveryNanosecond) {
  EXPECT_EQ(ParseScaledInteger("1403636584.763555585", 9), 1403636584763555585);
  EXPECT_EQ(ParseScaledInteger("1403636584763555585", 0), 1403636584763555585);
  EXPECT_EQ(ParseScaledInteger("1.403636584763555585e+18", 0), 1403636584763555585);
  EXPECT_EQ(ParseScaledInteger("1.403636584763555585e+09", 9), 1403636584763555585);
  EXPECT_EQ(ParseScaledInteger("7", 9), 7000000000);
  EXPECT_EQ(ParseScaledInteger("-0.05", 9), -50000000);
  EXPECT_EQ(ParseScaledInteger("0.0000000004", 9), 0);
  EXPECT_EQ(ParseScaledInteger("0.0000000015", 9), 2);
  EXPECT_EQ(ParseScaledInteger("0.00000000001", 9), 0);
}

TEST(ParseScaledInteger, RefusesOtherTextAndWhatDoesNotFit) {
  for (const char* text : {"", ".", "-", "nan", "1.2.3", "1e", "12s", "0x10", "1e300"}) {
    EXPECT_EQ(ParseScaledInteger(text, 9), std::nullopt) << text;
  }
  EXPECT_EQ(ParseScaledInteger("9300000000", 9), std::nullopt);
}

TEST(ForEachRow, CountsFromOneAndSkipsComments) {
  const testing::TempFolder folder;
  const std::string path = folder.Write("a.csv", "#t,x\r\n1,2\r\n\r\n3,4");
  std::vector<int> rows;
  ForEachRow(path, [&](int row, const auto& fields) {
    EXPECT_EQ(fields.size(), 2u);
    rows.push_back(row);
  });
  EXPECT_THAT(rows, ElementsAre(2, 4));
}

TEST(ForEachRow, NamesAFileThatCannotBeRead) {
  const testing::TempFolder folder;
  const auto read = [](const std::string& path) { ForEachRow(path, [](int, const auto&) {}); };
  EXPECT_THAT(testing::MessageOf<DataError>([&] { read(folder.Path("none.csv")); }),
              ::testing::HasSubstr("none.csv: cannot be opened: No such file"));
  EXPECT_THROW(read(folder.Path()), DataError);
}

TEST(SplitRow, TheSeparatorOfTwoFieldsCanBeAskedFor) {
  for (const char* row : {"1,2", "1 ; 2", " 1\t, 2", ",2", "1,,", ",,"}) {
    const auto fields = SplitRow(row);
    EXPECT_TRUE(SeparatedByMark(fields[0], fields[1])) << row;
  }
  const auto fields = SplitRow("1 \t 2");
  EXPECT_FALSE(SeparatedByMark(fields[0], fields[1]));
}

TEST(ForEachRow, AByteOrderMarkIsNoPartOfTheFirstRow) {
  const testing::TempFolder folder;
  std::vector<std::string> found;
  const auto read = [&](const std::string& text) {
    ForEachRow(folder.Write("a.csv", text),
               [&](int, const auto& fields) { found.emplace_back(fields[0]); });
  };
  read("\xef\xbb\xbf#stamp\n1,2");
  read("\xef\xbb\xbf");
  EXPECT_THAT(found, ElementsAre("1"));
}

}  // namespace
}  // namespace slcmap
