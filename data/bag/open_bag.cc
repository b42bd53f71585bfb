#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <regex>

#include "data/bag/containers.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetadataName = "metadata.yaml";

enum class BagKind { kNone, kRos1, kMcap, kDb3, kZstd };

BagKind KindByContent(const fs::path& path) {
  constexpr size_t kMagic = 16;
  std::error_code error;
  if (!fs::is_regular_file(path, error) || access(path.c_str(), R_OK) != 0) return BagKind::kNone;
  const auto bytes = PlacedFile(path.string()).Read(0, kMagic);
  const std::string_view start = AsText(bytes);
  if (start.starts_with("#ROSBAG V")) return BagKind::kRos1;
  if (start.starts_with("\x89MCAP")) return BagKind::kMcap;
  if (start.starts_with("SQLite format 3")) return BagKind::kDb3;
  return IsZstdFrame(bytes) ? BagKind::kZstd : BagKind::kNone;
}

// A file that goes away with the bag that is read from it.
class UnpackedFile {
 public:
  UnpackedFile() {
    std::string name = (fs::temp_directory_path() / "slcmap_bag_XXXXXX").string();
    const int descriptor = mkstemp(name.data());
    if (descriptor < 0) throw OutputError(name + ": no temporary file can be made; set TMPDIR");
    close(descriptor);
    path_ = name;
  }
  ~UnpackedFile() {
    std::error_code ignored;
    for (const char* beside : {"", "-wal", "-shm"}) fs::remove(path_ + beside, ignored);
  }
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Of one or more files, each a bag, one after another.
class FilesBag : public Bag {
 public:
  explicit FilesBag(std::string path) : path_(std::move(path)) {}

  void AddFile(const fs::path& file) {
    const BagKind kind = KindByContent(file);
    if (kind != BagKind::kZstd) {
      Adopt(Open(kind, file.string()));
      return;
    }
    const auto& unpacked = unpacked_.emplace_back(std::make_unique<UnpackedFile>());
    if (!UnpackZstdFile(PlacedFile(file.string()), unpacked->path())) {
      losses_.Add(kBagCutOff, file.string() + ": its zstd frame is not whole");
    }
    Adopt(Open(KindByContent(unpacked->path()), unpacked->path(), file.string()));
    form_ += ", zstd by file";
  }

  // What metadata.yaml says of all files together.
  void Expect(int64_t messages) {
    int64_t found = 0;
    for (const BagTopic& topic : topics_) {
      if (topic.messages < 0) return;
      found += topic.messages;
    }
    if (found < messages) {
      losses_.Add(kBagMissing, fmt::format("{}: found {} messages, {} counts {}", path_, found,
                                           kMetadataName, messages));
    }
  }

  // The same of one of several files: the others may be whole.
  void TryAddFile(const fs::path& file) {
    try {
      AddFile(file);
    } catch (const InputFault& fault) {
      losses_.Add(kBagMissing, fault.what());
      fault_ = fault;
    }
  }

  // Throws where no file could be opened.
  void RequireOne() const {
    if (parts_.empty() && fault_) throw *fault_;
  }

  void Miss(const fs::path& file) {
    losses_.Add(kBagMissing, file.string() + ": is not there, or no bag");
  }

  bool empty() const { return parts_.empty(); }

  const std::string& path() const override { return path_; }
  const std::string& form() const override { return form_; }
  const std::vector<BagTopic>& topics() const override { return topics_; }

  void Visit(const std::vector<uint32_t>& topics, size_t head, const Visitor& visit) override {
    bool more = true;
    for (uint32_t i = 0; i < parts_.size() && more; ++i) {
      const Part& part = parts_[i];
      std::vector<uint32_t> chosen;
      for (uint32_t t = 0; t < part.topics.size(); ++t) {
        if (std::ranges::count(topics, part.topics[t]) > 0) chosen.push_back(t);
      }
      if (chosen.empty()) continue;
      part.bag->Visit(chosen, head, [&](BagPlace place, BagBytes bytes) {
        place.file = i;
        place.topic = part.topics[place.topic];
        return more = visit(place, bytes);
      });
    }
  }

  std::vector<std::byte> Read(const BagPlace& place) const override {
    const Part& part = parts_.at(place.file);
    BagPlace there = place;
    there.topic =
        static_cast<uint32_t>(std::ranges::find(part.topics, place.topic) - part.topics.begin());
    return part.bag->Read(there);
  }

  Warnings warnings() const override {
    Warnings all = losses_.warnings();
    for (const Part& part : parts_) all.Merge(part.bag->warnings());
    return all;
  }

 private:
  struct Part {
    std::unique_ptr<Bag> bag;
    std::vector<uint32_t> topics;  // the numbers here of its topics
  };

  static std::unique_ptr<Bag> Open(BagKind kind, const std::string& path,
                                   const std::string& named = "") {
    if (kind == BagKind::kRos1) return OpenRos1Bag(path);
    if (kind == BagKind::kMcap) return OpenMcap(path);
    if (kind == BagKind::kDb3) return OpenDb3(path);
    throw InputFault("no_bag",
                     (named.empty() ? path : named) +
                         ": is no bag, expected a ROS 1 bag, an MCAP file or a rosbag2 database",
                     "name the recording's file, or its folder");
  }

  void Adopt(std::unique_ptr<Bag> bag) {
    Part part{std::move(bag), {}};
    for (const BagTopic& topic : part.bag->topics()) {
      const uint32_t number = FindTopic(topics_, topic);
      part.topics.push_back(number);
      if (number == topics_.size()) {
        topics_.push_back(topic);
      } else {
        int64_t& messages = topics_[number].messages;
        messages = std::min(messages, topic.messages) < 0 ? -1 : messages + topic.messages;
      }
    }
    form_ = part.bag->form();
    parts_.push_back(std::move(part));
  }

