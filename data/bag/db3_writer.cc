#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "data/bag/containers.h"
#include "data/bag/sqlite.h"
#include "data/io/file.h"

namespace slcmap::inline data {
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
    if (compression_ == "zstd_file") {
      PackZstdFile(PlacedFile(path_), path_ + ".zstd");
      std::filesystem::remove(path_);
      name_ += ".zstd";
    }
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
        packed ? "zstd" : "\"\"",
        !packed                  ? "\"\""
        : compression_ == "zstd" ? "MESSAGE"
                                 : "FILE",
        name_);
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
  RequirePacking(path, compression, {"none", "zstd", "zstd_file"});
  return std::make_unique<Db3Writer>(path, compression);
}

}  // namespace slcmap::data
