// Images of a recording that are not there, or cannot be read.
#pragma once

#include <mutex>
#include <set>
#include <string>

namespace slcmap {

// Each file once, however often it is asked for. Files may be added from several threads.
class LostImages {
 public:
  void Add(const std::string& path) {
    const std::lock_guard lock(mutex_);
    paths_.insert(path);
  }

  std::set<std::string> paths() const {
    const std::lock_guard lock(mutex_);
    return paths_;
  }

 private:
  mutable std::mutex mutex_;
  std::set<std::string> paths_;
};

}  // namespace slcmap