  std::string path_, form_;
  std::vector<std::unique_ptr<UnpackedFile>> unpacked_;  // outlive what is read from them
  std::vector<Part> parts_;
  std::vector<BagTopic> topics_;
  BagLosses losses_;
  std::optional<InputFault> fault_;  // of the file that could not be opened last
};

// "walk_2024-05-01-10-00-00_3.bag" is number 3 of "walk": each file of a split bag may have the
// time when it was begun.
struct FileName {
  std::string bag;
  int64_t number = -1;
};

FileName SplitName(const fs::path& path) {
  static const std::regex extension(R"((\.(bag|db3|mcap|active|zstd))+$)");
  static const std::regex number(R"(^(.*)_(\d{1,9})$)");
  static const std::regex time(R"([-_]?\d{4}([-_]\d\d){5}$)");
  FileName name{std::regex_replace(path.filename().string(), extension, "")};
  std::smatch match;
  if (const std::string whole = name.bag; std::regex_match(whole, match, number)) {
    name = {std::regex_replace(match[1].str(), time, ""), std::stoll(match[2].str())};
  }
  return name;
}

// The bags among a folder's files, each with its files by number.
std::map<std::string, std::vector<fs::path>> BagsInFolder(const fs::path& folder) {
  std::map<std::string, std::vector<fs::path>> bags;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const BagKind kind = KindByContent(entry.path());
    const std::string name = entry.path().filename().string();
    const bool packed =
        name.find(".db3.") != std::string::npos || name.find(".mcap.") != std::string::npos;
    if (kind == BagKind::kNone || (kind == BagKind::kZstd && !packed)) continue;
    bags[SplitName(entry.path()).bag].push_back(entry.path());
  }
  for (auto& [name, files] : bags) {
    std::ranges::sort(files, {}, [](const fs::path& file) {
      return std::pair(SplitName(file).number, file.filename().string());
    });
  }
  return bags;
}

struct BagMetadata {
  std::vector<fs::path> files;
  int64_t messages = 0;
};

// What is asked of metadata.yaml has been in all its versions; qualities of service are not.
std::optional<BagMetadata> ReadMetadata(const fs::path& folder) {
  const fs::path path = folder / kMetadataName;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return {};
  try {
    const YAML::Node about = YAML::Load(ReadFile(path.string()))["rosbag2_bagfile_information"];
    if (!about) return {};
    BagMetadata metadata;
    for (const YAML::Node& file : about["relative_file_paths"]) {
      metadata.files.push_back(folder / fs::path(file.as<std::string>()).filename());
    }
    metadata.messages = about["message_count"].as<int64_t>(0);
    return metadata;
  } catch (const YAML::Exception&) {
    return {};  // the files tell all that is needed
  }
}

std::unique_ptr<Bag> OpenFolder(const std::string& path) {
  auto bag = std::make_unique<FilesBag>(path);
  if (const auto metadata = ReadMetadata(path)) {
    for (const fs::path& file : metadata->files) {
      // Recorders that pack files as they go may be killed before they write so.
      const fs::path packed = file.string() + ".zstd";
      const bool there = KindByContent(file) != BagKind::kNone;
      if (there || KindByContent(packed) != BagKind::kNone) {
        bag->TryAddFile(there ? file : packed);
      } else {
        bag->Miss(file);
      }
    }
    bag->RequireOne();
    if (!bag->empty()) {
      bag->Expect(metadata->messages);
      return bag;
    }
  }
  const auto bags = BagsInFolder(path);
  if (bags.size() != 1) {
    std::string names;
    for (const auto& [name, files] : bags) {
      names += (names.empty() ? "" : ", ") + files.front().filename().string();
    }
    throw InputFault(
        bags.empty() ? "no_bag" : "several_bags",
        fmt::format("{}: found {}, expected one bag", path, bags.empty() ? "no bag" : names),
        bags.empty() ? "name the folder that the recorder made" : "name one of the files");
  }
  for (const fs::path& file : bags.begin()->second) bag->TryAddFile(file);
  bag->RequireOne();
  return bag;
}

}  // namespace

std::string Ros2TypeName(const std::string& type) {
  const size_t slash = type.find('/');
  if (slash == std::string::npos || type.find('/', slash + 1) != std::string::npos) return type;
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

std::string PlainTypeName(std::string type) {
  const size_t middle = type.find("/msg/");
  if (middle != std::string::npos) type.erase(middle, 4);
  return type;
}

bool IsBag(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    return ReadMetadata(path).has_value() || !BagsInFolder(path).empty();
  }
  const BagKind kind = KindByContent(path);
  if (kind != BagKind::kZstd) return kind != BagKind::kNone;
  return path.find(".db3.") != std::string::npos || path.find(".mcap.") != std::string::npos;
}

std::unique_ptr<Bag> OpenBag(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return OpenFolder(path);
  if (!fs::exists(path, error)) throw DataError(path + ": is not there, expected a bag");
  auto bag = std::make_unique<FilesBag>(path);
  bag->AddFile(path);
  return bag;
}

std::unique_ptr<BagWriter> CreateBag(const std::string& path, const BagPacking& packing) {
  if (packing.form == "bag") return CreateRos1Bag(path, packing.compression);
  if (packing.form == "mcap") return CreateMcap(path, packing.compression);
  if (packing.form == "db3") return CreateDb3(path, packing.compression);
  throw ConfigError(
      fmt::format("{}: found the form '{}', expected bag, db3 or mcap", path, packing.form));
}

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
