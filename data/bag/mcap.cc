#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <algorithm>
#include <map>

#include "data/bag/containers.h"
#include "data/bag/messages.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};

enum McapOp : uint8_t {
  kMcapHeader = 0x01,
  kMcapFooter = 0x02,
  kMcapSchema = 0x03,
  kMcapChannel = 0x04,
  kMcapMessage = 0x05,
  kMcapChunk = 0x06,
  kMcapMessageIndex = 0x07,
  kMcapChunkIndex = 0x08,
  kMcapStatistics = 0x0b,
  kMcapSummaryOffset = 0x0e,
  kMcapDataEnd = 0x0f
};

uint32_t Crc32(std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

constexpr uint64_t kRecordHead = 9;               // an opcode and a length
constexpr uint64_t kMessageHead = 2 + 4 + 8 + 8;  // channel, sequence, log time, publish time
constexpr uint64_t kFooterSize = 8 + 8 + 4;

struct McapRecord {
  uint8_t op = 0;
  uint64_t at = 0, size = 0;  // of its content
  uint64_t next() const { return at + size; }
};

bool ReadRecordHead(PlacedBytes* bytes, uint64_t at, uint64_t end, McapRecord* record) {
  ByteCursor cursor(bytes->Peek(at, kRecordHead));
  record->op = cursor.Take<uint8_t>();
  record->size = cursor.Take<uint64_t>();
  record->at = at + kRecordHead;
  return cursor.ok() && record->at <= end && record->size < UINT64_MAX - record->at;
}

struct McapChunk {
  uint64_t size = 0;  // unpacked
  uint32_t crc = 0;   // 0: none
  std::string compression;
  uint64_t at = 0, packed_size = 0;
};

bool ReadChunkHead(PlacedBytes* bytes, const McapRecord& record, McapChunk* chunk) {
  constexpr size_t kMostHead = 128;
  ByteCursor cursor(bytes->Peek(record.at, kMostHead));
  cursor.Take(16);  // its first and last time
  chunk->size = cursor.Take<uint64_t>();
  chunk->crc = cursor.Take<uint32_t>();
  chunk->compression = cursor.TakeText();
  chunk->packed_size = cursor.Take<uint64_t>();
  chunk->at = record.at + 16 + 8 + 4 + 4 + chunk->compression.size() + 8;
  return cursor.ok() && chunk->packed_size <= record.next() - chunk->at &&
         chunk->at <= record.next();
}

class McapBag : public ChunkedBag {
 public:
  explicit McapBag(const std::string& path) : ChunkedBag(path) {
    form_ = "MCAP";
    PlacedBytes bytes(file_);
    if (AsText(bytes.Peek(0, kMcapMagic.size())) != kMcapMagic) {
      throw InputFault("bag_version", path + ": found another version of MCAP, expected 0",
                       "convert it with the program that wrote it");
    }
    if (ReadSummary(&bytes)) return;
    Forget();
    Scan();
    if (!ended_) SayUnfinished();
  }

 protected:
  bool WalkRecord(PlacedBytes* bytes, uint64_t* at, const Extent& extent, Walk* walk) override {
    McapRecord record;
    if (!ReadRecordHead(bytes, *at, extent.end, &record)) return false;
    const bool whole = record.next() <= extent.end;
    if (record.op == kMcapChunk && !extent.in_chunk) {
      if (!EnterChunk(bytes, *at, record, walk)) return false;
    } else if (record.op == kMcapMessage && whole) {
      if (!GiveMessage(bytes, record, extent, walk)) return false;
    } else if (whole && (record.op == kMcapSchema || record.op == kMcapChannel)) {
      if (!AddTopicRecord(bytes, record)) return false;
    } else if (record.op == kMcapDataEnd && whole && !extent.in_chunk) {
      stop_ = ended_ = true;  // what follows repeats and indexes
    }
    if (whole) *at = record.next();
    return whole;
  }

  std::vector<std::byte> LoadChunk(uint64_t block) const override {
    PlacedBytes bytes(file_);
    McapRecord record;
    McapChunk chunk;
    const auto fail = [&](const std::string& what) {
      throw DataError(fmt::format("{}: chunk at {}: {}", path(), block, what));
    };
    if (!ReadRecordHead(&bytes, block, file_.size(), &record) ||
        !ReadChunkHead(&bytes, record, &chunk) || chunk.size > kMostChunk ||
        chunk.packed_size > kMostChunk) {
      fail("is none");
    }
    auto packed = file_.Read(chunk.at, chunk.packed_size);
    Unpacked unpacked = chunk.compression.empty() ? Unpacked{std::move(packed)}
                                                  : Unpack(chunk.compression, packed, chunk.size);
    const bool whole = unpacked.bytes.size() == chunk.size;
    if (unpacked.damaged || (!whole && record.next() <= file_.size())) {
      fail("cannot be unpacked");
    }
    if (whole && chunk.crc != 0 && Crc32(AsText(unpacked.bytes)) != chunk.crc) {
      fail("its checksum is wrong");
    }
    return std::move(unpacked.bytes);
  }

  uint64_t first_record() const override { return kMcapMagic.size(); }

 private:
  bool EnterChunk(PlacedBytes* bytes, uint64_t at, const McapRecord& record, Walk* walk) {
    McapChunk chunk;
    if (!ReadChunkHead(bytes, record, &chunk)) return false;
    NameForm(chunk.compression.empty() ? "none" : chunk.compression);
    const uint64_t end = std::min(chunk.at + chunk.packed_size, file_.size());
    const bool checked = chunk.crc != 0 && chunk.packed_size <= kMostChunk;
    if (chunk.compression.empty() && (walk->head > 0 || !checked)) {
      // Reading a message checks its chunk.
      Extent extent{end};
      if (checked) extent = {end, at, chunk.at};
      WalkChunk(bytes, chunk.at, extent, walk);
    } else if (chunk.compression.empty() || CanUnpack(chunk.compression)) {
      WalkPackedChunk(at, walk);
    } else {
      losses_.Add(kBagDamaged,
                  fmt::format("{}: chunk at {}: found the compression '{}', expected lz4 or zstd",
                              path(), at, chunk.compression));
    }
    return true;
  }

  bool GiveMessage(PlacedBytes* bytes, const McapRecord& record, const Extent& extent, Walk* walk) {
    ByteCursor cursor(bytes->Peek(record.at, kMessageHead));
    const auto topic = topics_by_channel_.find(cursor.Take<uint16_t>());
    cursor.Take<uint32_t>();  // sequence
    const auto received_ns = static_cast<int64_t>(cursor.Take<uint64_t>());
    return cursor.ok() && record.size >= kMessageHead && topic != topics_by_channel_.end() &&
           Give(bytes, record.at + kMessageHead, record.size - kMessageHead, extent,
                {topic->second, received_ns}, walk);
  }

  // A schema or a channel. Both come again, in chunks and at the end.
  bool AddTopicRecord(PlacedBytes* bytes, const McapRecord& record) {
    if (record.size > kMostRecord) return false;
    ByteCursor cursor(bytes->Peek(record.at, record.size));
    const auto id = cursor.Take<uint16_t>();
    if (record.op == kMcapSchema) {
      const std::string name = cursor.TakeText();
      cursor.TakeText();  // how it is written
      if (cursor.ok()) schemas_[id] = {PlainTypeName(name), cursor.TakeText()};
      return cursor.ok();
    }
    const auto schema = schemas_.find(cursor.Take<uint16_t>());
    const std::string name = cursor.TakeText(), encoding = cursor.TakeText();
    if (!cursor.ok() || topics_by_channel_.contains(id)) return cursor.ok();
    BagTopic topic{name, "", BagEncoding::kOther, encoding};
    if (encoding == "cdr") topic.encoding = BagEncoding::kCdr;
    if (encoding == "ros1") topic.encoding = BagEncoding::kRos1;
    if (schema != schemas_.end()) {
      std::tie(topic.type, topic.definition) = schema->second;
    }
    topics_by_channel_[id] = TopicNumber(topic);
    return true;
  }

  // False where there is no whole summary, or one that does not tell the topics.
  bool ReadSummary(PlacedBytes* bytes) {
    const uint64_t tail = kRecordHead + kFooterSize + kMcapMagic.size();
    if (file_.size() < first_record() + tail) return false;
    const uint64_t footer_at = file_.size() - tail;
    ByteCursor footer(bytes->Peek(footer_at, tail));
    const auto op = footer.Take<uint8_t>();
    const auto size = footer.Take<uint64_t>();
    const auto start = footer.Take<uint64_t>();
    footer.Take<uint64_t>();  // where its offsets begin
    const auto crc = footer.Take<uint32_t>();
    if (op != kMcapFooter || size != kFooterSize || AsText(footer.rest()) != kMcapMagic ||
        start < first_record() || start >= footer_at || footer_at - start > kMostChunk) {
      return false;
    }
    const auto summary = file_.Read(start, footer_at + kRecordHead + 16 - start);
    if (crc != 0 && Crc32(AsText(summary)) != crc) return false;
    PlacedBytes records(summary);
    bool counted = false;
    for (uint64_t at = 0; at + kRecordHead + 16 < summary.size();) {
      McapRecord record;
      if (!ReadRecordHead(&records, at, summary.size(), &record) ||
          record.next() > summary.size() || !ReadSummaryRecord(&records, record, &counted)) {
        return false;
      }
      at = record.next();
    }
    if (known_chunks_.empty()) NameForm("unchunked");
    return counted;
  }

  bool ReadSummaryRecord(PlacedBytes* records, const McapRecord& record, bool* counted) {
    if (record.op == kMcapSchema || record.op == kMcapChannel) {
      return AddTopicRecord(records, record);
    }
    ByteCursor cursor(records->Peek(record.at, record.size));
    if (record.op == kMcapChunkIndex) {
      cursor.Take(16);  // its first and last time
      const auto chunk = cursor.Take<uint64_t>();
      cursor.Take<uint64_t>();  // its size
      known_chunks_[chunk];
      const bool ok = ReadCounts(cursor.TakeSized(),
                                 [&](uint32_t topic, uint64_t) { AddCount(topic, 0, chunk); });
      cursor.Take<uint64_t>();  // the size of its message indexes
      const std::string compression = cursor.TakeText();
      NameForm(compression.empty() ? "none" : compression);
      return ok && cursor.ok();
    }
    if (record.op != kMcapStatistics) return true;
    uint64_t left = cursor.Take<uint64_t>();
    cursor.Take(2 + 4 + 4 + 4 + 4 + 8 + 8);  // counts of other kinds, times
    const bool ok = ReadCounts(cursor.TakeSized(), [&](uint32_t topic, uint64_t count) {
      AddCount(topic, count, {});
      left -= count;
    });
    *counted = ok && left == 0;  // else they are not counted by channel
    return ok && cursor.ok();
  }

  // Numbers by channel: of messages, or where their index is. False where a channel is not known.
  template <typename Take>
  bool ReadCounts(BagBytes bytes, const Take& take) {
    ByteCursor cursor(bytes);
    while (cursor.ok() && !cursor.rest().empty()) {
      const auto topic = topics_by_channel_.find(cursor.Take<uint16_t>());
      const auto number = cursor.Take<uint64_t>();
      if (topic == topics_by_channel_.end()) return false;
      take(topic->second, number);
    }
    return cursor.ok();
  }

  bool ended_ = false;
  std::map<uint16_t, std::pair<std::string, std::string>> schemas_;  // name and text
  std::map<uint16_t, uint32_t> topics_by_channel_;
};

}  // namespace

