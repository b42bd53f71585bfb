#include "apps/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "apps/commands.h"
#include "data/error.h"

extern char** environ;

namespace slcmap {
namespace {

constexpr auto kPause = std::chrono::milliseconds(20);
constexpr auto kWatch = std::chrono::milliseconds(200);  // between two calls of watch()

// What a process gets beside its arguments; freed at the end.
struct Surroundings {
  explicit Surroundings(const std::string& log_path) {
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log_path.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    posix_spawnattr_init(&attributes);
    // A group of its own: Ctrl-C of the terminal comes to it through this process alone, once.
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
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

}  // namespace

int RunChild(const std::vector<std::string>& arguments, const std::string& log_path,
             const std::function<void()>& watch) {
  const Surroundings surroundings(log_path);
  std::vector<std::string> all = {"slcmap"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& argument : all) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int error = posix_spawn(&child, "/proc/self/exe", &surroundings.files,
                                &surroundings.attributes, argv.data(), environ);
  if (error != 0) {
    throw OutputError(
        fmt::format("{}: slcmap could not be started again: {}", log_path, std::strerror(error)));
  }
  bool passed_on = false;
  auto watched = std::chrono::steady_clock::now();
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (Interrupted() && !passed_on) {
      kill(child, SIGTERM);  // a child of a background job ignores SIGINT
      passed_on = true;
    }
    std::this_thread::sleep_for(kPause);
    if (std::chrono::steady_clock::now() - watched < kWatch) continue;
    watch();
    watched = std::chrono::steady_clock::now();
  }
  return ExitCode(status);
}

}  // namespace slcmap
