#include "apps/commands/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "apps/commands/commands.h"
#include "data/core/error.h"
#include "data/io/file.h"

extern char** environ;

namespace slcmap::inline commands {
namespace {

constexpr auto kPause = std::chrono::milliseconds(20);
constexpr auto kWatch = std::chrono::milliseconds(200);  // between two calls of watch()

// What a process gets beside its arguments; freed at the end.
struct Surroundings {
  explicit Surroundings(const ChildProcess& child) {
    posix_spawn_file_actions_init(&files);
    if (!child.log_path.empty()) {
      posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, child.log_path.c_str(),
                                       O_WRONLY | O_CREAT | O_TRUNC, 0644);
      posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    }
    posix_spawnattr_init(&attributes);
    // A group of its own: Ctrl-C of the terminal comes to it through this process alone, once.
    short flags = POSIX_SPAWN_SETPGROUP;
    posix_spawnattr_setpgroup(&attributes, 0);
    if (child.interrupts_group) {
      sigset_t signals;
      sigemptyset(&signals);
      sigaddset(&signals, SIGINT);
      posix_spawnattr_setsigdefault(&attributes, &signals);
      flags |= POSIX_SPAWN_SETSIGDEF;
    }
    posix_spawnattr_setflags(&attributes, flags);
  }
  ~Surroundings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  Surroundings(const Surroundings&) = delete;
  Surroundings& operator=(const Surroundings&) = delete;

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
};

int ExitCode(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : kExitSignal + WTERMSIG(status);
}

pid_t Start(const ChildProcess& child) {
  const Surroundings surroundings(child);
  std::vector<std::string> all = {child.program};
  all.insert(all.end(), child.arguments.begin(), child.arguments.end());
  std::vector<char*> argv;
  for (std::string& argument : all) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t id = 0;
  const int error = posix_spawnp(&id, child.program.c_str(), &surroundings.files,
                                 &surroundings.attributes, argv.data(), environ);
  if (error == 0) return id;
  throw OutputError(
      fmt::format("{}: could not be started: {}", child.program, std::strerror(error)));
}

}  // namespace

int RunChild(const ChildProcess& child) {
  const pid_t id = Start(child);
  bool passed_on = false;
  auto watched = std::chrono::steady_clock::now();
  int status = 0;
  while (waitpid(id, &status, WNOHANG) == 0) {
    if (Interrupted() && !passed_on) {
      kill(child.interrupts_group ? -id : id, child.interrupts_group ? SIGINT : SIGTERM);
      passed_on = true;
    }
    std::this_thread::sleep_for(kPause);
    if (!child.watch || std::chrono::steady_clock::now() - watched < kWatch) continue;
    child.watch();
    watched = std::chrono::steady_clock::now();
  }
  return ExitCode(status);
}

int RunSelf(const std::vector<std::string>& arguments, const std::string& log_path,
            const std::function<void()>& watch) {
  return RunChild({"/proc/self/exe", arguments, log_path, watch});
}

std::string LastLine(const std::string& log_path) {
  std::string text = ReadFile(log_path);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

}  // namespace slcmap::commands
