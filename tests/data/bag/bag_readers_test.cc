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

// Why a reader is not here; "" where it is.
std::string MissingReader(const std::string& form) {
  const bool is_here = form == "bag"    ? HasRosbag()
                       : form == "mcap" ? HasMcapReader()
                                        : testing::HasProgram(kPython);
  return is_here ? "" : "a reader of " + form + " is not here: tests/install_readers.sh";
}

// rosbag, MCAP's own reader and SQLite, by the form of bags.
class BagReader : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (!MissingReader(GetParam()).empty()) GTEST_SKIP() << MissingReader(GetParam());
  }
  const std::string reader_ = GetParam() == "mcap" ? "node" : kPython;
};

TEST_P(BagReader, ListsOurBags) {
  for (const BagCase& how : testing::kBagCases) {
    if (how.form != GetParam()) continue;
    const TempFolder folder;
    const std::string path =
        testing::MakeBag(folder, how, testing::MadeMessages(how.encoding, 8, 64));
    const bool decode =
        GetParam() == "mcap" ? how.encoding == BagEncoding::kCdr : GetParam() == "bag";
    EXPECT_EQ(TheirRows(reader_, testing::BagFile(path, how)), OurRows(path, decode))
        << how.form << " " << how.compression;
    if (how.compression == std::string("none") && GetParam() == "db3") break;
  }
}

// What others recorded, of a form.
std::vector<std::string> GenuineBags(const std::string& form) {
  std::vector<std::string> bags;
  const std::string shared = testing::SharedData("bags");
  if (shared.empty()) return bags;
  for (const auto& entry : fs::recursive_directory_iterator(shared)) {
    // Messages of one are packed by themselves, which its own reader does not undo.
    const bool packed = entry.path().filename().string().find("msgzstd") != std::string::npos;
    if (entry.path().extension() == "." + form && !packed) bags.push_back(entry.path().string());
  }
  std::ranges::sort(bags);
  return bags;
}

TEST_P(BagReader, ListsGenuineBagsAsWeDo) {
  const auto bags = GenuineBags(GetParam());
  if (bags.empty()) GTEST_SKIP() << "no bags of others are here";
  for (const std::string& bag : bags) {
    EXPECT_EQ(OurRows(bag, GetParam() != "db3"), TheirRows(reader_, bag)) << bag;
  }
}

INSTANTIATE_TEST_SUITE_P(All, BagReader, ::testing::Values("bag", "mcap", "db3"),
                         [](const auto& form) { return form.param; });

}  // namespace
}  // namespace slcmap
