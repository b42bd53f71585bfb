#include "apps/trajectory_stream.h"

#include <cerrno>
#include <cstring>

#include "data/error.h"

namespace slcmap {

TrajectoryStream::TrajectoryStream(const std::string& path)
    : path_(path), file_(std::fopen(path.c_str(), "wb")) {
  if (!file_) throw OutputError(path_ + ": cannot be opened: " + std::strerror(errno));
  Write(kTumHeader);
}

void TrajectoryStream::Add(const StampedPose& pose) { Write(TumRow(pose)); }

void TrajectoryStream::Write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() ||
      std::fflush(file_.get()) != 0) {
    throw OutputError(path_ + ": cannot be written: " + std::strerror(errno));
  }
}

}  // namespace slcmap
