// A reader of foreign bytes that is fuzzed.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace slcmap::fuzz {

struct Target {
  std::string name;
  std::function<std::vector<std::string>()> seeds;  // inputs beside those of its corpus
  // Reads an input. What must not happen (a crash, a foreign exception) ends the process.
  std::function<void(const std::string& bytes)> run;
};

std::vector<Target> Targets();

// The contents of a folder's files, by name.
std::vector<std::string> CollectFiles(const std::string& folder);

[[noreturn]] void Finding(const char* what, const char* message);

}  // namespace slcmap::fuzz
