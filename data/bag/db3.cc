#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "data/bag/containers.h"
#include "data/bag/sqlite.h"
#include "data/io/file.h"

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

namespace {

constexpr const char* kTables = R"(
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,
  serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL,
  data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES(3, 'humble');
)";

class Db3Writer : public BagWriter {
 public:
  Db3Writer(const std::string& folder, std::string compression)
      : folder_(FolderItself(folder)), compression_(std::move(compression)) {
    MakeFolder(folder_.string());
    name_ = folder_.filename().string() + "_0.db3";
    path_ = (folder_ / name_).string();
    std::error_code ignored;
    for (const char* former : {"", "-journal", "-wal", "-shm"}) {
      std::filesystem::remove(path_ + former, ignored);
    }
    sqlite3* db = nullptr;
    const int status = sqlite3_open(path_.c_str(), &db);
    db_.reset(db);
    Require(status);
    Execute("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF");
    Execute(kTables);
    Execute("BEGIN");
    sqlite3_stmt* insert = nullptr;
    Require(sqlite3_prepare_v2(db, "INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)",
                               -1, &insert, nullptr));
    insert_.reset(insert);
  }

  uint32_t AddTopic(const BagTopic& topic) override {
    if (topic.encoding != BagEncoding::kCdr) {
      throw ConfigError(fmt::format("{}: topic {}: found messages in {}, expected cdr", path_,
                                    topic.name, topic.encoding_name));
    }
    topics_.push_back(topic);
    topics_.back().messages = 0;
    const std::unique_ptr<char, decltype(&sqlite3_free)> query(
        sqlite3_mprintf("INSERT INTO topics VALUES(%d,%Q,%Q,'cdr','')",
                        static_cast<int>(topics_.size()), topic.name.c_str(),
                        Ros2TypeName(topic.type).c_str()),
        &sqlite3_free);
    Execute(query.get());
    return static_cast<uint32_t>(topics_.size() - 1);
  }

  void Write(uint32_t topic, int64_t received_ns, BagBytes message) override {
    std::string packed;
    if (compression_ == "zstd") packed = Pack("zstd", AsText(message));
    const std::string_view data = packed.empty() ? AsText(message) : packed;
    ++topics_.at(topic).messages;
    first_ns_ = std::min(first_ns_.value_or(received_ns), received_ns);
    last_ns_ = std::max(last_ns_, received_ns);
    sqlite3_stmt* const insert = insert_.get();
    Require(sqlite3_bind_int64(insert, 1, topic + 1));
    Require(sqlite3_bind_int64(insert, 2, received_ns));
    Require(sqlite3_bind_blob64(insert, 3, data.data(), data.size(), SQLITE_STATIC));
    sqlite3_step(insert);
    Require(sqlite3_reset(insert));
  }

  void Close() override {
    insert_.reset();
    Execute("COMMIT");
    db_.reset();
    WriteFile((folder_ / "metadata.yaml").string(), Metadata());
  }

 private:
  void Require(int status) const {
    if (status == SQLITE_OK) return;
    throw OutputError(fmt::format("{}: cannot be written: {}", path_, sqlite3_errmsg(db_.get())));
  }

  void Execute(const char* query) {
    Require(sqlite3_exec(db_.get(), query, nullptr, nullptr, nullptr));
  }

  // Of the version that Humble reads, and all since.
  std::string Metadata() const {
    const int64_t start_ns = first_ns_.value_or(0),
                  duration_ns = first_ns_ ? last_ns_ - start_ns : 0;
    int64_t messages = 0;
    std::string topics;
    for (const BagTopic& topic : topics_) {
      messages += topic.messages;
      topics += fmt::format(
          "    - topic_metadata:\n        name: {}\n        type: {}\n"
          "        serialization_format: cdr\n        offered_qos_profiles: \"\"\n"
          "      message_count: {}\n",
          topic.name, Ros2TypeName(topic.type), topic.messages);
    }
    const bool packed = compression_ != "none";
    return fmt::format(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
        "  duration:\n    nanoseconds: {1}\n"
        "  starting_time:\n    nanoseconds_since_epoch: {0}\n  message_count: {2}\n"
        "  topics_with_message_count:{3}{4}\n"
        "  compression_format: {5}\n  compression_mode: {6}\n  relative_file_paths:\n    - {7}\n"
        "  files:\n    - path: {7}\n      starting_time:\n"
        "        nanoseconds_since_epoch: {0}\n"
        "      duration:\n        nanoseconds: {1}\n      message_count: {2}\n",
        start_ns, duration_ns, messages, topics.empty() ? " []" : "\n",
        std::string_view(topics).substr(0, topics.empty() ? 0 : topics.size() - 1),
        packed ? "zstd" : "\"\"", packed ? "MESSAGE" : "\"\"", name_);
  }

  std::filesystem::path folder_;
  std::string compression_, name_, path_;
  SqliteHandle<sqlite3> db_;
  SqliteHandle<sqlite3_stmt> insert_;
  std::vector<BagTopic> topics_;
  std::optional<int64_t> first_ns_;
  int64_t last_ns_ = 0;
};

}  // namespace

std::unique_ptr<BagWriter> CreateDb3(const std::string& path, const std::string& compression) {
  return std::make_unique<Db3Writer>(path, compression);
}

}  // namespace slcmap::data
