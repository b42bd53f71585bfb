#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <exception>

#include "data/bag/containers.h"

namespace slcmap::inline data {

namespace {
// Offset of a message that is read where it lies in the file: its block is its place there.
constexpr uint32_t kDirect = UINT32_MAX;
}  // namespace

uint32_t FindTopic(const std::vector<BagTopic>& topics, const BagTopic& topic) {
  const auto found = std::ranges::find_if(topics, [&](const BagTopic& known) {
    return known.name == topic.name && known.type == topic.type &&
           known.encoding_name == topic.encoding_name;
  });
  return static_cast<uint32_t>(found - topics.begin());
}

void ChunkedBag::Visit(const std::vector<uint32_t>& topics, size_t head, const Visitor& visit) {
  // What the visitor throws is no damage of the bag.
  std::exception_ptr thrown;
  const Visitor guarded = [&](const BagPlace& place, BagBytes message) {
    try {
      return visit(place, message);
    } catch (...) {
      thrown = std::current_exception();
      return false;
    }
  };
  Walk walk{std::vector<bool>(topics_.size() + 1), head, guarded};
  for (const uint32_t topic : topics) walk.chosen.at(topic) = true;
  WalkFile(&walk);
  if (thrown) std::rethrow_exception(thrown);
}

void ChunkedBag::WalkFile(Walk* walk) {
  PlacedBytes bytes(file_);
  stop_ = false;
  uint64_t at = first_record();
  const auto next_chunk = [&](uint64_t from) {
    const auto next = known_chunks_.lower_bound(from);
    return next == known_chunks_.end() ? file_.size() : next->first;
  };
  while (!stop_ && at < file_.size()) {
    if (chunks_tell_all_) at = next_chunk(at);
    if (at >= file_.size()) return;
    const uint64_t from = at;
    if (WalkRecord(&bytes, &at, {file_.size()}, walk)) continue;
    at = next_chunk(from + 1);
    losses_.Add(at == file_.size() ? kBagCutOff : kBagDamaged,
                fmt::format("{}: bytes {} to {}", path(), from, at));
  }
}

void ChunkedBag::WalkPackedChunk(uint64_t block, Walk* walk) {
  const auto known = known_chunks_.find(block);
  if (known != known_chunks_.end() && !known->second.empty() && !walk->chosen.empty() &&
      std::ranges::none_of(known->second, [&](uint32_t t) { return walk->chosen[t]; })) {
    return;
  }
  try {
    const auto chunk = cache_.Get(block, [&] { return LoadChunk(block); });
    PlacedBytes bytes(*chunk);
    WalkChunk(&bytes, 0, {chunk->size(), block}, walk);
  } catch (const DataError& error) {
    losses_.Add(kBagDamaged, error.what());
  }
}

void ChunkedBag::WalkChunk(PlacedBytes* bytes, uint64_t at, Extent extent, Walk* walk) {
  extent.in_chunk = true;
  while (!stop_ && at < extent.end) {
    if (WalkRecord(bytes, &at, extent, walk)) continue;
    if (!extent.block && extent.end == file_.size()) return;  // cut off, as WalkFile says
    losses_.Add(
        kBagDamaged,
        fmt::format("{}: byte {} of {}", path(), at,
                    extent.block ? fmt::format("the chunk at {}", *extent.block) : "the file"));
    return;
  }
}

void ChunkedBag::Scan() {
  const Visitor count = [&](const BagPlace& place, BagBytes) {
    ++topics_[place.topic].messages;
    return true;
  };
  Walk walk{{}, 1, count};
  WalkFile(&walk);
}

bool ChunkedBag::Give(PlacedBytes* bytes, uint64_t at, uint64_t size, const Extent& extent,
                      BagPlace place, Walk* walk) {
  if (size > extent.end - at) return false;
  if (!walk->chosen.empty() && (place.topic >= walk->chosen.size() || !walk->chosen[place.topic])) {
    return true;
  }
  if (size > kMostChunk) return false;
  place.block = extent.block.value_or(at);
  place.offset = extent.block ? static_cast<uint32_t>(at - extent.base) : kDirect;
  place.size = static_cast<uint32_t>(size);
  const bool part = bytes->in_file() && walk->head > 0;
  const BagBytes message = bytes->Peek(at, part ? std::min<uint64_t>(size, walk->head) : size);
  if (topics_[place.topic].encoding != BagEncoding::kCdr || !IsZstdFrame(message)) {
    stop_ = !walk->visit(place, message);
    return true;
  }
  std::vector<std::byte> unpacked;
  try {
    unpacked = UnpackZstdMessage(bytes->Peek(at, size));
  } catch (const DataError& error) {
    losses_.Add(kBagDamaged, fmt::format("{}: message at {}: {}", path(), at, error.what()));
    return true;
  }
  stop_ = !walk->visit(place, unpacked);
  return true;
}

std::vector<std::byte> ChunkedBag::Read(const BagPlace& place) const {
  std::vector<std::byte> message;
  if (place.offset == kDirect) {
    message = file_.Read(place.block, place.size);
  } else {
    const auto chunk = cache_.Get(place.block, [&] { return LoadChunk(place.block); });
    const BagBytes rest = BagBytes(*chunk).subspan(std::min<size_t>(place.offset, chunk->size()));
    const BagBytes bytes = rest.first(std::min<size_t>(place.size, rest.size()));
    message.assign(bytes.begin(), bytes.end());
  }
  if (message.size() != place.size) {
    throw DataError(fmt::format("{}: message at {}: found {} bytes, expected {}", path(),
                                place.block, message.size(), place.size));
  }
  const bool packed = topics_.at(place.topic).encoding == BagEncoding::kCdr && IsZstdFrame(message);
  return packed ? UnpackZstdMessage(message) : message;
}

uint32_t ChunkedBag::TopicNumber(const BagTopic& topic) {
  const uint32_t number = FindTopic(topics_, topic);
  if (number == topics_.size()) {
    topics_.push_back(topic);
    topics_.back().messages = 0;
  }
  return number;
}

void ChunkedBag::AddCount(uint32_t topic, uint64_t messages, std::optional<uint64_t> chunk) {
  topics_[topic].messages += static_cast<int64_t>(messages);
  if (chunk) known_chunks_[*chunk].push_back(topic);
}

void ChunkedBag::NameForm(const std::string& compression) {
  if (form_.find(',') == std::string::npos) form_ += ", " + compression;
}

void ChunkedBag::SayUnfinished() {
  if (losses_.warnings().Count(kBagCutOff) > 0) return;
  losses_.Add(kBagCutOff, path() + ": was not closed, what was written last may be missing");
}

void ChunkedBag::Forget() {
  known_chunks_.clear();
  for (BagTopic& topic : topics_) topic.messages = 0;
}

}  // namespace slcmap::data
