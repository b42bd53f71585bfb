#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "data/bag/containers.h"
#include "data/bag/messages.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

// How a ROS 1 bag begins, and what its records are told by.
constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";
enum Ros1Op : uint8_t {
  kRos1Message = 2,
  kRos1FileHeader = 3,
  kRos1Index = 4,
  kRos1Chunk = 5,
  kRos1ChunkInfo = 6,
  kRos1Connection = 7
};

// The fields of a record's header that any kind of record has, and where its data lie.
struct Ros1Record {
  uint8_t op = 0;
  uint32_t conn = 0, size = 0, count = 0, conn_count = 0, chunk_count = 0;
  uint64_t index_pos = 0, chunk_pos = 0;
  int64_t time_ns = 0;
  std::string topic, compression, encryptor, type, definition;

  uint64_t data_at = 0, data_size = 0;
  uint64_t next() const { return data_at + data_size; }
};

template <typename Number>
void SetField(BagBytes value, Number* number) {
  ByteCursor cursor(value);
  *number = cursor.Take<Number>();
}

void SetField(const std::string_view name, BagBytes value, Ros1Record* record) {
  if (name == "op") SetField(value, &record->op);
  if (name == "conn") SetField(value, &record->conn);
  if (name == "size") SetField(value, &record->size);
  if (name == "count") SetField(value, &record->count);
  if (name == "conn_count") SetField(value, &record->conn_count);
  if (name == "chunk_count") SetField(value, &record->chunk_count);
  if (name == "index_pos") SetField(value, &record->index_pos);
  if (name == "chunk_pos") SetField(value, &record->chunk_pos);
  if (name == "topic") record->topic = AsText(value);
  if (name == "type") record->type = AsText(value);
  if (name == "message_definition") record->definition = AsText(value);
  if (name == "compression") record->compression = AsText(value);
  if (name == "encryptor") record->encryptor = AsText(value);
  if (name != "time") return;
  ByteCursor time(value);
  const int64_t s = time.Take<uint32_t>();
  record->time_ns = s * kSecond_ns + time.Take<uint32_t>();
}

// "name=value", each behind its length.
bool SetFields(BagBytes header, Ros1Record* record) {
  ByteCursor fields(header);
  while (fields.ok() && !fields.rest().empty()) {
    const BagBytes field = fields.TakeSized();
    const size_t equals = AsText(field).find('=');
    if (equals == std::string_view::npos) return false;
    SetField(AsText(field).substr(0, equals), field.subspan(equals + 1), record);
  }
  return fields.ok();
}

// False where no whole header that names a kind of record lies before `end`; the data may reach
// beyond.
bool ReadHeader(PlacedBytes* bytes, uint64_t at, uint64_t end, Ros1Record* record) {
  constexpr uint64_t kMostHeader = 1 << 16;
  ByteCursor start(bytes->Peek(at, 4));
  const uint64_t size = start.Take<uint32_t>();
  if (!start.ok() || size > kMostHeader || at + size + 8 > end) return false;
  ByteCursor rest(bytes->Peek(at + 4, size + 4));
  const BagBytes header = rest.Take(size);
  record->data_size = rest.Take<uint32_t>();
  record->data_at = at + size + 8;
  return rest.ok() && SetFields(header, record) && record->op != 0;
}

class Ros1Bag : public ChunkedBag {
 public:
  explicit Ros1Bag(const std::string& path) : ChunkedBag(path) {
    form_ = "ROS 1 bag";
    PlacedBytes bytes(file_);
    RequireVersion(&bytes);
    Ros1Record header;
    if (!ReadHeader(&bytes, kRos1Magic.size(), file_.size(), &header) ||
        header.op != kRos1FileHeader || header.next() > file_.size()) {
      throw InputFault("bag_empty", path + ": ends within its header, expected messages",
                       "record it again: nothing is in it");
    }
    if (!header.encryptor.empty()) {
      throw InputFault(
          "bag_encrypted",
          fmt::format("{}: is encrypted ({}), expected a bag that is not", path, header.encryptor),
          "decrypt it with 'rosbag decrypt' where its key is");
    }
    first_record_ = header.next();
    chunks_tell_all_ = ReadIndex(header);
    if (chunks_tell_all_) return;
    Forget();
    Scan();
    SayUnfinished();
  }