std::unique_ptr<Bag> OpenMcap(const std::string& path) { return std::make_unique<McapBag>(path); }

namespace {

void AppendText(std::string_view text, std::string* bytes) {
  AppendBytes(static_cast<uint32_t>(text.size()), bytes);
  bytes->append(text);
}

void AppendRecord(McapOp op, std::string_view content, std::string* bytes) {
  AppendBytes(static_cast<uint8_t>(op), bytes);
  AppendBytes(uint64_t{content.size()}, bytes);
  bytes->append(content);
}

class McapWriter : public BagWriter {
 public:
  McapWriter(const std::string& path, const std::string& compression)
      : compression_(compression == "none" ? "" : compression),
        chunked_(compression != "unchunked"),
        file_(path) {
    std::string header;
    AppendText("", &header);  // profile: its topics tell
    AppendText("slcmap", &header);
    std::string bytes(kMcapMagic);
    AppendRecord(kMcapHeader, header, &bytes);
    Put(bytes);
  }

  uint32_t AddTopic(const BagTopic& topic) override {
    const auto number = static_cast<uint32_t>(topics_.size());
    const bool cdr = topic.encoding == BagEncoding::kCdr;
    const bool ros1 = topic.encoding == BagEncoding::kRos1;
    const std::string known = DefinitionFor(topic.type, topic.encoding).text;
    const std::string encoding = cdr ? "cdr" : ros1 ? "ros1" : topic.encoding_name;
    std::string schema, channel;
    AppendBytes(static_cast<uint16_t>(number + 1), &schema);  // 0: none
    AppendText(cdr ? Ros2TypeName(topic.type) : topic.type, &schema);
    AppendText(cdr ? "ros2msg" : ros1 ? "ros1msg" : encoding, &schema);
    AppendText(known.empty() ? topic.definition : known, &schema);
    AppendBytes(static_cast<uint16_t>(number), &channel);
    AppendBytes(static_cast<uint16_t>(number + 1), &channel);
    AppendText(topic.name, &channel);
    AppendText(encoding, &channel);
    AppendText("", &channel);  // what else is known of it
    Topic& added = topics_.emplace_back();
    AppendRecord(kMcapSchema, schema, &added.records);
    AppendRecord(kMcapChannel, channel, &added.records);
    return number;
  }

