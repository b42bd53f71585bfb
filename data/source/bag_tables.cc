#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <list>
#include <map>
#include <mutex>
#include <numeric>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <unordered_map>

#include "data/bag/bytes.h"
#include "data/bag/messages.h"
#include "data/core/error.h"
#include "data/io/image.h"
#include "data/rig/bag_calibration.h"
#include "data/rig/topics.h"
#include "data/source/recording_tables.h"
#include "data/source/sequence.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

// Of each message, where it is not packed: a sample of an IMU whole, of an image what it is.
constexpr size_t kHead = 4096;

// Images by the last three parts of their paths, as "cam0/data/1403636579763555584.png": the bag
// itself may be named in several ways.
class BagImages : public ImageStore {
 public:
  struct Image {
    BagPlace place;
    cv::Size size;  // in pixels; empty of files, which tell it themselves
  };

  BagImages(std::unique_ptr<Bag> bag, std::string state)
      : bag_(std::move(bag)), state_(std::move(state)) {}

  Bag* bag() { return bag_.get(); }

  // Adds an image of a camera and returns its name.
  std::string Add(int camera, int64_t stamp_ns, const std::string& extension, const Image& image) {
    const std::string stem = fmt::format("cam{}/data/{}", camera, stamp_ns);
    std::string name = stem + extension;
    for (int i = 2; !images_.try_emplace(name, image).second; ++i) {
      name = fmt::format("{}_{}{}", stem, i, extension);
    }
    return name;
  }

  bool Has(const std::string& path) const override { return Find(path) != nullptr; }

  KeptImage Read(const std::string& path) const override {
    const Image* const image = Find(path);
    if (image == nullptr) return {"", {}, kImageMissing};
    const BagTopic& topic = bag_->topics()[image->place.topic];
    try {
      const std::vector<std::byte> message = bag_->Read(image->place);
      if (topic.type == RosCompressedImage::kType) {
        const auto file = DecodeMessage<RosCompressedImage>(topic.encoding, message);
        return {std::string(AsText(file.data.bytes)), {}, nullptr};
      }
      const auto grey = GreyFrom(DecodeMessage<RosImage>(topic.encoding, message));
      if (grey) return {"", *grey, nullptr};
    } catch (const DataError&) {  // the bag was changed
      return {"", {}, kImageMissing};
    }
    return {"", {}, kImageUndecodable};
  }

  const char* FindProblem(const std::string& path, const cv::Size& size) const override {
    const Image* const image = Find(path);
    if (image == nullptr) return kImageMissing;
    if (!image->size.empty()) {
      return size.empty() || size == image->size ? nullptr : kImageWrongSize;
    }
    const KeptImage kept = Read(path);
    return kept.problem != nullptr ? kept.problem : FindProblemOfBytes(kept.bytes, size);
  }

  bool IsSame(const std::string& a, const std::string& b) const override {
    const KeptImage one = Read(a), other = Read(b);
    if (one.problem != nullptr || other.problem != nullptr) return false;
    if (one.pixels.empty() || other.pixels.empty()) {
      return one.pixels.empty() == other.pixels.empty() && one.bytes == other.bytes;
    }
    return one.pixels.size() == other.pixels.size() && one.pixels.type() == other.pixels.type() &&
           cv::norm(one.pixels, other.pixels, cv::NORM_INF) == 0;
  }

  std::string State(const std::string& path) const override { return Has(path) ? state_ : ""; }

 private:
  const Image* Find(const std::string& path) const {
    size_t from = path.size();
    for (int part = 0; part < 3 && from != std::string::npos && from > 0; ++part) {
      from = path.rfind('/', from - 1);
    }
    const auto image =
        images_.find(from == std::string::npos || from == 0 ? path : path.substr(from + 1));
    return image == images_.end() ? nullptr : &image->second;
  }

  std::unique_ptr<Bag> bag_;
  std::string state_;
  std::unordered_map<std::string, Image> images_;
};

// What a bag holds of a rig: its images by their names, and the samples of its IMU.
struct BagListing {
  std::string form;
  RecordingTopics topics;
  std::vector<std::vector<ImageFile>> images;  // by camera
  std::vector<ImuRow> imu;
  std::shared_ptr<BagImages> store;
  Warnings warnings;
};

[[noreturn]] void FailEncoding(const std::string& topic, const std::string& encoding) {
  throw InputFault("bag_images",
                   fmt::format("{}: found images as '{}', expected grey or colour: mono8, mono16, "
                               "bgr8, rgb8, bgra8, rgba8, bayer, yuv422, JPEG or PNG",
                               topic, encoding),
                   "choose other topics with --topics, or decode the stream before");
}

