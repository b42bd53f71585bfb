#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "data/bag/bag.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/source/recording_tables.h"
#include "data/source/sequence.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

// The folder that has cam0, of the one that a user names; "" where there is none.
std::string FolderWithCamera(const std::string& path) {
  std::error_code error;
  for (const fs::path& folder : {fs::path(path), fs::path(path) / "mav0"}) {
    if (fs::is_directory(folder / "cam0", error)) return folder.string();
  }
  return "";
}

std::string FindAslFolder(const std::string& path, bool needs_imu) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    const bool is_empty = fs::is_regular_file(path, error) && fs::is_empty(path, error);
    throw InputFault(
        "unreadable",
        path + (is_empty ? ": found an empty file," : ": found no such folder, nor a bag,") +
            " expected an EuRoC (ASL) or TUM VI "
            "sequence, a ROS 1 bag, a rosbag2 or an MCAP file",
        "name the folder that holds mav0, or mav0 itself, or the bag");
  }
  const std::string folder = FolderWithCamera(path);
  if (folder.empty()) {
    throw InputFault(
        "unreadable",
        path +
            ": found neither cam0 nor mav0/cam0 nor a bag, expected an EuRoC (ASL) "
            "or TUM VI sequence, or the folder of a rosbag2",
        "lay the sequence out as EuRoC does: mav0/cam0, cam1, imu0, each with data.csv "
        "and sensor.yaml");
  }
  if (needs_imu && !fs::is_directory(folder + "/imu0", error)) {
    throw InputFault("unreadable", folder + ": found no imu0, expected cam0, cam1 and imu0",
                     "write the IMU's samples as " + folder + "/imu0/data.csv");
  }
  return folder;
}

class AslTables : public RecordingTables {
 public:
  explicit AslTables(std::string folder) : folder_(std::move(folder)) {}

  const std::string& place() const override { return folder_; }
  std::string form() const override { return "ASL folder"; }
  SharedImageStore images() const override { return FileImages(); }

  std::vector<int> cameras() const override {
    constexpr int kMaxIndex = 9;
    std::vector<int> there;
    for (int i = 0; i <= kMaxIndex; ++i) {
      std::error_code error;
      if (fs::is_directory(CameraFolder(i), error)) there.push_back(i);
    }
    return there;
  }

  std::string NameTable(const std::string& sensor) const override {
    return fmt::format("{}/{}/data.csv", folder_, sensor);
  }

  TableRows<ImageFile> ReadImages(int camera, Warnings* warnings) const override {
    return ReadImageRows(CameraFolder(camera), warnings);
  }

  TableRows<ImuRow> ReadImu(Warnings* warnings) const override {
    return ReadImuRows(NameTable("imu0"), warnings);
  }

  Calibration FindCalibration(const SequenceOptions& options, const std::vector<int>& cameras,
                              Warnings* warnings) const override {
    return data::FindCalibration(folder_, warnings, options.mirrored, cameras);
  }

 private:
  std::string CameraFolder(int camera) const { return fmt::format("{}/cam{}", folder_, camera); }

  std::string folder_;
};

}  // namespace

bool IsBagRecording(const std::string& path) {
  return FolderWithCamera(path).empty() && IsBag(path);
}

std::string LocateRecording(const std::string& path, bool needs_imu) {
  return IsBagRecording(path) ? path : FindAslFolder(path, needs_imu);
}

std::unique_ptr<RecordingTables> OpenTables(const std::string& path,
                                            const SequenceOptions& options) {
  if (IsBagRecording(path)) return OpenBagTables(path, options);
  if (!options.topics.empty()) {
    throw ConfigError(
        fmt::format("--topics: found {} for {}, which is no bag, expected it for bags alone",
                    options.topics, path));
  }
  return std::make_unique<AslTables>(FindAslFolder(path, options.needs_imu));
}

SharedImageStore OpenImageStore(const std::string& place, const SequenceOptions& opened) {
  return IsBagRecording(place) ? OpenBagTables(place, opened)->images() : FileImages();
}

}  // namespace slcmap::data
