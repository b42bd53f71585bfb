// Other programs, and this one again, as processes of their own, whose cost and failure are their
// own.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace slcmap::inline commands {

// Of a child that a signal ended, and the signal's number more.
inline constexpr int kExitSignal = 128;

// What a child is, and how it ends early.
struct ChildProcess {
  std::string program;  // a path, or a name that is looked for as shells do
  std::vector<std::string> arguments;
  std::string log_path;         // of both its streams; "": those of this process
  std::function<void()> watch;  // called several times a second; none: nothing is
  // Ctrl-C is passed on as this, so that the child ends as it does alone: a child of a background
  // job ignores SIGINT unless it is told otherwise.
  bool interrupts_group = false;  // SIGINT to the child and its own children, else SIGTERM to it
};

// Runs a child in a group of its own and waits for it. Returns its exit code; 128 and more where a
// signal ended it. Throws OutputError where it cannot be started.
int RunChild(const ChildProcess& child);

// Runs this program with arguments, its output in a log file.
int RunSelf(const std::vector<std::string>& arguments, const std::string& log_path,
            const std::function<void()>& watch = {});

// The last thing that a log says, which is the error where a program ended with one.
std::string LastLine(const std::string& log_path);

}  // namespace slcmap::commands
