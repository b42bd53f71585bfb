// SQLite's things, closed when they go away.
#pragma once

#include <sqlite3.h>

#include <memory>

namespace slcmap::inline data {

struct CloseSqlite {
  void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};
template <typename T>
using SqliteHandle = std::unique_ptr<T, CloseSqlite>;

}  // namespace slcmap::data
