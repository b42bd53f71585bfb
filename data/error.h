// The errors that a user can cause, and that a program prints in one line.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace slcmap {

// The base of every error that slcmap throws on purpose. The message is one line and names the
// place (file, key or row), what was found there and what was expected.
class Error : public std::runtime_error {
 public:
  explicit Error(std::string message) : std::runtime_error(InOneLine(std::move(message))) {}

 private:
  // What was found may hold line breaks and other control characters.
  static std::string InOneLine(std::string message) {
    for (char& c : message) {
      if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = ' ';
    }
    return message;
  }
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
