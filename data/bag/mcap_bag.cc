#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include "data/bag/containers.h"
#include "data/bag/mcap.h"

namespace slcmap::inline data {
namespace {

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

uint32_t Crc32(std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::unique_ptr<Bag> OpenMcap(const std::string& path) { return std::make_unique<McapBag>(path); }

}  // namespace slcmap::data
