// A bag: messages of many topics in one file or folder, as ROS 1 (.bag), rosbag2 (.db3) and MCAP
// keep them. Told by content, read with bounded memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline data {

// The kinds that are counted, the last two by what decodes messages.
inline constexpr const char* kBagCutOff = "bags_cut_off";
inline constexpr const char* kBagDamaged = "bag_parts_damaged";
inline constexpr const char* kBagMissing = "bags_with_messages_missing";
inline constexpr const char* kMessageUnreadable = "messages_that_cannot_be_decoded";
inline constexpr const char* kMessageTwice = "messages_in_two_files_of_a_bag";

// How the bytes of a topic's messages are laid out.
enum class BagEncoding { kRos1, kCdr, kOther };

struct BagTopic {
  std::string name;  // such as "/cam0/image_raw"
  std::string type;  // "sensor_msgs/Image", without ROS 2's "/msg/"
  BagEncoding encoding = BagEncoding::kOther;
  std::string encoding_name;  // as the bag has it, for messages
  int64_t messages = -1;      // as the bag's index has it; -1 where it has none
  // The type's definition, as the bag has it. Of types that messages.h knows bags that are written
  // take that from there.
  std::string definition = {};
};

// Where a message lies: what the numbers mean is the container's affair.
struct BagPlace {
  uint32_t topic = 0;       // index into Bag::topics()
  int64_t received_ns = 0;  // when it was written down; the sensor's time is in the message
  uint64_t block = 0;       // file offset, chunk or row
  uint32_t file = 0;        // of several that make a bag
  uint32_t offset = 0;      // in an unpacked chunk
  uint32_t size = 0;        // bytes of the message, packed where each is packed by itself
};

using BagBytes = std::span<const std::byte>;

class Bag {
 public:
  virtual ~Bag() = default;

  virtual const std::string& path() const = 0;
  virtual const std::string& form() const = 0;  // such as "ROS 1 bag, lz4"
  virtual const std::vector<BagTopic>& topics() const = 0;

  // Gives each message of the chosen topics once, in the order in which they were written; the
  // bytes are valid during the call. Of an unpacked message at least its first `head` bytes are
  // given, perhaps no more (0: all). `visit` returns false to stop. What is damaged is counted in
  // warnings() and passed over.
  using Visitor = std::function<bool(const BagPlace&, BagBytes)>;
  virtual void Visit(const std::vector<uint32_t>& topics, size_t head, const Visitor& visit) = 0;

  // The bytes of a message that Visit gave. Safe to call from several threads. Throws DataError
  // where they are no longer there.
  virtual std::vector<std::byte> Read(const BagPlace& place) const = 0;

  // What was lost: a file that was cut off, chunks whose checksum is wrong, rows that are missing.
  virtual Warnings warnings() const = 0;
};

// Whether a file or folder is a bag, by its first bytes (or its files').
bool IsBag(const std::string& path);

// Throws InputFault, with a remedy, for what is no bag, or one that is encrypted, or of a version
// or compression that is not known.
std::unique_ptr<Bag> OpenBag(const std::string& path);

// Writes a bag. Messages are given in the order in which they are to lie.
class BagWriter {
 public:
  virtual ~BagWriter() = default;
  virtual uint32_t AddTopic(const BagTopic& topic) = 0;  // the number that Write takes
  virtual void Write(uint32_t topic, int64_t received_ns, BagBytes message) = 0;
  virtual void Close() = 0;  // writes the indexes; throws OutputError
};

// How a bag is packed.
struct BagPacking {
  std::string form = "mcap";  // "bag", "db3" (a folder) or "mcap"
  // bag: "none", "lz4", "bz2"; db3: "none", "zstd" (each message); mcap: "none", "lz4", "zstd",
  // "unchunked".
  std::string compression = "none";
};

// Throws ConfigError for another form, OutputError where nothing can be written.
std::unique_ptr<BagWriter> CreateBag(const std::string& path, const BagPacking& packing);

}  // namespace slcmap::data
