// Readers by others list what we write, and bags by others, as we do.
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "tests/data/bag/made_bag.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using testing::BagCase;
using testing::TempFolder;

// A row a topic, as the readers print them.
using BagRows = std::multiset<std::string>;

// Sums of what is in messages that the readers decode as well.
std::optional<double> BagNumber(const BagTopic& topic, BagBytes bytes) {
  double sum = 0;
  if (topic.type == RosImu::kType) {
    const auto imu = DecodeMessage<RosImu>(topic.encoding, bytes);
    for (const double a : imu.linear_acceleration_m_s2) sum += a;
  } else if (topic.type == RosImage::kType) {
    const auto image = DecodeMessage<RosImage>(topic.encoding, bytes);
    sum = image.width_px * image.height_px;
    for (const std::byte b : image.data.bytes) sum += std::to_integer<int>(b);
  } else if (topic.type == RosCameraInfo::kType) {
    for (const double k : DecodeMessage<RosCameraInfo>(topic.encoding, bytes).k) sum += k;
  } else if (topic.type == RosTransforms::kType || topic.type == "tf/tfMessage") {
    const auto tf = DecodeMessage<RosTransforms>(topic.encoding, bytes);
    for (const auto& transform : tf.transforms) sum += transform.transform.translation_m[0];
  } else {
    return std::nullopt;
  }
  return sum;
}

BagRows OurRows(const std::string& path, bool decode) {
  struct Row {
    int64_t messages = 0;
    uint64_t check = 0;
    std::optional<double> number;
  };
  const auto bag = OpenBag(path);
  std::vector<Row> rows(bag->topics().size());
  bag->Visit(testing::AllTopics(*bag), 0, [&](const BagPlace& place, BagBytes bytes) {
    Row& row = rows[place.topic];
    ++row.messages;
    row.check +=
        crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size()));
    if (!decode) return true;
    const auto number = BagNumber(bag->topics()[place.topic], bytes);
    if (number) row.number = row.number.value_or(0) + *number;
    return true;
  });
  BagRows texts;
  for (size_t t = 0; t < rows.size(); ++t) {
    const BagTopic& topic = bag->topics()[t];
    EXPECT_EQ(topic.messages, rows[t].messages) << path << " " << topic.name;
    texts.insert(fmt::format("{} {} {} {} {}", topic.name, topic.type, rows[t].messages,
                             rows[t].check,
                             rows[t].number ? fmt::format("{:.6f}", *rows[t].number) : "-"));
  }
  return texts;
}

BagRows TheirRows(const std::string& reader, const std::string& path) {
  std::istringstream output(
      testing::OutputOf(reader + " " + (SLCMAP_SOURCE_DIR "/tests/readers/") +
                        (reader == "node" ? "read_mcap.mjs " : "read_bag.py ") + path));
  BagRows rows;
  for (std::string row; std::getline(output, row);) rows.insert(row);
  return rows;
}

constexpr const char* kPython = "/usr/bin/python3";

bool HasRosbag() {
  return std::system("/usr/bin/python3 -c 'import rosbag, tf2_msgs' >/dev/null 2>&1") == 0;
}
bool HasMcapReader() {
  return fs::exists(SLCMAP_SOURCE_DIR "/tests/readers/node_modules/@mcap/core") &&
         testing::HasProgram("node");
}

#define SLCMAP_NEEDS_BAG_READER(is_here, name) \
  if (!(is_here)) GTEST_SKIP() << name " is not here: tests/install_readers.sh"

void ExpectOthersReadOurs(const char* form, const char* reader) {
  for (const BagCase& how : testing::kBagCases) {
    if (how.form != std::string(form)) continue;
    const TempFolder folder;
    const std::string path =
        testing::MakeBag(folder, how, testing::MadeMessages(how.encoding, 30, 200));
    const bool decode = reader == std::string("node") ? how.encoding == BagEncoding::kCdr
                                                      : form == std::string("bag");
    EXPECT_EQ(TheirRows(reader, testing::BagFile(path, how)), OurRows(path, decode))
        << how.form << " " << how.compression;
    if (how.compression == std::string("none") && form == std::string("db3")) break;
  }
}

