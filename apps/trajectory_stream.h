// A TUM file that grows row by row, so that an interrupted run leaves what it has.
#pragma once

#include <cstdio>
#include <memory>
#include <string>

#include "data/trajectory.h"

namespace slcmap {

class TrajectoryStream {
 public:
  // Opens the file anew. Throws OutputError.
  explicit TrajectoryStream(const std::string& path);

  // Adds a row, which is in the file when the call returns. Throws OutputError, as on a full disk.
  void Add(const StampedPose& pose);

 private:
  void Write(const std::string& text);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace slcmap