// Lists the messages of the chosen topics as they come.
class BagReader {
 public:
  explicit BagReader(BagListing* listing)
      : listing_(*listing), topics_(listing->topics), image_topics_(topics_.Images()) {}

  void ReadAll() {
    Bag* const bag = listing_.store->bag();
    std::vector<uint32_t> chosen;
    for (uint32_t i = 0; i < bag->topics().size(); ++i) {
      const BagTopic& topic = bag->topics()[i];
      if (IsOfCamera(topic) || IsOfImu(topic)) chosen.push_back(i);
    }
    uint32_t file = 0;
    bag->Visit(chosen, kHead, [&](const BagPlace& place, BagBytes head) {
      if (place.file != file) LeaveOutTwins();
      file = place.file;
      Add(bag->topics()[place.topic], place, head);
      return true;
    });
    LeaveOutTwins();
    listing_.warnings.Merge(bag->warnings());
    for (size_t i = 0; i < listing_.images.size(); ++i) {
      const auto unknown = unknown_.find(image_topics_[i]);
      if (unknown != unknown_.end() && unknown->second.second >= listing_.images[i].size()) {
        FailEncoding(unknown->first, unknown->second.first);
      }
    }
  }

 private:
  bool IsOfCamera(const BagTopic& topic) const {
    return IsImageTopic(topic) && std::ranges::count(image_topics_, topic.name) > 0;
  }
  bool IsOfImu(const BagTopic& topic) const {
    return IsImuTopic(topic) && (topic.name == topics_.gyro || topic.name == topics_.accel);
  }

  void Add(const BagTopic& topic, const BagPlace& place, BagBytes head) {
    try {
      if (topic.type == RosImage::kType) {
        AddPixels(topic, place, head);
      } else if (topic.type == RosCompressedImage::kType) {
        AddFile(topic, place, head);
      } else {
        AddSample(topic, place, head);
      }
    } catch (const InputFault&) {
      throw;
    } catch (const DataError& error) {
      listing_.warnings.Add(kMessageUnreadable,
                            fmt::format("{}: {}: {}", Path(), topic.name, error.what()));
    }
  }

  // Of the file that has been read, what stands in those before as well: they may overlap.
  void LeaveOutTwins() {
    const auto of_image = [](const ImageFile& image) { return std::pair(image.stamp_ns, false); };
    const auto of_sample = [](const ImuRow& row) {
      return std::pair(row.stamp_ns, row.angular_velocity_rad_s.hasNaN());
    };
    before_.resize(listing_.images.size() + 1);
    for (size_t i = 0; i < listing_.images.size(); ++i) {
      EraseTwins(of_image, &listing_.images[i], &before_[i]);
    }
    EraseTwins(of_sample, &listing_.imu, &before_.back());
  }

  template <typename Key, typename Row>
  void EraseTwins(const Key& key, std::vector<Row>* rows, size_t* before) {
    const auto first = rows->begin() + static_cast<std::ptrdiff_t>(*before);
    int64_t earliest_ns = std::numeric_limits<int64_t>::max();
    for (auto row = first; row != rows->end(); ++row) {
      earliest_ns = std::min(earliest_ns, row->stamp_ns);
    }
    std::set<std::pair<int64_t, bool>> known;
    for (auto row = rows->begin(); row != first; ++row) {
      if (row->stamp_ns >= earliest_ns) known.insert(key(*row));
    }
    const auto twins = std::ranges::remove_if(
        first, rows->end(), [&](const Row& row) { return known.contains(key(row)); });
    for (size_t i = 0; i < twins.size(); ++i) listing_.warnings.Add(kMessageTwice, Path());
    rows->erase(twins.begin(), twins.end());
    *before = rows->size();
  }

  const std::string& Path() const { return listing_.store->bag()->path(); }

  void AddPixels(const BagTopic& topic, const BagPlace& place, BagBytes head) {
    const auto image = DecodeMessage<RosImage>(topic.encoding, head);
    const std::optional<size_t> needed = PixelBytes(image);
    if (!needed) LeaveOut(topic, image.encoding);
    const size_t before = head.size() - image.data.bytes.size();
    const size_t there = head.size() < place.size
                             ? std::min<size_t>(image.data.written, place.size - before)
                             : image.data.bytes.size();
    const cv::Size size(static_cast<int>(image.width_px), static_cast<int>(image.height_px));
    if (size.empty() || there < *needed) throw DataError("fewer pixels than its size says");
    AddImage(topic, image.stamp_ns, ".png", {place, size});
  }