TEST(BagReaders, RosbagReadsOurBags) {
  SLCMAP_NEEDS_BAG_READER(HasRosbag(), "python3-rosbag");
  ExpectOthersReadOurs("bag", kPython);
}

TEST(BagReaders, McapsOwnReaderReadsOurs) {
  SLCMAP_NEEDS_BAG_READER(HasMcapReader(), "@mcap/core");
  ExpectOthersReadOurs("mcap", "node");
}

TEST(BagReaders, SqliteReadsOurDatabases) {
  SLCMAP_NEEDS_BAG_READER(testing::HasProgram(kPython), "python3");
  ExpectOthersReadOurs("db3", kPython);
}

// What others recorded, of a kind.
std::vector<std::string> GenuineBags(const std::string& extension) {
  std::vector<std::string> bags;
  const std::string shared = testing::SharedData("bags");
  if (shared.empty()) return bags;
  for (const auto& entry : fs::recursive_directory_iterator(shared)) {
    // Messages of one are packed by themselves, which its own reader does not undo.
    const bool packed = entry.path().filename().string().find("msgzstd") != std::string::npos;
    if (entry.path().extension() == extension && !packed) bags.push_back(entry.path().string());
  }
  std::ranges::sort(bags);
  return bags;
}

void ExpectSameRows(const std::string& extension, const char* reader, bool decode) {
  const auto bags = GenuineBags(extension);
  if (bags.empty()) GTEST_SKIP() << "no bags of others are here";
  for (const std::string& bag : bags) {
    EXPECT_EQ(OurRows(bag, decode), TheirRows(reader, bag)) << bag;
  }
}

TEST(BagReaders, GenuineBagsAsRosbagListsThem) {
  SLCMAP_NEEDS_BAG_READER(HasRosbag(), "python3-rosbag");
  ExpectSameRows(".bag", kPython, true);
}

TEST(BagReaders, GenuineMcapAsItsOwnReaderListsIt) {
  SLCMAP_NEEDS_BAG_READER(HasMcapReader(), "@mcap/core");
  ExpectSameRows(".mcap", "node", true);
}

TEST(BagReaders, GenuineDatabasesAsSqliteListsThem) {
  SLCMAP_NEEDS_BAG_READER(testing::HasProgram(kPython), "python3");
  ExpectSameRows(".db3", kPython, false);
}

TEST(BagReaders, GenuineFoldersAreWhole) {
  const std::string shared = testing::SharedData("bags/rosbag2_py_resources");
  if (shared.empty()) GTEST_SKIP() << "no bags of others are here";
  for (const char* storage : {"mcap", "sqlite3"}) {
    for (const auto& [name, messages] :
         {std::pair{"wbag", 6074}, {"talker", 20}, {"reindex_test_bags/multiple_files", 3177}}) {
      const auto bag = OpenBag(shared + "/" + storage + "/" + name);
      EXPECT_EQ(testing::ReadMessages(bag.get()).size(), static_cast<size_t>(messages));
      EXPECT_TRUE(bag->warnings().entries().empty());
    }
  }
}

TEST(BagReaders, AGenuineImageOfWhichTheMessageIsPacked) {
  const std::string path = testing::SharedData("bags/amber_soccer_goal_12_msgzstd.mcap");
  if (path.empty()) GTEST_SKIP() << "no bags of others are here";
  const auto bag = OpenBag(path);
  int images = 0;
  bag->Visit(testing::AllTopics(*bag), 256, [&](const BagPlace& place, BagBytes bytes) {
    const auto image = DecodeMessage<RosImage>(bag->topics()[place.topic].encoding, bytes);
    EXPECT_EQ(image.data.written, image.step_bytes * image.height_px);
    EXPECT_EQ(bag->Read(place).size(), bytes.size());
    ++images;
    return true;
  });
  EXPECT_EQ(images, 2);
}

}  // namespace
}  // namespace slcmap