 protected:
  bool WalkRecord(PlacedBytes* bytes, uint64_t* at, const Extent& extent, Walk* walk) override {
    Ros1Record record;
    if (!ReadHeader(bytes, *at, extent.end, &record)) return false;
    const bool whole = record.next() <= extent.end;
    if (record.op == kRos1Chunk && !extent.in_chunk) {
      EnterChunk(bytes, *at, record, walk);
    } else if (record.op == kRos1Connection && whole) {
      AddConnection(bytes, &record);
    } else if (record.op == kRos1Message && whole) {
      const auto topic = topics_by_conn_.find(record.conn);
      if (topic == topics_by_conn_.end()) return false;
      Give(bytes, record.data_at, record.data_size, extent, {topic->second, record.time_ns}, walk);
    }
    *at = whole ? record.next() : *at;
    return whole;
  }

  std::vector<std::byte> LoadChunk(uint64_t block) const override {
    PlacedBytes bytes(file_);
    Ros1Record record;
    if (!ReadHeader(&bytes, block, file_.size(), &record) || record.size > kMostChunk ||
        record.data_size > kMostChunk) {
      throw DataError(fmt::format("{}: no chunk is at {}", path(), block));
    }
    const auto packed = file_.Read(record.data_at, record.data_size);
    Unpacked chunk = Unpack(record.compression, packed, record.size);
    const bool cut = record.next() > file_.size();
    if (chunk.damaged || (!cut && chunk.bytes.size() != record.size)) {
      throw DataError(
          fmt::format("{}: chunk at {}: is no whole {}", path(), block, record.compression));
    }
    return std::move(chunk.bytes);
  }

  uint64_t first_record() const override { return first_record_; }

 private:
  void RequireVersion(PlacedBytes* bytes) const {
    const std::string_view start = AsText(bytes->Peek(0, kRos1Magic.size()));
    if (start == kRos1Magic) return;
    throw InputFault("bag_version",
                     fmt::format("{}: found '{}', expected #ROSBAG V2.0", path(),
                                 start.substr(0, start.find('\n'))),
                     "bring it to version 2.0 with 'rosbag fix'");
  }

  void EnterChunk(PlacedBytes* bytes, uint64_t at, const Ros1Record& record, Walk* walk) {
    NameForm(record.compression);
    if (record.compression == "none") {
      WalkChunk(bytes, record.data_at, {std::min(record.next(), file_.size())}, walk);
    } else if (CanUnpack(record.compression)) {
      WalkPackedChunk(at, walk);
    } else {
      losses_.Add(kBagDamaged,
                  fmt::format("{}: chunk at {}: found the compression '{}', expected none, lz4 or "
                              "bz2",
                              path(), at, record.compression));
    }
  }

  // Each publisher of a topic has one.
  void AddConnection(PlacedBytes* bytes, Ros1Record* record) {
    if (topics_by_conn_.contains(record->conn) || record->data_size > kMostRecord) return;
    const std::string topic = record->topic;
    SetFields(bytes->Peek(record->data_at, record->data_size), record);
    topics_by_conn_[record->conn] = TopicNumber(
        {topic, record->type, BagEncoding::kRos1, "ros1", 0, std::move(record->definition)});
  }

  // False where the index is not there or not whole.
  bool ReadIndex(const Ros1Record& header) {
    if (header.index_pos < first_record_ || header.index_pos > file_.size()) return false;
    PlacedBytes bytes(file_);
    uint32_t connections = 0, chunks = 0;
    for (uint64_t at = header.index_pos; at < file_.size();) {
      Ros1Record record;
      if (!ReadHeader(&bytes, at, file_.size(), &record) || record.next() > file_.size() ||
          record.data_size > kMostRecord) {
        return false;
      }
      at = record.next();
      if (record.op == kRos1Connection) {
        AddConnection(&bytes, &record);
        ++connections;
      }
      if (record.op != kRos1ChunkInfo) continue;
      ++chunks;
      ByteCursor counts(bytes.Peek(record.data_at, record.data_size));
      for (uint32_t i = 0; i < record.count && counts.ok(); ++i) {
        const auto topic = topics_by_conn_.find(counts.Take<uint32_t>());
        if (topic == topics_by_conn_.end()) return false;
        AddCount(topic->second, counts.Take<uint32_t>(), record.chunk_pos);
      }
      if (!counts.ok()) return false;
    }
    Ros1Record first;
    if (!known_chunks_.empty() &&
        ReadHeader(&bytes, known_chunks_.begin()->first, file_.size(), &first)) {
      NameForm(first.compression);
    }
    return connections == header.conn_count && chunks == header.chunk_count;
  }

  uint64_t first_record_ = 0;
  std::map<uint32_t, uint32_t> topics_by_conn_;
};

}  // namespace

std::unique_ptr<Bag> OpenRos1Bag(const std::string& path) {
  return std::make_unique<Ros1Bag>(path);
}

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

std::unique_ptr<BagWriter> CreateRos1Bag(const std::string& path, const std::string& compression) {
  return std::make_unique<Ros1Writer>(path, compression);
}

}  // namespace slcmap::data
