// The program's commands, as one would type them.
#include <pybind11/stl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/commands/progress.h"
#include "apps/python/module.h"
#include "data/core/error.h"

namespace slcmap::inline python {
namespace {

// Between two looks at Ctrl-C, log and progress.
constexpr std::chrono::milliseconds kLook{50};

// What a command prints on standard output, kept instead. The C library lets it be assigned.
class KeptOutput {
 public:
  KeptOutput() : printed_by_others_(stdout), file_(open_memstream(&text_, &size_)) {
    if (file_ == nullptr) throw std::bad_alloc();
    stdout = file_;
  }
  ~KeptOutput() {
    stdout = printed_by_others_;
    std::fclose(file_);
    std::free(text_);
  }
  KeptOutput(const KeptOutput&) = delete;
  KeptOutput& operator=(const KeptOutput&) = delete;

  std::string Text() {
    std::fflush(file_);
    return {text_, size_};
  }

 private:
  std::FILE* printed_by_others_;
  char* text_ = nullptr;
  size_t size_ = 0;
  std::FILE* file_;
};

// How far a command is, for the thread that waits for it.
class Mailbox {
 public:
  struct Mail {
    bool is_done = false;
    std::optional<std::pair<std::string, double>> progress;  // the newest
  };

  void Report(const std::string& label, double share) {
    const std::lock_guard lock(mutex_);
    mail_.progress = {label, share};
  }

  void SayDone() {
    const std::lock_guard lock(mutex_);
    mail_.is_done = true;
    done_.notify_all();
  }

  // Waits until it is done, for a look at most.
  Mail Wait() {
    std::unique_lock lock(mutex_);
    done_.wait_for(lock, kLook, [this] { return mail_.is_done; });
    return {mail_.is_done, std::exchange(mail_.progress, std::nullopt)};
  }

 private:
  std::mutex mutex_;
  std::condition_variable done_;
  Mail mail_;
};

// What a command changes for the whole process, and what only one at a time may have.
class OneCommand {
 public:
  explicit OneCommand(Mailbox* mailbox) {
    if (std::exchange(IsUnderWay(), true)) {
      throw ConfigError("found another command under way, expected one at a time in a process");
    }
    SetProgressListener(
        [mailbox](const std::string& label, double share) { mailbox->Report(label, share); });
    ForgetInterruption();
  }
  ~OneCommand() {
    cv::setNumThreads(threads_);
    spdlog::set_level(spdlog::level::info);
    SetProgressListener({});
    ForgetInterruption();
    IsUnderWay() = false;
  }
  OneCommand(const OneCommand&) = delete;
  OneCommand& operator=(const OneCommand&) = delete;

 private:
  // With Python's lock.
  static bool& IsUnderWay() {
    static bool is_under_way = false;
    return is_under_way;
  }
  const int threads_ = cv::getNumThreads();
};

void ParseAndRun(std::vector<std::string> arguments) {
  CLI::App app;
  AddCommands(app);
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw ConfigError(DescribeUsageError(app, error));
    std::ostringstream help;
    app.exit(error, help, help);
    std::fputs(help.str().c_str(), stdout);
  }
}

// Waits for the command as Python would: hands on its log and its progress, and hears Ctrl-C. What
// Python wants to throw, after having asked the command to end.
std::optional<py::error_already_set> Attend(Mailbox* mailbox, const py::object& progress) {
  std::optional<py::error_already_set> error;
  while (true) {
    const Mailbox::Mail mail = WithoutLock([&] { return mailbox->Wait(); });
    try {
      if (!error && mail.progress && !progress.is_none()) {
        progress(mail.progress->first, mail.progress->second);
      }
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    } catch (const py::error_already_set& thrown) {
      if (!error) error = thrown;
      Interrupt();
    }
    if (mail.is_done) return error;
  }
}

void FollowPythonsLevel() {
  const py::object logger = py::module_::import("logging").attr("getLogger")("slcmap");
  const bool says_more = logger.attr("isEnabledFor")(10).cast<bool>();
  spdlog::set_level(says_more ? spdlog::level::debug : spdlog::level::info);
}

// In a thread of its own. What it prints is added to `printed`, also where it fails.
void RunCommand(const std::vector<std::string>& arguments, const py::object& progress,
                py::list printed) {
  if (!arguments.empty() && (arguments[0] == "compare" || arguments[0] == "batch")) {
    throw ConfigError(arguments[0] + ": found it in Python, expected the program, as it starts it");
  }
  FollowPythonsLevel();
  Mailbox mailbox;
  const OneCommand only_one(&mailbox);
  KeptOutput output;
  std::exception_ptr failure;
  std::thread thread([&] {
    try {
      ParseAndRun(arguments);
    } catch (...) {
      failure = std::current_exception();
    }
    mailbox.SayDone();
  });
  const std::optional<py::error_already_set> error = Attend(&mailbox, progress);
  thread.join();
  printed.append(output.Text());
  if (error) throw *error;
  if (failure) std::rethrow_exception(failure);
}

}  // namespace

void AddCommand(py::module_& module) {
  module.def("run_command", &RunCommand, py::arg("arguments"), py::arg("progress"),
             py::arg("printed"), "See slcmap.command.");
}

}  // namespace slcmap::python
