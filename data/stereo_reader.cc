#include "data/stereo_reader.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "data/image_file.h"

namespace slcmap {
namespace {

// A decoded pair, or the file that spoiled it.
struct Item {
  StereoImage image;
  const char* problem = nullptr;
  std::string path;
};

Item ReadPair(const StereoEntry& entry, const Rig& rig, bool read_right) {
  Item item;
  item.image.stamp_ns = entry.stamp_ns;
  const auto read = [&](const std::string& path, int camera) {
    const cv::Size size(rig.cameras[camera].width_px, rig.cameras[camera].height_px);
    const ImageRead result = ReadGrayImage(path, size);
    if (result.problem != nullptr) {
      item.problem = result.problem;
      item.path = path;
    }
    return result.image;
  };
  item.image.left = read(entry.left_path, 0);
  if (read_right && !entry.right_path.empty() && item.problem == nullptr)
    item.image.right = read(entry.right_path, 1);
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

  std::optional<StereoImage> Next() {
    while (taken_ < sequence_.images.size()) {
      Item item = Take();
      ++taken_;
      if (item.problem == nullptr) return std::move(item.image);
      warnings_.Add(item.problem, item.path);
    }
    return std::nullopt;
  }

  const Warnings& warnings() const { return warnings_; }

 private:
  void ReadAhead() {
    for (const StereoEntry& entry : sequence_.images) {
      Item item = ReadPair(entry, sequence_.rig, options_.read_right);
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] {
        return stop_ || queue_.size() < static_cast<size_t>(options_.read_ahead);
      });
      if (stop_) return;
      queue_.push_back(std::move(item));
      changed_.notify_all();
    }
  }

  Item Take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !queue_.empty(); });
    Item item = std::move(queue_.front());
    queue_.pop_front();
    changed_.notify_all();
    return item;
  }

  const Sequence& sequence_;
  const StereoReaderOptions options_;
  Warnings warnings_;
  size_t taken_ = 0;
  std::mutex mutex_;  // guards queue_ and stop_
  std::condition_variable changed_;
  std::deque<Item> queue_;
  bool stop_ = false;
  std::thread thread_;  // last, so that it starts when all else is there
};

StereoReader::StereoReader(const Sequence& sequence, const StereoReaderOptions& options)
    : impl_(std::make_unique<Impl>(sequence, options)) {}
StereoReader::~StereoReader() = default;
std::optional<StereoImage> StereoReader::Next() { return impl_->Next(); }
const Warnings& StereoReader::warnings() const { return impl_->warnings(); }

}  // namespace slcmap
