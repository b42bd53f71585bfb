#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "data/bag/containers.h"
#include "data/bag/mcap.h"
#include "data/bag/messages.h"
#include "data/io/file.h"

namespace slcmap::inline data {
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
  RequirePacking(path, compression, {"none", "lz4", "zstd", "unchunked"});
  return std::make_unique<McapWriter>(path, compression);
}

}  // namespace slcmap::data
