// Bags that were cut off or that lie: what is whole is read, and nothing crashes.
#include "data/bag/bag.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <thread>

#include "data/bag/bytes.h"
#include "tests/data/bag/made_bag.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using testing::BagCase;
using testing::BagMessage;
using testing::MessageOf;
using testing::TempFolder;

class BagForms : public ::testing::TestWithParam<BagCase> {};

TEST_P(BagForms, MessagesComeBackInTheirOrderWhateverAVisitorDoes) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(GetParam().encoding, 8, 64);
  const std::string path = testing::MakeBag(folder, GetParam(), written);
  EXPECT_TRUE(IsBag(path));
  const auto bag = OpenBag(path);
  EXPECT_EQ(bag->path(), path);
  ASSERT_EQ(bag->topics().size(), 5u);
  for (const BagTopic& topic : bag->topics()) {
    EXPECT_EQ(topic.encoding, GetParam().encoding);
    EXPECT_EQ(topic.messages, std::ranges::count(written, topic.name, &BagMessage::topic));
    EXPECT_EQ(topic.type == "sensor_msgs/Imu", topic.name == "/imu0");
  }
  const auto fail = [](const BagPlace&, BagBytes) -> bool { throw DataError("of the visitor"); };
  EXPECT_THROW(bag->Visit(testing::AllTopics(*bag), 0, fail), DataError);
  for (int time = 0; time < 2; ++time) {
    int seen = 0;
    bag->Visit(testing::AllTopics(*bag), 0, [&](const BagPlace&, BagBytes) { return ++seen < 7; });
    EXPECT_EQ(seen, 7);
  }
  EXPECT_EQ(testing::ReadMessages(bag.get()), written);
  EXPECT_TRUE(bag->warnings().entries().empty());
  const TempFolder other;
  const auto empty = OpenBag(testing::MakeBag(other, GetParam(), {}));
  EXPECT_TRUE(testing::ReadMessages(empty.get()).empty());
  EXPECT_TRUE(empty->warnings().entries().empty());
}

TEST_P(BagForms, HeadsOfChosenTopicsThenWholeMessagesByPlace) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(GetParam().encoding, 8, 64);
  const auto bag = OpenBag(testing::MakeBag(folder, GetParam(), written));
  const auto& topics = bag->topics();
  const auto right = std::ranges::find(topics, "/cam1/image_raw", &BagTopic::name);
  std::vector<BagMessage> images;
  std::ranges::copy_if(written, std::back_inserter(images),
                       [](const BagMessage& m) { return m.topic == "/cam1/image_raw"; });
  std::vector<BagPlace> places;
  bag->Visit(
      {static_cast<uint32_t>(right - topics.begin())}, 100,
      [&](const BagPlace& place, BagBytes bytes) {
        EXPECT_GE(bytes.size(), 100u);
        EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), images.at(places.size()).bytes.begin()));
        places.push_back(place);
        return true;
      });
  ASSERT_EQ(places.size(), images.size());
  const auto read = [&](size_t first) {
    for (size_t i = first; i < places.size(); i += 2) {
      EXPECT_EQ(bag->Read(places[i]), images[i].bytes);
    }
  };
  std::thread other(read, 1);
  read(0);
  other.join();
}

INSTANTIATE_TEST_SUITE_P(All, BagForms, ::testing::ValuesIn(testing::kBagCases),
                         [](const auto& how) {
                           return std::string(how.param.form) + "_" + how.param.compression;
                         });

TEST(Bag, FilesOfASplitBagAreOne) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(BagEncoding::kRos1, 6, 64);
  const auto topics = testing::MadeTopics(BagEncoding::kRos1);
  const size_t half = written.size() / 2;
  const auto write = [&](const char* name, size_t from, size_t to) {
    const std::vector<BagMessage> part(written.begin() + static_cast<std::ptrdiff_t>(from),
                                       written.begin() + static_cast<std::ptrdiff_t>(to));
    testing::WriteBag(CreateBag(folder.Path(name), {"bag", "lz4"}).get(), topics, part);
  };
  write("walk_2024-05-01-10-00-00_9.bag", 0, half);
  write("walk_2024-05-01-10-05-00_10.bag", half, written.size());
  EXPECT_TRUE(IsBag(folder.Path()));
  EXPECT_EQ(testing::ReadMessages(OpenBag(folder.Path()).get()), written);

  write("other.bag", 0, half);
  const std::string error = MessageOf<InputFault>([&] { OpenBag(folder.Path()); });
  EXPECT_NE(error.find("other.bag, walk_2024"), std::string::npos) << error;
}

