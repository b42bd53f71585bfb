#include "data/io/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;

class CsvTableTest : public ::testing::Test {
 protected:
  CsvTable Read(const std::string& text) const {
    return CsvTable::Read(folder_.Write("table.csv", text), "id,x_m");
  }
  testing::TempFolder folder_;
};

TEST_F(CsvTableTest, CellsAreRead) {
  const CsvTable table = Read("# made by hand\nid,x_m\r\n9007199254740993,0.1\r\n\n-2,nan\n");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.Integer(0, 0), 9007199254740993);  // not a double
  EXPECT_EQ(table.Number(0, 1), 0.1);
  EXPECT_EQ(table.OptionalNumber(0, 1), 0.1);
  EXPECT_FALSE(table.OptionalNumber(1, 1).has_value());
  EXPECT_EQ(Read("id,x_m\n").rows(), 0u);
}

TEST_F(CsvTableTest, WrongTablesAndCellsAreNamed) {
  for (const auto& [text, message] : {std::pair{"", "table.csv: empty"},
                                      {"id,y_m\n", "row 1: found the columns 'id,y_m'"},
                                      {"id,x_m\n1\n", "row 2: found 1 columns, expected 2"},
                                      {"id,x_m\n1,2,3\n", "row 2: found 3 columns, expected 2"}}) {
    EXPECT_THAT(MessageOf<DataError>([&] { Read(text); }), HasSubstr(message));
  }
  EXPECT_THROW(CsvTable::Read(folder_.Path("none.csv"), "id"), DataError);
  const CsvTable table = Read("id,x_m\n1a,inf\n");
  EXPECT_THAT(MessageOf<DataError>([&] { table.Integer(0, 0); }),
              HasSubstr("row 2: id: found '1a', expected an integer"));
  EXPECT_THAT(MessageOf<DataError>([&] { table.Number(0, 1); }),
              HasSubstr("row 2: x_m: found 'inf'"));
  EXPECT_THROW(table.OptionalNumber(0, 0), DataError);
}

TEST_F(CsvTableTest, RowsAreReadOneByOne) {
  const CsvColumns columns = {{"id", CsvColumn::Kind::kInteger, 0, 9},
                              {"x_m", CsvColumn::Kind::kNumber, -1, 1}};
  std::vector<int> ids;
  const auto read = [&](const std::string& text) {
    CsvTable::ForEach(folder_.Write("table.csv", text), columns, [&](const CsvTable& row) {
      ASSERT_EQ(row.rows(), 1u);
      ids.push_back(row.Int(0, 0));
    });
  };
  read("id,x_m\n3,0.5\n\n1,1\n");
  EXPECT_EQ(ids, (std::vector<int>{3, 1}));
  EXPECT_THAT(MessageOf<DataError>([&] { read("id,x_m\n3,0.5\n1,2\n"); }),
              HasSubstr("row 3: x_m: found '2', expected -1 to 1"));
}

TEST_F(CsvTableTest, CellsBeyondTheirColumnsRangeAreNamed) {
  const CsvColumns columns = {{"id", CsvColumn::Kind::kInteger, 0, 9},
                              {"x_m", CsvColumn::Kind::kOptionalNumber, -1, 1}};
  const auto read = [&](const std::string& rows) {
    return CsvTable::Read(folder_.Write("table.csv", "id,x_m\n" + rows), columns);
  };
  EXPECT_EQ(read("9,-1\n0,nan\n").rows(), 2u);
  EXPECT_THAT(MessageOf<DataError>([&] { read("1,1\n10,0\n"); }),
              HasSubstr("row 3: id: found '10', expected 0 to 9"));
  EXPECT_THAT(MessageOf<DataError>([&] { read("1,inf\n"); }), HasSubstr("x_m: found 'inf'"));
}

TEST_F(CsvTableTest, TaggedRowsFillTheirTables) {
  const std::map<std::string, CsvColumns> columns = {
      {"a", {{"id", CsvColumn::Kind::kInteger, 0, 9}}},
      {"b", {{"x_m", CsvColumn::Kind::kNumber, -1, 1}, {"y_m", CsvColumn::Kind::kNumber, -1, 1}}}};
  int64_t cut_rows = 0;
  const auto read = [&](const std::string& text) {
    return CsvTable::ReadTagged(folder_.Write("tables.csv", text), columns, &cut_rows);
  };
  auto tables = read("a,1\nb,0.5,1\na,2\na,");
  EXPECT_EQ(tables["a"].rows(), 2u);
  EXPECT_EQ(tables["b"].Number(0, 1), 1);
  EXPECT_EQ(cut_rows, 1);
  EXPECT_THAT(MessageOf<DataError>([&] { read("a,1\nb,1\n"); }),
              HasSubstr("tables.csv: row 2: found 1 columns"));
  EXPECT_THAT(MessageOf<DataError>([&] { read("c,1\n"); }), HasSubstr("row 1: found 'c'"));
}

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
  // Which it was can be asked for.
  for (const char* row : {"1,2", "1 ; 2", " 1\t, 2", ",2", "1,,", ",,", "1 \t 2"}) {
    const auto fields = SplitRow(row);
    EXPECT_EQ(SeparatedByMark(fields[0], fields[1]), row != std::string("1 \t 2")) << row;
  }
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

TEST(ForEachRow, CountsFromOneAndSkipsCommentsAndAByteOrderMark) {
  const testing::TempFolder folder;
  std::vector<int> rows;
  const auto read = [&](const std::string& path) {
    ForEachRow(path, [&](int row, const auto& fields) {
      EXPECT_EQ(fields.size(), 2u);
      rows.push_back(row);
    });
  };
  for (const char* text : {"#t,x\r\n1,2\r\n\r\n3,4", "\xef\xbb\xbf#stamp\n1,2", "\xef\xbb\xbf"}) {
    read(folder.Write("a.csv", text));
  }
  EXPECT_THAT(rows, ElementsAre(2, 4, 2));
  EXPECT_THAT(MessageOf<DataError>([&] { read(folder.Path("none.csv")); }),
              HasSubstr("none.csv: cannot be opened: No such file"));
  EXPECT_THROW(read(folder.Path()), DataError);
}

}  // namespace
}  // namespace slcmap