  void AddFile(const BagTopic& topic, const BagPlace& place, BagBytes head) {
    const auto image = DecodeMessage<RosCompressedImage>(topic.encoding, head);
    const std::string extension = ExtensionFor(AsText(image.data.bytes));
    if (extension.empty()) LeaveOut(topic, image.format);
    AddImage(topic, image.stamp_ns, extension, {place, {}});
  }

  // An image alone; where half of a camera's are so, the topic is refused.
  [[noreturn]] void LeaveOut(const BagTopic& topic, const std::string& encoding) {
    ++unknown_.try_emplace(topic.name, encoding, 0).first->second.second;
    throw DataError(fmt::format("an image as '{}'", encoding));
  }

  void AddImage(const BagTopic& topic, int64_t stamp_ns, const std::string& extension,
                const BagImages::Image& image) {
    const auto camera =
        static_cast<int>(std::ranges::find(image_topics_, topic.name) - image_topics_.begin());
    listing_.images[static_cast<size_t>(camera)].push_back(
        {stamp_ns, listing_.store->Add(camera, stamp_ns, extension, image)});
  }

  void AddSample(const BagTopic& topic, const BagPlace& place, BagBytes head) {
    std::vector<std::byte> whole;
    if (head.size() < place.size) {
      whole = listing_.store->bag()->Read(place);
      head = whole;
    }
    const auto imu = DecodeMessage<RosImu>(topic.encoding, head);
    ImuRow row;
    row.stamp_ns = imu.stamp_ns;
    row.number = static_cast<int>(listing_.imu.size()) + 1;
    row.is_whole = topics_.gyro == topics_.accel;
    const auto half = [](bool has, const std::array<double, 3>& values) -> Eigen::Vector3d {
      if (has) return Eigen::Vector3d(values.data());
      return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    };
    row.angular_velocity_rad_s = half(topic.name == topics_.gyro, imu.angular_velocity_rad_s);
    row.specific_force_m_s2 = half(topic.name == topics_.accel, imu.linear_acceleration_m_s2);
    listing_.imu.push_back(row);
  }

  BagListing& listing_;
  const RecordingTopics& topics_;
  const std::vector<std::string> image_topics_;                    // by camera
  std::map<std::string, std::pair<std::string, size_t>> unknown_;  // encoding, count; by topic
  std::vector<size_t> before_;  // rows of earlier files: images by camera, then the IMU
};

std::shared_ptr<const BagListing> ListBag(const std::string& path, const std::string& said,
                                          const std::string& state) {
  const auto listing = std::make_shared<BagListing>();
  const RecordingTopics wanted = ParseTopics(said);
  listing->store = std::make_shared<BagImages>(OpenBag(path), state);
  Bag* const bag = listing->store->bag();
  listing->form = bag->form();
  listing->topics = ChooseTopics(bag, wanted, false);
  spdlog::info("{}: {}, read as {}", path, bag->form(), TopicsText(listing->topics));
  for (const std::string& reason : listing->topics.reasons) spdlog::info("{}", reason);
  listing->images.resize(listing->topics.Images().size());
  BagReader(listing.get()).ReadAll();
  return listing;
}

// Those that were listed last: the stages of a run open the same bag one after another, and one
// that is packed is read whole for its list. Without `lists`, nullptr of one that is not known.
std::shared_ptr<const BagListing> KnownListing(const std::string& path, const std::string& said,
                                               bool lists = true) {
  constexpr size_t kMostKept = 2;  // as two recordings are compared or merged
  struct Known {
    std::string key, said;
    std::shared_ptr<const BagListing> listing;
  };
  static std::mutex mutex;
  static std::list<Known> known;
  const std::string state = DescribeBag(path);
  const std::string key = fs::weakly_canonical(path).string() + '\n' + state;
  const std::lock_guard lock(mutex);
  for (auto it = known.begin(); it != known.end(); ++it) {
    if (it->key != key) continue;
    if (it->said != said && TopicsText(it->listing->topics) != said) continue;
    known.splice(known.begin(), known, it);
    return known.front().listing;
  }
  if (!lists) return nullptr;
  known.push_front({key, said, ListBag(path, said, state)});
  if (known.size() > kMostKept) known.pop_back();
  return known.front().listing;
}

class BagTables : public RecordingTables {
 public:
  BagTables(std::string path, std::shared_ptr<const BagListing> listing)
      : path_(std::move(path)), listing_(std::move(listing)) {}

