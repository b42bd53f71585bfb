// The kinds of bags, a file each; and what the kinds with chunks share.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "data/bag/bytes.h"

namespace slcmap::inline data {

// Of one file each. They throw InputFault for files that are not of their kind or not readable.
std::unique_ptr<Bag> OpenRos1Bag(const std::string& path);
std::unique_ptr<Bag> OpenMcap(const std::string& path);
std::unique_ptr<Bag> OpenDb3(const std::string& path);

inline constexpr int64_t kSecond_ns = 1'000'000'000;

// Bytes in a chunk that is written, as rosbag has it.
inline constexpr size_t kChunkSize = 768 * 1024;

// `compression` as BagPacking has it.
std::unique_ptr<BagWriter> CreateRos1Bag(const std::string& path, const std::string& compression);
std::unique_ptr<BagWriter> CreateMcap(const std::string& path, const std::string& compression);
std::unique_ptr<BagWriter> CreateDb3(const std::string& path, const std::string& compression);

// "sensor_msgs/msg/Image" is ROS 2's name of "sensor_msgs/Image".
std::string Ros2TypeName(const std::string& type);
std::string PlainTypeName(std::string type);

// The first topic of the same name, type and layout; their number where there is none.
uint32_t FindTopic(const std::vector<BagTopic>& topics, const BagTopic& topic);

// Warnings of a file, each place once however often it is visited.
class BagLosses {
 public:
  void Add(const std::string& kind, const std::string& place) {
    if (places_.insert(place).second) warnings_.Add(kind, place);
  }
  const Warnings& warnings() const { return warnings_; }

 private:
  Warnings warnings_;
  std::set<std::string> places_;
};

// A file of records, of which some are chunks of records. Records outside of chunks, and in chunks
// that are not packed, are found and read where they lie.
class ChunkedBag : public Bag {
 public:
  const std::string& path() const override { return file_.path(); }
  const std::string& form() const override { return form_; }
  const std::vector<BagTopic>& topics() const override { return topics_; }
  Warnings warnings() const override { return losses_.warnings(); }
  void Visit(const std::vector<uint32_t>& topics, size_t head, const Visitor& visit) override;
  std::vector<std::byte> Read(const BagPlace& place) const override;

 protected:
  static constexpr uint64_t kMostChunk = 1 << 30;   // bytes unpacked; recorders take some MB
  static constexpr uint64_t kMostRecord = 1 << 26;  // bytes that describe a topic

  // What a walk over the records is for: messages of the chosen topics (empty: all).
  struct Walk {
    std::vector<bool> chosen;
    size_t head = 0;
    const Visitor& visit;
  };
  // Where records lie: in the file, or in the chunk that begins at `block` and whose records begin
  // at `base`.
  struct Extent {
    uint64_t end = 0;
    std::optional<uint64_t> block = {};
    uint64_t base = 0;
    bool in_chunk = false;  // chunks hold no chunks
  };

  explicit ChunkedBag(const std::string& path) : file_(path) {}

  // Reads the record at a place and moves on; false where there is no whole one.
  virtual bool WalkRecord(PlacedBytes* bytes, uint64_t* at, const Extent& extent, Walk* walk) = 0;
  // The records of the chunk that begins at a place, those that are there of one that is cut off.
  // Throws DataError where it is damaged.
  virtual std::vector<std::byte> LoadChunk(uint64_t block) const = 0;
  virtual uint64_t first_record() const = 0;

  void WalkFile(Walk* walk);
  // The records of a chunk, unpacked or as they lie in the file.
  void WalkPackedChunk(uint64_t block, Walk* walk);
  void WalkChunk(PlacedBytes* bytes, uint64_t at, Extent extent, Walk* walk);
  // Finds the topics and counts their messages where there is no index.
  void Scan();
  // Gives a message to the visitor if it is chosen; false where it is cut off.
  bool Give(PlacedBytes* bytes, uint64_t at, uint64_t size, const Extent& extent, BagPlace place,
            Walk* walk);
  // Of a topic of the same name, type and layout; a new one where there is none.
  uint32_t TopicNumber(const BagTopic& topic);
  // As an index says.
  void AddCount(uint32_t topic, uint64_t messages, std::optional<uint64_t> chunk);
  void SayUnfinished();
  void NameForm(const std::string& compression);  // that of the first chunk
  void Forget();                                  // what an index said that is not whole

  PlacedFile file_;
  std::string form_;
  std::vector<BagTopic> topics_;
  std::map<uint64_t, std::vector<uint32_t>> known_chunks_;  // with the topics in each
  bool chunks_tell_all_ = false;                            // no messages lie outside of these
  BagLosses losses_;
  bool stop_ = false;  // the visitor has had enough, or no records are to come

 private:
  mutable ChunkCache cache_;
};

}  // namespace slcmap::data