  void Write(uint32_t number, int64_t received_ns, BagBytes message) override {
    Topic& topic = topics_.at(number);
    const auto time_ns = static_cast<uint64_t>(received_ns);
    if (chunk_.empty()) chunk_times_ = {};
    if (topic.messages == 0) chunk_ += topic.records;
    AppendBytes(time_ns, &topic.index);
    AppendBytes(uint64_t{chunk_.size()}, &topic.index);
    AppendBytes(kMcapMessage, &chunk_);
    AppendBytes(uint64_t{2 + 4 + 8 + 8 + message.size()}, &chunk_);
    AppendBytes(static_cast<uint16_t>(number), &chunk_);
    AppendBytes(static_cast<uint32_t>(topic.messages++), &chunk_);
    AppendBytes(time_ns, &chunk_);
    AppendBytes(time_ns, &chunk_);
    chunk_.append(AsText(message));
    chunk_times_.Add(time_ns);
    times_.Add(time_ns);
    if (chunk_.size() < kChunkSize) return;
    FinishChunk();
  }

  void Close() override {
    FinishChunk();
    std::string end, no_crc;
    AppendBytes(uint32_t{0}, &no_crc);
    AppendRecord(kMcapDataEnd, no_crc, &end);
    Put(end);
    std::string summary;
    for (const Topic& topic : topics_) summary += topic.records;
    AppendRecord(kMcapStatistics, Statistics(), &summary);
    summary += chunk_indexes_;
    AppendBytes(kMcapFooter, &summary);
    const uint64_t footer_size = 8 + 8 + 4;
    AppendBytes(footer_size, &summary);
    AppendBytes(at_, &summary);
    AppendBytes(uint64_t{0}, &summary);  // no offsets of the summary's parts
    AppendBytes(Crc32(summary), &summary);
    Put(summary.append(kMcapMagic));
    file_.Close();
  }