  const std::string& place() const override { return path_; }
  std::string form() const override { return listing_->form; }
  SharedImageStore images() const override { return listing_->store; }
  std::string topics() const override { return TopicsText(listing_->topics); }

  std::vector<int> cameras() const override {
    std::vector<int> cameras(listing_->topics.Images().size());
    std::iota(cameras.begin(), cameras.end(), 0);
    return cameras;
  }

  std::string NameTable(const std::string& sensor) const override {
    const RecordingTopics& topics = listing_->topics;
    const std::vector<std::string> images = topics.Images();
    for (size_t i = 0; i < images.size(); ++i) {
      if (sensor == fmt::format("cam{}", i)) return path_ + ": " + images[i];
    }
    return path_ + ": " + topics.gyro;
  }

  TableRows<ImageFile> ReadImages(int camera, Warnings* warnings) const override {
    if (camera == 0) warnings->Merge(listing_->warnings);  // of all topics, once
    const std::string name = NameTable(fmt::format("cam{}", camera));
    TableRows<ImageFile> rows{name, TableText(name, "images")};
    for (const ImageFile& image : listing_->images.at(static_cast<size_t>(camera))) {
      rows.elements.push_back({image.stamp_ns, path_ + "/" + image.path});
      rows.numbers.push_back(static_cast<int>(rows.numbers.size()) + 1);
    }
    return rows;
  }

  // Throws what says which topics are there, where none is an IMU's.
  void RequireImu() const {
    if (listing_->topics.gyro.empty()) ChooseTopics(listing_->store->bag(), listing_->topics);
  }

  TableRows<ImuRow> ReadImu(Warnings*) const override {
    RequireImu();
    const std::string name = NameTable("imu0");
    TableRows<ImuRow> rows{name, TableText(name, "samples"), listing_->imu};
    for (const ImuRow& row : listing_->imu) rows.numbers.push_back(row.number);
    return rows;
  }

  Calibration FindCalibration(const SequenceOptions& options, const std::vector<int>& cameras,
                              Warnings* warnings) const override {
    return ReadBagCalibration(listing_->topics, options.calibration, listing_->store->bag(),
                              warnings, options.mirrored, cameras);
  }

 private:
  std::string path_;
  std::shared_ptr<const BagListing> listing_;
};

// What a topic is taken as; "" where it is not.
std::string DescribeRoles(const std::string& name, const RecordingTopics& topics) {
  std::string roles;
  const auto add = [&](const std::string& topic, const char* role) {
    if (topic == name) roles += (roles.empty() ? "" : " and ") + std::string(role);
  };
  add(topics.left, "left images");
  add(topics.right, "right images");
  for (const std::string& other : topics.others) add(other, "images of another camera");
  add(topics.gyro, "gyroscope");
  add(topics.accel, "accelerometer");
  return roles;
}

}  // namespace

std::vector<RecordedTopic> ListRecordedTopics(const std::string& path, const std::string& said) {
  std::vector<RecordedTopic> listed;
  if (!IsBagRecording(path)) return listed;
  const auto listing = KnownListing(path, said, false);
  const std::unique_ptr<Bag> opened = listing ? nullptr : OpenBag(path);
  Bag* const bag = listing ? listing->store->bag() : opened.get();
  RecordingTopics taken;
  try {
    taken = listing ? listing->topics : ChooseTopics(bag, ParseTopics(said), false);
  } catch (const InputFault&) {  // which the check tells
  }
  for (const BagTopic& topic : bag->topics()) {
    const bool can_be = IsImageTopic(topic) || IsImuTopic(topic);
    listed.push_back(
        {topic.name, topic.type, topic.messages, can_be ? DescribeRoles(topic.name, taken) : ""});
  }
  return listed;
}

std::string DescribeFiles(const std::string& folder) {
  std::vector<std::string> rows;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unknown;
    rows.push_back(fmt::format("{} {} {}\n", it->path().filename().string(), it->file_size(unknown),
                               it->last_write_time(unknown).time_since_epoch().count()));
  }
  std::ranges::sort(rows);
  return fmt::format("{}", fmt::join(rows, ""));
}

std::string DescribeBag(const std::string& path) {
  return fs::is_directory(path) ? DescribeFiles(path) : FileImages()->State(path);
}

std::unique_ptr<RecordingTables> OpenBagTables(const std::string& path,
                                               const SequenceOptions& options) {
  auto tables = std::make_unique<BagTables>(path, KnownListing(path, options.topics));
  if (options.needs_imu) tables->RequireImu();
  return tables;
}

}  // namespace slcmap::data