TEST(Bag, ADatabaseNeedsNoMetadata) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(BagEncoding::kCdr, 6, 64);
  const BagCase how{"db3", "none", BagEncoding::kCdr};
  const std::string path = testing::MakeBag(folder, how, written);
  EXPECT_EQ(testing::ReadMessages(OpenBag(testing::BagFile(path, how)).get()), written);
  fs::remove(path + "/metadata.yaml");
  EXPECT_TRUE(IsBag(path));
  EXPECT_EQ(testing::ReadMessages(OpenBag(path).get()), written);
}

TEST(Bag, MetadataThatCountsMoreIsSaid) {
  const TempFolder folder;
  const std::string path = testing::MakeBag(folder, {"db3", "none", BagEncoding::kCdr},
                                            testing::MadeMessages(BagEncoding::kCdr, 1, 64));
  std::string metadata = testing::ReadText(path + "/metadata.yaml");
  metadata.replace(metadata.find("message_count: 14"), 17, "message_count: 99");
  folder.Write("walk/metadata.yaml", metadata);
  const Warnings warnings = OpenBag(path)->warnings();
  EXPECT_EQ(warnings.Count("bags_with_messages_missing"), 1);
}

TEST(Bag, FilesMayBePackedAsAWhole) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(BagEncoding::kCdr, 3, 64);
  const std::string path =
      testing::MakeBag(folder, {"db3", "zstd_file", BagEncoding::kCdr}, written);
  EXPECT_FALSE(fs::exists(path + "/walk_0.db3"));
  EXPECT_EQ(testing::ReadMessages(OpenBag(path + "/walk_0.db3.zstd").get()), written);
  const std::string mcap = testing::MakeBag(folder, {"mcap", "lz4", BagEncoding::kCdr}, written);
  testing::PackWhole(mcap);
  EXPECT_TRUE(IsBag(mcap + ".zstd"));
  const auto bag = OpenBag(mcap + ".zstd");
  EXPECT_EQ(testing::ReadMessages(bag.get()), written);
  EXPECT_EQ(bag->form(), "MCAP, lz4, zstd by file");
}

TEST(Bag, EncryptedBagsAndOthersAreRefusedByName) {
  const TempFolder folder;
  const std::string path = testing::MakeBag(folder, {"bag", "none", BagEncoding::kRos1},
                                            testing::MadeMessages(BagEncoding::kRos1, 1, 64));
  std::string bytes = testing::ReadText(path);
  // The field behind the header's own, as much shorter as its filling is.
  const std::string field = "encryptor=rosbag/AesCbcEncryptor";
  std::string header = bytes.substr(17, 69);
  header += std::string{static_cast<char>(field.size()), 0, 0, 0} + field;
  const auto size = static_cast<char>(header.size());
  const std::string rest(4096 - 8 - header.size(), ' ');
  std::string record = std::string{size, 0, 0, 0} + header;
  record +=
      std::string{static_cast<char>(rest.size() & 255), static_cast<char>(rest.size() >> 8), 0, 0} +
      rest;
  bytes.replace(13, 4096, record);
  const std::string encrypted = folder.Write("encrypted.bag", bytes);
  const auto open = [](const std::string& file) {
    return MessageOf<InputFault>([&] { OpenBag(file); });
  };
  EXPECT_NE(open(encrypted).find("AesCbcEncryptor"), std::string::npos) << open(encrypted);
  EXPECT_NE(open(folder.Write("old.bag", "#ROSBAG V1.2\n")).find("V1.2"), std::string::npos);
  EXPECT_NE(open(folder.Write("no.bag", "no bag at all")).find("is no bag"), std::string::npos);
  EXPECT_NE(open(folder.Write("no.db3", "SQLite format 3")).find("SQLite says"), std::string::npos);
  EXPECT_FALSE(IsBag(folder.Path("no.bag")));
  EXPECT_THROW(CreateBag(folder.Path("x.bag"), {"tar", "none"}), ConfigError);
}

TEST(Bag, AWrongChecksumIsSaidAndTheOtherChunksRead) {
  const auto written = testing::MadeMessages(BagEncoding::kCdr, 30, 200);
  for (const char* compression : {"none", "zstd"}) {
    const TempFolder folder;
    const BagCase how{"mcap", compression, BagEncoding::kCdr};
    const std::string path = testing::MakeBag(folder, how, written);
    std::string bytes = testing::ReadText(path);
    bytes[100'000] = static_cast<char>(bytes[100'000] ^ 1);
    folder.Write("walk.mcap", bytes);
    const auto bag = OpenBag(path);
    const auto read = testing::ReadMessages(bag.get());
    EXPECT_GT(read.size(), written.size() / 4);
    EXPECT_LT(read.size(), written.size());
    EXPECT_EQ(bag->warnings().Count("bag_parts_damaged"), 1);
    EXPECT_EQ(read.back(), written.back());
  }
}

