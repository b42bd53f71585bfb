#include "apps/progress.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace slcmap {
namespace {

constexpr int kBarColumns = 28;
constexpr double kBarStep_s = 0.1;  // between two looks of the bar

double Seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

Progress::Progress(std::string label, int64_t total)
    : label_(std::move(label)),
      total_(std::max<int64_t>(total, 1)),
      shown_(spdlog::should_log(spdlog::level::info)),
      on_terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()),
      last_shown_(start_) {}

Progress::~Progress() {
  if (bar_shown_) std::fputc('\n', stderr);
}

void Progress::Update(int64_t done, double data_s, double distance_m) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  const int tenth = static_cast<int>(10 * done / total_);
  const bool due = on_terminal_ ? Seconds(now - last_shown_) >= kBarStep_s || done == total_
                                : tenth >= next_tenth_;
  if (!due) return;
  last_shown_ = now;
  next_tenth_ = tenth + 1;
  const double share = static_cast<double>(done) / static_cast<double>(total_);
  const double elapsed_s = std::max(Seconds(now - start_), 1e-6);
  const std::string figures =
      fmt::format("{:3.0f} %  {:.0f} images/s  {:.1f} x real time  {:.1f} m", 100 * share,
                  static_cast<double>(done) / elapsed_s, data_s / elapsed_s, distance_m);
  if (on_terminal_) {
    ShowBar(share, figures);
  } else {
    spdlog::info("{} {}", label_, figures);
  }
}

void Progress::ShowBar(double share, const std::string& figures) {
  const int filled = static_cast<int>(share * kBarColumns);
  const std::string bar = std::string(filled, '=') + std::string(kBarColumns - filled, ' ');
  std::fprintf(stderr, "\r\x1b[K%s [%s] %s", label_.c_str(), bar.c_str(), figures.c_str());
  std::fflush(stderr);
  bar_shown_ = true;
}

}  // namespace slcmap
