#include "data/source/recorded_source.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <ranges>
#include <thread>

#include "data/calibration/calibration.h"
#include "data/calibration/other_calibrations.h"
#include "data/core/error.h"
#include "data/io/image.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

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
  const ImageRead left =
      ReadGrayImage(*sequence.store, entry.left_path, size(0), sequence.pixel_forms[0]);
  item.image.left = left.image;
  item.problem = left.problem;
  item.path = entry.left_path;
  for (int camera = 1; read_right && camera < CameraCount(rig); ++camera) {
    item.image.decode.emplace_back();
    const std::string& path = entry.path(camera);
    if (path.empty() || item.problem != nullptr) continue;
    const DeferredImageRead read = ReadGrayImageDeferred(
        *sequence.store, path, size(camera), sequence.pixel_forms[static_cast<size_t>(camera)]);
    item.image.decode.back() = read.decode;
    item.problem = read.problem;
    item.path = path;
  }
  return item;
}

}  // namespace

// Reads ahead in a thread.
class RecordedSource::Reader {
 public:
  Reader(const Sequence& sequence, const RecordedSourceOptions& options)
      : sequence_(sequence), options_(options), thread_([this] { ReadAhead(); }) {}

  ~Reader() {
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
  const RecordedSourceOptions options_;
  Warnings warnings_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Item> queue_;
  int64_t from_ns_ = std::numeric_limits<int64_t>::min();  // earlier pairs need not be read
  bool stop_ = false, all_read_ = false;
  std::thread thread_;  // last, so that it starts when all else is there
};

RecordedSource::RecordedSource(Sequence sequence, const RecordedSourceOptions& options)
    : sequence_(std::move(sequence)), options_(options), info_{sequence_.folder,
                                                               sequence_.form,
                                                               sequence_.rig,
                                                               sequence_.calibration_source,
                                                               sequence_.finds_carried,
                                                               {},
                                                               sequence_.opened} {
  for (const StereoEntry& pair : sequence_.images) info_.pair_stamps_ns.push_back(pair.stamp_ns);
  info_.cameras = sequence_.CameraNames();
}

RecordedSource::~RecordedSource() = default;

std::optional<ReadPair> RecordedSource::NextPair(int64_t from_ns) {
  if (!reader_) reader_ = std::make_unique<Reader>(sequence_, options_);
  return reader_->Next(from_ns);
}

std::optional<ImuSample> RecordedSource::NextImu() {
  if (next_imu_ == sequence_.imu.size()) return std::nullopt;
  return sequence_.imu[next_imu_++];
}

Warnings RecordedSource::warnings() const {
  Warnings all = sequence_.warnings;
  if (reader_) all.Merge(reader_->warnings());
  return all;
}

Trajectory RecordedSource::ReadTruth() const {
  return sequence_.truth_path.empty() ? Trajectory() : ReadTrajectory(sequence_.truth_path);
}

cv::Size RecordedSource::GetSize(int camera) const {
  return {sequence_.rig.cameras[camera].width_px, sequence_.rig.cameras[camera].height_px};
}

ImageRead RecordedSource::ReadImage(size_t pair, int camera) const {
  return ReadGrayImage(*sequence_.store, ImagePlace(pair, camera), GetSize(camera),
                       sequence_.pixel_forms[camera]);
}

const char* RecordedSource::FindProblem(size_t pair, int camera) const {
  return sequence_.store->FindProblem(ImagePlace(pair, camera), GetSize(camera));
}

bool RecordedSource::IsRepeated(size_t pair, int camera) const {
  return sequence_.store->IsSame(ImagePlace(pair - 1, camera), ImagePlace(pair, camera));
}

std::string RecordedSource::ImagePlace(size_t pair, int camera) const {
  return sequence_.images[pair].path(camera);
}

std::unique_ptr<SequenceSource> OpenSource(const std::string& path, const SequenceOptions& options,
                                           bool read_right) {
  return std::make_unique<RecordedSource>(OpenSequence(path, options),
                                          RecordedSourceOptions{.read_right = read_right});
}

std::unique_ptr<SequenceSource> OpenAgain(const std::string& path, SequenceOptions opened,
                                          const std::string& calibration, bool read_right) {
  std::error_code error;
  const std::string place = LocateRecording(path, false);
  if (opened.cameras.empty() && fs::exists(place + "/cam2", error)) {
    throw DataError(place +
                    ": found more than two cameras, and a map by an earlier version that does not "
                    "tell which it is of; expected a map that does: make it again");
  }
  if (!IsBagRecording(place)) opened.topics.clear();
  opened.needs_imu = false;
  opened.masks.clear();
  const bool has_calibration = fs::exists(calibration, error);
  // The file names the cameras that were used cam0, cam1, ..., whichever of the recording's they
  // are.
  const bool is_named_alike = std::ranges::equal(
      opened.cameras, std::views::iota(0, static_cast<int>(opened.cameras.size())));
  if (has_calibration && is_named_alike) {
    opened.calibration = calibration;
    if (opened.cameras.size() <= 2) opened.cameras.clear();  // more would be put in another order
  } else if (!fs::exists(SplitCalibrationPaths(opened.calibration).front(), error)) {
    opened.calibration.clear();
  }
  Sequence recording = OpenSequence(path, opened);
  if (has_calibration && !is_named_alike) {
    Warnings ignored;  // were told of the recording's own
    const Rig rig = ReadCalibration(calibration, &ignored).rig;
    recording.rig.cameras = rig.cameras;
    recording.rig.T_imu_camera = rig.T_imu_camera;
  }
  return std::make_unique<RecordedSource>(std::move(recording),
                                          RecordedSourceOptions{.read_right = read_right});
}

}  // namespace slcmap::data