 private:
  struct Topic {
    std::string records;  // schema and channel
    std::string index;    // of its messages in the chunk
    uint64_t messages = 0;
  };

  struct Times {
    uint64_t first_ns = UINT64_MAX, last_ns = 0;
    void Add(uint64_t time_ns) {
      first_ns = std::min(first_ns, time_ns);
      last_ns = std::max(last_ns, time_ns);
    }
    void AppendTo(std::string* bytes) const {
      AppendBytes(std::min(first_ns, last_ns), bytes);
      AppendBytes(last_ns, bytes);
    }
  };

  void Put(const std::string& bytes) {
    file_.Add(bytes);
    at_ += bytes.size();
  }

  void FinishChunk() {
    if (chunk_.empty()) return;
    if (!chunked_) {
      Put(chunk_);
      for (Topic& topic : topics_) topic.index.clear();
    } else {
      PutChunk();
    }
    chunk_.clear();
  }

  void PutChunk() {
    const uint64_t chunk_at = at_;
    const std::string packed = compression_.empty() ? chunk_ : Pack(compression_, chunk_);
    std::string content, record;
    chunk_times_.AppendTo(&content);
    AppendBytes(uint64_t{chunk_.size()}, &content);
    AppendBytes(Crc32(chunk_), &content);
    AppendText(compression_, &content);
    AppendBytes(uint64_t{packed.size()}, &content);
    AppendRecord(kMcapChunk, content + packed, &record);
    Put(record);
    const uint64_t chunk_size = record.size(), indexes_at = at_;
    const std::string offsets = PutIndexes();
    std::string index;
    chunk_times_.AppendTo(&index);
    AppendBytes(chunk_at, &index);
    AppendBytes(chunk_size, &index);
    AppendText(offsets, &index);
    AppendBytes(at_ - indexes_at, &index);
    AppendText(compression_, &index);
    AppendBytes(uint64_t{packed.size()}, &index);
    AppendBytes(uint64_t{chunk_.size()}, &index);
    AppendRecord(kMcapChunkIndex, index, &chunk_indexes_);
    ++chunks_;
  }

