#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

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
}

TEST_F(CsvTableTest, AHeaderAloneIsAnEmptyTable) { EXPECT_EQ(Read("id,x_m\n").rows(), 0u); }

TEST_F(CsvTableTest, WrongTablesAreNamed) {
  EXPECT_THAT([&] { Read(""); }, ThrowsMessage<DataError>(HasSubstr("table.csv: empty")));
  EXPECT_THAT([&] { Read("id,y_m\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 1: found the columns 'id,y_m'")));
  EXPECT_THAT([&] { Read("id,x_m\n1\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 2: found 1 columns, expected 2")));
  EXPECT_THAT([&] { Read("id,x_m\n1,2,3\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 2: found 3 columns, expected 2")));
  EXPECT_THROW(CsvTable::Read(folder_.Path("none.csv"), "id"), DataError);
}

TEST_F(CsvTableTest, WrongCellsAreNamed) {
  const CsvTable table = Read("id,x_m\n1a,inf\n");
  EXPECT_THAT([&] { table.Integer(0, 0); },
              ThrowsMessage<DataError>(HasSubstr("row 2: id: found '1a', expected an integer")));
  EXPECT_THAT([&] { table.Number(0, 1); },
              ThrowsMessage<DataError>(HasSubstr("row 2: x_m: found 'inf'")));
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
  EXPECT_THAT([&] { read("id,x_m\n3,0.5\n1,2\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 3: x_m: found '2', expected -1 to 1")));
  EXPECT_THAT([&] { read("id,x_m\n3\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 2: found 1 columns, expected 2")));
  EXPECT_THAT([&] { read("id\n"); }, ThrowsMessage<DataError>(HasSubstr("found the columns 'id'")));
}

TEST_F(CsvTableTest, CellsBeyondTheirColumnsRangeAreNamed) {
  const CsvColumns columns = {{"id", CsvColumn::Kind::kInteger, 0, 9},
                              {"x_m", CsvColumn::Kind::kOptionalNumber, -1, 1}};
  const auto read = [&](const std::string& rows) {
    return CsvTable::Read(folder_.Write("table.csv", "id,x_m\n" + rows), columns);
  };
  EXPECT_EQ(read("9,-1\n0,nan\n").rows(), 2u);
  EXPECT_THAT([&] { read("1,1\n10,0\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 3: id: found '10', expected 0 to 9")));
  EXPECT_THAT([&] { read("1,1.5\n"); },
              ThrowsMessage<DataError>(HasSubstr("row 2: x_m: found '1.5', expected -1 to 1")));
  EXPECT_THAT([&] { read("1,inf\n"); }, ThrowsMessage<DataError>(HasSubstr("x_m: found 'inf'")));
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
  EXPECT_THAT([&] { read("a,1\nb,1\n"); },
              ThrowsMessage<DataError>(HasSubstr("tables.csv: row 2: found 1 columns")));
  EXPECT_THAT([&] { read("c,1\n"); }, ThrowsMessage<DataError>(HasSubstr("row 1: found 'c'")));
}

}  // namespace
}  // namespace slcmap
