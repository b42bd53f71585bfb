#include "data/stereo_reader.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "data/image_file.h"

namespace slcmap {
namespace {

// A pair, or the file that spoiled it.
struct Item {
  ReadPair image;
  const char* problem = nullptr;
  std::string path;
};

Item ReadItem(const StereoEntry& entry, const Sequence& sequence, bool read_right) {
  const Rig& rig = sequence.rig;
  Item item;
  item.image.stamp_ns = entry.stamp_ns;
  const auto size = [&](int camera) {
    return cv::Size(rig.cameras[camera].width_px, rig.cameras[camera].height_px);
  };
  const ImageRead left = ReadGrayImage(entry.left_path, size(0), sequence.pixel_forms[0]);
  item.image.left = left.image;
  item.problem = left.problem;
  item.path = entry.left_path;
  if (!read_right || entry.right_path.empty() || left.problem != nullptr) return item;
  const DeferredImageRead right =
      ReadGrayImageDeferred(entry.right_path, size(1), sequence.pixel_forms[1]);
  item.image.decode_right = right.decode;
  item.problem = right.problem;
  item.path = entry.right_path;
  return item;
}

}  // namespace

class StereoReader::Impl {
 public:
  Impl(const Sequence& sequence, const StereoReaderOptions& options)
      : sequence_(sequence), options_(options), thread_([this] { ReadAhead(); }) {}

  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  std::optional<ReadPair> Next(int64_t from_ns) {
    while (std::optional<Item> item = Take(from_ns)) {
      if (item->problem == nullptr) return std::move(item->image);
      warnings_.Add(item->problem, item->path);
    }
    return std::nullopt;
  }

  const Warnings& warnings() const { return warnings_; }

 private:
  void ReadAhead() {
    for (const StereoEntry& entry : sequence_.images) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] {
        return stop_ || queue_.size() < static_cast<size_t>(options_.read_ahead);
      });
      if (stop_) return;
      if (entry.stamp_ns < from_ns_) continue;
      lock.unlock();
      Item item = ReadItem(entry, sequence_, options_.read_right);
      lock.lock();
      queue_.push_back(std::move(item));
      changed_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    all_read_ = true;
    changed_.notify_all();
  }

  // The next item whose stamp is not before from_ns; nothing at the end.
  std::optional<Item> Take(int64_t from_ns) {
    std::unique_lock lock(mutex_);
    from_ns_ = from_ns;
    while (true) {
      changed_.wait(lock, [this] { return !queue_.empty() || all_read_; });
      if (queue_.empty()) return std::nullopt;
      Item item = std::move(queue_.front());
      queue_.pop_front();
      changed_.notify_all();
      if (item.image.stamp_ns >= from_ns) return item;
    }
  }

  const Sequence& sequence_;
  const StereoReaderOptions options_;
  Warnings warnings_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Item> queue_;
  int64_t from_ns_ = std::numeric_limits<int64_t>::min();  // earlier pairs need not be read
  bool stop_ = false, all_read_ = false;
  std::thread thread_;  // last, so that it starts when all else is there
};

StereoReader::StereoReader(const Sequence& sequence, const StereoReaderOptions& options)
    : impl_(std::make_unique<Impl>(sequence, options)) {}
StereoReader::~StereoReader() = default;
std::optional<ReadPair> StereoReader::Next(int64_t from_ns) { return impl_->Next(from_ns); }
const Warnings& StereoReader::warnings() const { return impl_->warnings(); }

}  // namespace slcmap
