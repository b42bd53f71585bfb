// The errors that a user can cause, and that a program prints in one line.
#pragma once

#include <stdexcept>
#include <string>

namespace slcmap {

// The base of every error that slcmap throws on purpose. The message is one line and names the place
// (file, key or row), what was found there and what was expected.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A wrong option, configuration key or command line.
class ConfigError : public Error {
 public:
  using Error::Error;
};

// Input that cannot be used at all: a missing folder, an absurd calibration, an empty sequence.
class DataError : public Error {
 public:
  using Error::Error;
};

// Output that could not be written: a full disk, a missing permission.
class OutputError : public Error {
 public:
  using Error::Error;
};

}  // namespace slcmap
