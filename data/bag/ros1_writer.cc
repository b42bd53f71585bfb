#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "data/bag/containers.h"
#include "data/bag/messages.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

// A record of a ROS 1 bag: fields of its header, each "name=value" behind its length, and data.
class Ros1RecordText {
 public:
  explicit Ros1RecordText(Ros1Op op) { Add("op", static_cast<uint8_t>(op)); }
  Ros1RecordText() = default;  // what a connection says stands as a header without a record

  template <typename Number>
  requires std::is_arithmetic_v<Number> Ros1RecordText& Add(std::string_view name, Number value) {
    return Add(name, AsText(std::as_bytes(std::span(&value, 1))));
  }

  Ros1RecordText& Add(std::string_view name, std::string_view value) {
    AppendBytes(static_cast<uint32_t>(name.size() + 1 + value.size()), &header_);
    header_.append(name).append("=").append(value);
    return *this;
  }

  Ros1RecordText& AddTime(std::string_view name, int64_t time_ns) {
    return Add(name, Time(time_ns));
  }

  // Seconds and nanoseconds.
  static uint64_t Time(int64_t time_ns) {
    return static_cast<uint64_t>(time_ns / kSecond_ns) | static_cast<uint64_t>(time_ns % kSecond_ns)
                                                             << 32;
  }

  const std::string& header() const { return header_; }

  void AppendTo(std::string* bytes, std::string_view data) const {
    AppendBytes(static_cast<uint32_t>(header_.size()), bytes);
    bytes->append(header_);
    AppendBytes(static_cast<uint32_t>(data.size()), bytes);
    bytes->append(data);
  }

 private:
  std::string header_;
};

class Ros1Writer : public BagWriter {
 public:
  Ros1Writer(const std::string& path, std::string compression)
      : path_(path), compression_(std::move(compression)), file_(path) {
    Put(std::string(kRos1Magic));
    Put(FileHeader(0));
  }

  uint32_t AddTopic(const BagTopic& topic) override {
    if (topic.encoding != BagEncoding::kRos1) {
      throw ConfigError(fmt::format("{}: topic {}: found messages in {}, expected ros1", path_,
                                    topic.name, topic.encoding_name));
    }
    RosDefinition known = DefinitionFor(topic.type, topic.encoding);
    if (known.text.empty()) known = {topic.definition, "*"};
    const auto conn = static_cast<uint32_t>(connections_.size());
    std::string& record = connections_.emplace_back();
    Ros1RecordText(kRos1Connection)
        .Add("conn", conn)
        .Add("topic", topic.name)
        .AppendTo(&record, Ros1RecordText()
                               .Add("topic", topic.name)
                               .Add("type", topic.type)
                               .Add("md5sum", known.md5)
                               .Add("message_definition", known.text)
                               .header());
    written_.push_back(false);
    return conn;
  }

  void Write(uint32_t topic, int64_t received_ns, BagBytes message) override {
    if (!written_.at(topic)) chunk_ += connections_[topic];
    written_[topic] = true;
    if (index_.empty()) first_ns_ = last_ns_ = received_ns;
    first_ns_ = std::min(first_ns_, received_ns);
    last_ns_ = std::max(last_ns_, received_ns);
    std::string& entries = index_[topic];
    AppendBytes(Ros1RecordText::Time(received_ns), &entries);
    AppendBytes(static_cast<uint32_t>(chunk_.size()), &entries);
    Ros1RecordText(kRos1Message)
        .Add("conn", topic)
        .AddTime("time", received_ns)
        .AppendTo(&chunk_, AsText(message));
    if (chunk_.size() >= kChunkSize) FinishChunk();
  }

  void Close() override {
    if (!chunk_.empty()) FinishChunk();
    const uint64_t index_at = at_;
    for (const std::string& connection : connections_) Put(connection);
    Put(chunk_infos_);
    file_.Overwrite(kRos1Magic.size(), FileHeader(index_at));
    file_.Close();
  }

 private:
  void Put(const std::string& bytes) {
    file_.Add(bytes);
    at_ += bytes.size();
  }

  // Filled with blanks, for the index's place to be written over it.
  std::string FileHeader(uint64_t index_at) const {
    constexpr size_t kSize = 4096;
    Ros1RecordText record(kRos1FileHeader);
    record.Add("index_pos", index_at)
        .Add("conn_count", static_cast<uint32_t>(connections_.size()))
        .Add("chunk_count", chunks_);
    std::string bytes;
    record.AppendTo(&bytes, std::string(kSize - 8 - record.header().size(), ' '));
    return bytes;
  }

  void FinishChunk() {
    const uint64_t chunk_at = at_;
    std::string bytes, counts;
    Ros1RecordText(kRos1Chunk)
        .Add("compression", compression_)
        .Add("size", static_cast<uint32_t>(chunk_.size()))
        .AppendTo(&bytes, compression_ == "none" ? chunk_ : Pack(compression_, chunk_));
    constexpr size_t kEntry = 8 + 4;
    for (const auto& [conn, entries] : index_) {
      const auto count = static_cast<uint32_t>(entries.size() / kEntry);
      Ros1RecordText(kRos1Index)
          .Add("ver", uint32_t{1})
          .Add("conn", conn)
          .Add("count", count)
          .AppendTo(&bytes, entries);
      AppendBytes(conn, &counts);
      AppendBytes(count, &counts);
    }
    Put(bytes);
    Ros1RecordText(kRos1ChunkInfo)
        .Add("ver", uint32_t{1})
        .Add("chunk_pos", chunk_at)
        .AddTime("start_time", first_ns_)
        .AddTime("end_time", last_ns_)
        .Add("count", static_cast<uint32_t>(index_.size()))
        .AppendTo(&chunk_infos_, counts);
    ++chunks_;
    chunk_.clear();
    index_.clear();
  }

  std::string path_, compression_;
  FileWriter file_;
  uint64_t at_ = 0;
  std::vector<std::string> connections_;  // their records
  std::vector<bool> written_;             // of those, in chunks
  std::string chunk_, chunk_infos_;
  std::map<uint32_t, std::string> index_;  // of the chunk, by connection
  int64_t first_ns_ = 0, last_ns_ = 0;
  uint32_t chunks_ = 0;
};

}  // namespace

void RequirePacking(const std::string& path, const std::string& compression,
                    const std::vector<std::string>& known) {
  if (std::ranges::count(known, compression) > 0) return;
  throw ConfigError(fmt::format("{}: found the packing '{}', expected {}", path, compression,
                                fmt::join(known, ", ")));
}

std::unique_ptr<BagWriter> CreateRos1Bag(const std::string& path, const std::string& compression) {
  RequirePacking(path, compression, {"none", "lz4", "bz2"});
  return std::make_unique<Ros1Writer>(path, compression);
}

}  // namespace slcmap::data
