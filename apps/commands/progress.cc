#include "apps/commands/progress.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>

#include "apps/commands/commands.h"
#include "data/core/progress.h"

namespace slcmap::inline commands {
namespace {

constexpr int kBarColumns = 28;
constexpr double kBarStep_s = 0.1;  // between two looks of the bar
constexpr double kLineStep_s = 5;   // between two lines of what takes long

double Seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

int Tenths(double share) { return static_cast<int>(10 * share + 1e-9); }

ProgressListener& Listener() {
  static ProgressListener listener;
  return listener;
}

}  // namespace

void SetProgressListener(ProgressListener listener) { Listener() = std::move(listener); }

ProgressBar::ProgressBar(std::string label, Elsewhere elsewhere)
    : label_(std::move(label)),
      on_terminal_(isatty(STDERR_FILENO) != 0),
      shown_(spdlog::should_log(spdlog::level::info)),
      elsewhere_(elsewhere),
      start_(std::chrono::steady_clock::now()),
      last_shown_(start_) {}

ProgressBar::~ProgressBar() { Leave(); }

void ProgressBar::Leave() {
  if (bar_shown_) std::fputc('\n', stderr);
  bar_shown_ = false;
}

// On a terminal what takes no longer than a look shows no bar at all.
bool ProgressBar::IsDue(double share) const {
  if (!shown_) return false;
  const double since_s = Seconds(std::chrono::steady_clock::now() - last_shown_);
  if (!on_terminal_) {
    return Tenths(share) >= next_tenth_ &&
           (elsewhere_ == Elsewhere::kTenths || since_s >= kLineStep_s);
  }
  return since_s >= kBarStep_s || (bar_shown_ && share >= 1);
}

void ProgressBar::Update(double share, const std::function<std::string(double)>& figures) {
  share = std::clamp(share, 0.0, 1.0);
  if (Listener()) return Listener()(label_, share);
  if (!IsDue(share)) return;
  last_shown_ = std::chrono::steady_clock::now();
  next_tenth_ = Tenths(share) + 1;
  std::string text = fmt::format("{:3.0f} %", 100 * share);
  if (figures) text += "  " + figures(std::max(Seconds(last_shown_ - start_), 1e-6));
  if (on_terminal_) {
    ShowBar(share, text);
  } else {
    spdlog::info("{} {}", label_, text);
  }
}

void ProgressBar::ShowBar(double share, const std::string& text) {
  const int filled = static_cast<int>(share * kBarColumns);
  const std::string bar = std::string(filled, '=') + std::string(kBarColumns - filled, ' ');
  std::fprintf(stderr, "\r\x1b[K%s [%s] %s", label_.c_str(), bar.c_str(), text.c_str());
  std::fflush(stderr);
  bar_shown_ = true;
}

void ProgressBar::Update(int64_t done, int64_t images, double data_s, double distance_m) {
  const double share =
      static_cast<double>(done) / static_cast<double>(std::max<int64_t>(images, 1));
  Update(share, [&](double elapsed_s) {
    return fmt::format("{:.0f} images/s  {:.1f} x real time  {:.1f} m",
                       static_cast<double>(done) / elapsed_s, data_s / elapsed_s, distance_m);
  });
}

Progress StageProgress(const std::string& label) {
  const auto bar = std::make_shared<ProgressBar>(label, ProgressBar::Elsewhere::kSeldom);
  const auto told = std::make_shared<std::once_flag>();
  return Progress([bar, told, label](double done) {
    if (!Interrupted()) {
      bar->Update(done);
      return true;
    }
    // What is done may take seconds to be written.
    std::call_once(*told, [&] {
      bar->Leave();
      spdlog::info("{}: stopping; interrupted once more it ends at once", label);
    });
    return false;
  });
}

ProcessCost CostSoFar() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  ProcessCost cost;
  cost.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  cost.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  cost.peak_memory_mib = static_cast<double>(usage.ru_maxrss) / 1024;  // Linux counts in KiB
  return cost;
}

namespace {

// As handlers of signals may use them, and threads.
std::atomic<int> interrupted = 0;
std::atomic<int> ends_at_once = 0;
static_assert(std::atomic<int>::is_always_lock_free);

void HandleSignal(int) {
  if (ends_at_once) {
    constexpr char kMessage[] = "slcmap: error: interrupted\n";
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kMessage, sizeof kMessage - 1);
    _exit(kExitInterrupted);
  }
  interrupted = 1;
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  std::signal(SIGHUP, SIG_DFL);
}

// What nohup or a shell made the program ignore stays ignored.
void HandleUnlessIgnored(int number) {
  if (std::signal(number, HandleSignal) == SIG_IGN) std::signal(number, SIG_IGN);
}

}  // namespace

void HandleInterruptions() {
  HandleUnlessIgnored(SIGINT);
  HandleUnlessIgnored(SIGTERM);
  HandleUnlessIgnored(SIGHUP);    // the terminal was closed
  std::signal(SIGXFSZ, SIG_IGN);  // writing fails, and says so
}

bool Interrupted() { return interrupted != 0; }

void Interrupt() { interrupted = 1; }

void ForgetInterruption() { interrupted = 0; }

EndsAtOnce::EndsAtOnce() {
  std::fflush(stdout);
  if (Interrupted()) throw StoppedError("interrupted");
  ends_at_once = 1;
}

EndsAtOnce::~EndsAtOnce() { ends_at_once = 0; }

}  // namespace slcmap::commands
