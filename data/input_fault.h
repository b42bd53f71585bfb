// Bad input for which it is known what to do.
#pragma once

#include <string>

#include "data/error.h"

namespace slcmap {

// A DataError with a word for scripts (a finding's name, see data/check/report.h) and a remedy, for
// the check of a recording to show.
class InputFault : public DataError {
 public:
  InputFault(const std::string& name, const std::string& message, const std::string& remedy)
      : DataError(message), name_(name), remedy_(remedy) {}

  const std::string& name() const { return name_; }
  const std::string& remedy() const { return remedy_; }

 private:
  std::string name_, remedy_;
};

// A rotation of the calibration that is a mirror image of one.
class MirroredFault : public InputFault {
 public:
  using InputFault::InputFault;
};

}  // namespace slcmap
