#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "data/bag/containers.h"
#include "data/bag/sqlite.h"

namespace slcmap::inline data {
namespace {

std::string ColumnText(sqlite3_stmt* statement, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
  return text == nullptr ? "" : text;
}

// Bytes of one message after another, without the rest of its row.
class MessageBlob {
 public:
  explicit MessageBlob(sqlite3* db) : db_(db) {}

  // False where the row is not there or not whole.
  bool Read(int64_t row, size_t most, std::vector<std::byte>* bytes) {
    int status = SQLITE_OK;
    if (blob_) {
      status = sqlite3_blob_reopen(blob_.get(), row);
    } else {
      sqlite3_blob* blob = nullptr;
      status = sqlite3_blob_open(db_, "main", "messages", "data", row, 0, &blob);
      blob_.reset(blob);
    }
    if (status == SQLITE_OK) {
      const auto size = static_cast<size_t>(sqlite3_blob_bytes(blob_.get()));
      bytes->resize(std::min(size, most));
      status = sqlite3_blob_read(blob_.get(), bytes->data(), static_cast<int>(bytes->size()), 0);
    }
    if (status != SQLITE_OK) blob_.reset();
    return status == SQLITE_OK;
  }

 private:
  sqlite3* db_;
  SqliteHandle<sqlite3_blob> blob_;
};

class Db3Bag : public Bag {
 public:
  explicit Db3Bag(const std::string& path) : path_(path) {
    sqlite3* db = nullptr;
    // Never as "immutable": what a killed recorder left in the file's -wal would not be seen.
    const int status =
        sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READONLY | SQLITE_OPEN_FULLMUTEX, nullptr);
    db_.reset(db);
    if (status != SQLITE_OK) Fail();
    sqlite3_exec(db, "PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON", nullptr, nullptr,
                 nullptr);
    ReadTopics();
    CountMessages();
  }

  const std::string& path() const override { return path_; }
  const std::string& form() const override { return form_; }
  const std::vector<BagTopic>& topics() const override { return topics_; }
  Warnings warnings() const override { return losses_.warnings(); }

  void Visit(const std::vector<uint32_t>& topics, size_t head, const Visitor& visit) override {
    std::vector<bool> chosen(topics_.size());
    for (const uint32_t topic : topics) chosen.at(topic) = true;
    MessageBlob blob(db_.get());
    std::vector<std::byte> bytes;
    const auto rows = Prepare("SELECT id, topic_id, timestamp, length(data) FROM messages");
    bool more = rows != nullptr;
    while (more && Step(rows.get())) {
      const auto topic = numbers_.find(sqlite3_column_int64(rows.get(), 1));
      if (topic == numbers_.end() || !chosen[topic->second]) continue;
      BagPlace place{topic->second, sqlite3_column_int64(rows.get(), 2)};
      place.block = static_cast<uint64_t>(sqlite3_column_int64(rows.get(), 0));
      place.size = static_cast<uint32_t>(sqlite3_column_int64(rows.get(), 3));
      try {
        bytes = Message(&blob, place, head > 0 ? head : SIZE_MAX);
      } catch (const DataError& error) {
        losses_.Add(kBagDamaged, error.what());
        continue;
      }
      more = visit(place, bytes);
    }
  }

  std::vector<std::byte> Read(const BagPlace& place) const override {
    const std::lock_guard lock(mutex_);
    MessageBlob blob(db_.get());
    return Message(&blob, place, SIZE_MAX);
  }

 private:
  [[noreturn]] void Fail() const {
    const int code = sqlite3_errcode(db_.get());
    const std::string remedy =
        code == SQLITE_CANTOPEN
            ? "copy it, with the -wal file beside it, to a folder that can be written"
            : "copy it again, or mend it with 'sqlite3 FILE .recover'";
    throw InputFault("bag_unreadable",
                     fmt::format("{}: SQLite says '{}', expected tables of topics and messages",
                                 path_, sqlite3_errmsg(db_.get())),
                     remedy);
  }

