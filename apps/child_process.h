// Runs this program again as a process of its own, whose cost and failure are its own.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace slcmap {

// Of a child that a signal ended, and the signal's number more.
inline constexpr int kExitSignal = 128;

// Runs slcmap with arguments, its output in a log file, and waits for it, calling watch() several
// times a second. Ctrl-C is passed on, so that it ends as it does alone. Returns its exit code; 128
// and more where a signal ended it. Throws OutputError where it cannot be started.
int RunChild(const std::vector<std::string>& arguments, const std::string& log_path,
             const std::function<void()>& watch);

}  // namespace slcmap
