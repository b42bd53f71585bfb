#include <spdlog/fmt/fmt.h>

#include "data/bag/containers.h"

namespace slcmap::inline data {
namespace {

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

}  // namespace slcmap::data
