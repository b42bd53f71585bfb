#include "data/source/asl_source.h"

#include <filesystem>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

// By the bytes of the files; those of noisy images differ in size already.
bool IsSameFile(const std::string& a, const std::string& b) {
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  const auto size = fs::file_size(a, error);
  if (error || size != fs::file_size(b, error) || error) return false;
  try {
    return ReadFile(a) == ReadFile(b);
  } catch (const DataError&) {  // unreadable files are another finding
    return false;
  }
}

}  // namespace

AslSource::AslSource(Sequence sequence, const StereoReaderOptions& options)
    : sequence_(std::move(sequence)), options_(options), info_{sequence_.folder,
                                                               "ASL folder",
                                                               sequence_.rig,
                                                               sequence_.calibration_source,
                                                               sequence_.finds_carried,
                                                               {}} {
  for (const StereoEntry& pair : sequence_.images) info_.pair_stamps_ns.push_back(pair.stamp_ns);
  info_.cameras = sequence_.CameraNames();
}

std::optional<ReadPair> AslSource::NextPair(int64_t from_ns) {
  if (!reader_) reader_ = std::make_unique<StereoReader>(sequence_, options_);
  return reader_->Next(from_ns);
}

std::optional<ImuSample> AslSource::NextImu() {
  if (next_imu_ == sequence_.imu.size()) return std::nullopt;
  return sequence_.imu[next_imu_++];
}

Warnings AslSource::warnings() const {
  Warnings all = sequence_.warnings;
  if (reader_) all.Merge(reader_->warnings());
  return all;
}

Trajectory AslSource::ReadTruth() const {
  return sequence_.truth_path.empty() ? Trajectory() : ReadTrajectory(sequence_.truth_path);
}

cv::Size AslSource::SizeOf(int camera) const {
  return {sequence_.rig.cameras[camera].width_px, sequence_.rig.cameras[camera].height_px};
}

ImageRead AslSource::ReadImage(size_t pair, int camera) const {
  return ReadGrayImage(ImagePlace(pair, camera), SizeOf(camera), sequence_.pixel_forms[camera]);
}

const char* AslSource::FindProblem(size_t pair, int camera) const {
  return FindImageProblem(ImagePlace(pair, camera), SizeOf(camera));
}

bool AslSource::IsRepeated(size_t pair, int camera) const {
  return IsSameFile(ImagePlace(pair - 1, camera), ImagePlace(pair, camera));
}

std::string AslSource::ImagePlace(size_t pair, int camera) const {
  const StereoEntry& entry = sequence_.images[pair];
  return camera == 0 ? entry.left_path : entry.right_path;
}

std::unique_ptr<SequenceSource> OpenSource(const std::string& path, const SequenceOptions& options,
                                           bool read_right) {
  return std::make_unique<AslSource>(OpenSequence(path, options),
                                     StereoReaderOptions{.read_right = read_right});
}

}  // namespace slcmap