class BagDamage : public ::testing::TestWithParam<BagCase> {
 protected:
  BagDamage() { spdlog::set_level(spdlog::level::off); }
  ~BagDamage() override { spdlog::set_level(spdlog::level::info); }
};

// Each file as if it were cut by a full disk, or a recorder that was killed.
TEST_P(BagDamage, WhatIsWholeIsReadOfAFileThatIsCutOff) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(GetParam().encoding, 16, 200);
  const std::string path =
      testing::BagFile(testing::MakeBag(folder, GetParam(), written), GetParam());
  const std::string whole = testing::ReadText(path);
  // Where the messages end that lie in the file as they are.
  std::vector<uint64_t> ends;
  const bool placed =
      GetParam().compression == std::string("unchunked") ||
      (GetParam().form == std::string("bag") && GetParam().compression == std::string("none"));
  const auto bag = OpenBag(path);
  bag->Visit(testing::AllTopics(*bag), 1, [&](const BagPlace& place, BagBytes) {
    ends.push_back(place.block + place.size);
    return true;
  });
  std::mt19937_64 random(1);
  size_t most = 0;
  for (int i = 0; i < 30; ++i) {
    const size_t size = random() % whole.size();
    const std::string cut = folder.Write(
        "cut/walk" + std::filesystem::path(path).extension().string(), whole.substr(0, size));
    std::vector<BagMessage> read;
    try {
      const auto opened = OpenBag(cut);
      read = testing::ReadMessages(opened.get());
      EXPECT_FALSE(opened->warnings().entries().empty()) << size;
    } catch (const DataError&) {
      EXPECT_TRUE(size < 5000 || GetParam().form == std::string("db3")) << size;
    }
    ASSERT_LE(read.size(), written.size());
    if (GetParam().form != std::string("db3")) {
      EXPECT_TRUE(std::equal(read.begin(), read.end(), written.begin())) << size;
    }
    if (placed) {
      EXPECT_EQ(read.size(), std::ranges::count_if(ends, [&](uint64_t e) { return e <= size; }))
          << size;
    }
    most = std::max(most, read.size());
  }
  EXPECT_GT(most, written.size() / 4);
}

TEST_P(BagDamage, MutationsDoNotCrash) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(GetParam().encoding, 3, 40);
  const std::string path =
      testing::BagFile(testing::MakeBag(folder, GetParam(), written), GetParam());
  const std::string whole = testing::ReadText(path);
  std::mt19937_64 random(2);
  int refused = 0, damaged = 0;
  for (int i = 0; i < 200; ++i) {
    std::string bytes = whole;
    for (uint64_t k = random() % 4 + 1; k > 0; --k) {
      // Lengths and indexes stand at both ends.
      size_t at = random() % bytes.size();
      if (random() % 2 == 0) at = random() % 2 == 0 ? at % 6000 : bytes.size() - 1 - at % 3000;
      at = std::min(at, bytes.size() - 1);
      bytes[at] = static_cast<char>(random() % 3 == 0 ? 0xff : random());
    }
    const std::string name = "bad/walk" + std::filesystem::path(path).extension().string();
    const std::string bad = folder.Write(name, bytes);
    try {
      const auto bag = OpenBag(bad);
      bag->Visit(testing::AllTopics(*bag), i % 2 == 0 ? 0 : 64,
                 [&](const BagPlace& place, BagBytes part) {
                   try {
                     bag->Read(place);
                     DecodeMessage<RosImage>(GetParam().encoding, part);
                   } catch (const Error&) {
                   }
                   return true;
                 });
      if (!bag->warnings().entries().empty()) ++damaged;
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused + damaged, 10);
  EXPECT_LT(refused, 200);
}

// What it is of cannot be told, so neither can what else is in its chunk.
TEST(Ros1Bag, ARecordThatNamesNoKindIsDamage) {
  const auto* how = std::ranges::find_if(testing::kBagCases, [](const BagCase& bag) {
    return bag.form == std::string("bag") && bag.compression == std::string("none");
  });
  const TempFolder folder;
  const auto written = testing::MadeMessages(how->encoding, 3, 40);
  std::string bytes =
      testing::ReadText(testing::BagFile(testing::MakeBag(folder, *how, written), *how));
  constexpr char kMessage[] = "op=\x02";
  const size_t at = bytes.find(kMessage, bytes.find(kMessage) + 1);
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'x';
  const auto bag = OpenBag(folder.Write("bad/walk.bag", bytes));
  EXPECT_LT(testing::ReadMessages(bag.get()).size(), written.size());
  EXPECT_GT(bag->warnings().Count(kBagDamaged), 0);
}

INSTANTIATE_TEST_SUITE_P(All, BagDamage, ::testing::ValuesIn(testing::kBagCases),
                         [](const auto& how) {
                           return std::string(how.param.form) + "_" + how.param.compression;
                         });

}  // namespace
}  // namespace slcmap
