// Bags that were cut off or that lie: what is whole is read, and nothing crashes.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "tests/data/bag/made_bag.h"

namespace slcmap {
namespace {

using testing::BagCase;
using testing::BagMessage;
using testing::TempFolder;

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