  // Where the messages of each topic lie in the chunk; returns where that is said of each.
  std::string PutIndexes() {
    std::string offsets;
    for (size_t i = 0; i < topics_.size(); ++i) {
      if (topics_[i].index.empty()) continue;
      AppendBytes(static_cast<uint16_t>(i), &offsets);
      AppendBytes(at_, &offsets);
      std::string content, record;
      AppendBytes(static_cast<uint16_t>(i), &content);
      AppendText(topics_[i].index, &content);
      AppendRecord(kMcapMessageIndex, content, &record);
      Put(record);
      topics_[i].index.clear();
    }
    return offsets;
  }

  std::string Statistics() const {
    uint64_t messages = 0;
    std::string counts, content;
    for (size_t i = 0; i < topics_.size(); ++i) {
      messages += topics_[i].messages;
      AppendBytes(static_cast<uint16_t>(i), &counts);
      AppendBytes(topics_[i].messages, &counts);
    }
    AppendBytes(messages, &content);
    AppendBytes(static_cast<uint16_t>(topics_.size()), &content);
    AppendBytes(static_cast<uint32_t>(topics_.size()), &content);
    AppendBytes(uint64_t{0}, &content);  // neither attachments nor metadata
    AppendBytes(chunks_, &content);
    times_.AppendTo(&content);
    AppendText(counts, &content);
    return content;
  }

  std::string compression_;
  bool chunked_ = true;
  FileWriter file_;
  uint64_t at_ = 0;
  std::vector<Topic> topics_;
  std::string chunk_, chunk_indexes_;
  Times chunk_times_, times_;
  uint32_t chunks_ = 0;
};

}  // namespace

std::unique_ptr<BagWriter> CreateMcap(const std::string& path, const std::string& compression) {
  return std::make_unique<McapWriter>(path, compression);
}

}  // namespace slcmap::data