  SqliteHandle<sqlite3_stmt> Prepare(const char* query) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(db_.get(), query, -1, &statement, nullptr);
    return SqliteHandle<sqlite3_stmt>(statement);
  }

  // Whether there is another row; what is wrong is counted.
  bool Step(sqlite3_stmt* rows) {
    const int status = sqlite3_step(rows);
    if (status != SQLITE_ROW && status != SQLITE_DONE) {
      losses_.Add(kBagDamaged, fmt::format("{}: {}", path_, sqlite3_errmsg(db_.get())));
    }
    return status == SQLITE_ROW;
  }

  std::vector<std::byte> Message(MessageBlob* blob, const BagPlace& place, size_t head) const {
    const bool cdr = topics_.at(place.topic).encoding == BagEncoding::kCdr;
    std::vector<std::byte> bytes;
    const auto read = [&](size_t most) {
      if (!blob->Read(static_cast<int64_t>(place.block), most, &bytes)) {
        throw DataError(
            fmt::format("{}: message {}: {}", path_, place.block, sqlite3_errmsg(db_.get())));
      }
    };
    read(head);
    if (!cdr || !IsZstdFrame(bytes)) return bytes;
    if (bytes.size() < place.size) read(SIZE_MAX);
    try {
      return UnpackZstdMessage(bytes);
    } catch (const DataError& error) {
      throw DataError(fmt::format("{}: message {}: {}", path_, place.block, error.what()));
    }
  }

  // Columns have come with the versions; these were always there.
  void ReadTopics() {
    constexpr const char* kQuery = "SELECT id, name, type, serialization_format FROM topics";
    auto rows = Prepare(kQuery);
    if (!rows && sqlite3_errcode(db_.get()) == SQLITE_CORRUPT) {
      // Shorter than its header says: this lets SQLite read what is there.
      sqlite3_exec(db_.get(), "PRAGMA writable_schema=ON", nullptr, nullptr, nullptr);
      rows = Prepare(kQuery);
      if (rows) losses_.Add(kBagCutOff, path_ + ": is shorter than it says itself");
    }
    if (!rows) Fail();
    while (Step(rows.get())) {
      BagTopic topic{ColumnText(rows.get(), 1), PlainTypeName(ColumnText(rows.get(), 2)),
                     BagEncoding::kOther, ColumnText(rows.get(), 3), 0};
      if (topic.encoding_name == "cdr") topic.encoding = BagEncoding::kCdr;
      numbers_[sqlite3_column_int64(rows.get(), 0)] = static_cast<uint32_t>(topics_.size());
      topics_.push_back(topic);
    }
  }

  void CountMessages() {
    const auto rows = Prepare("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id");
    if (!rows) Fail();
    if (losses_.warnings().Count(kBagCutOff) > 0) {
      for (BagTopic& topic : topics_) topic.messages = -1;
      return;
    }
    int64_t strange = 0;
    while (Step(rows.get())) {
      const auto topic = numbers_.find(sqlite3_column_int64(rows.get(), 0));
      const int64_t count = sqlite3_column_int64(rows.get(), 1);
      (topic == numbers_.end() ? strange : topics_[topic->second].messages) += count;
    }
    if (strange > 0) {
      losses_.Add(kBagDamaged, fmt::format("{}: {} messages of no topic", path_, strange));
    }
  }

  std::string path_, form_ = "rosbag2, db3";
  SqliteHandle<sqlite3> db_;
  std::vector<BagTopic> topics_;
  std::map<int64_t, uint32_t> numbers_;  // of topics, by their id in the table
  BagLosses losses_;
  mutable std::mutex mutex_;  // an error's text is the connection's
};

}  // namespace

std::unique_ptr<Bag> OpenDb3(const std::string& path) { return std::make_unique<Db3Bag>(path); }

}  // namespace slcmap::data
