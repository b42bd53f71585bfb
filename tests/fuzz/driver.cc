// Drives a fuzz target: every input of its corpus, then mutations of them until it has taken so
// many seconds of CPU, the same ones for the same seed.
//
//   fuzz                                  names the targets
//   fuzz NAME SECONDS [CORPUS [SEED]]     mutates; CORPUS "" for the target's own inputs alone
//   fuzz NAME FILE                        runs one input, such as a finding
//
// An input that crashes, takes more than ten seconds of CPU or more than 2 GB ends the program, and
// is left in finding-NAME-SEED-RUN.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <iostream>

#include "data/io/file.h"
#include "tests/fuzz/mutator.h"
#include "tests/fuzz/target.h"

namespace {

using slcmap::fuzz::Target;

constexpr int kCpuSecondsAnInput = 10;
constexpr long kMegabytes = 2048;

// For the signal handler.
std::string finding_path;
std::string current_input;

void KeepInput(int signal_number) {
  const int file = open(finding_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0 && write(file, current_input.data(), current_input.size()) >= 0) close(file);
  std::signal(signal_number, SIG_DFL);
  raise(signal_number);
}

// On a stack of its own, for where the other one has overflown. The address sanitizer reports what
// it finds before it aborts, so the other signals are its own there.
void HandleSignals() {
  static std::vector<char> stack(1 << 16);
  const stack_t other_stack{stack.data(), 0, stack.size()};
  sigaltstack(&other_stack, nullptr);
  struct sigaction action {};
  action.sa_handler = KeepInput;
  action.sa_flags = SA_ONSTACK;
  for (const int signal_number : {SIGABRT, SIGPROF}) sigaction(signal_number, &action, nullptr);
#ifndef __SANITIZE_ADDRESS__
  for (const int signal_number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) {
    sigaction(signal_number, &action, nullptr);
  }
#endif
}

// Of the processor's time, so that a busy machine makes no findings.
void LimitTime(int seconds) {
  itimerval limit{};
  limit.it_value.tv_sec = seconds;
  setitimer(ITIMER_PROF, &limit, nullptr);
}

void RunInput(const Target& target, const std::string& input) {
  current_input = input;
  LimitTime(kCpuSecondsAnInput);
  target.run(input);
  LimitTime(0);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  if (usage.ru_maxrss > kMegabytes * 1024) slcmap::fuzz::Finding("memory", "more than 2 GB");
}

std::vector<std::string> Corpus(const Target& target, const std::string& folder) {
  std::vector<std::string> inputs = target.seeds();
  if (folder.empty()) return inputs;
  for (std::string& input : slcmap::fuzz::CollectFiles(folder)) inputs.push_back(std::move(input));
  return inputs;
}

// Of all threads: time on the wall says nothing where other work takes the processor.
double CpuSeconds() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

int64_t MutateFor(double seconds, const Target& target, const std::vector<std::string>& corpus,
                  uint32_t seed) {
  slcmap::fuzz::Mutator mutator(seed);
  int64_t runs = 0;
  const double end_s = CpuSeconds() + seconds;
  for (; CpuSeconds() < end_s; ++runs) {
    finding_path =
        "finding-" + target.name + "-" + std::to_string(seed) + "-" + std::to_string(runs);
    RunInput(target, mutator.Mutate(corpus[mutator.Below(corpus.size())],
                                    corpus[mutator.Below(corpus.size())]));
  }
  return runs;
}

}  // namespace

// Under the address sanitizer a finding ends by a signal too.
extern "C" const char* __asan_default_options() {
  return "abort_on_error=1:hard_rss_limit_mb=2500";
}
extern "C" const char* __ubsan_default_options() { return "halt_on_error=1:abort_on_error=1"; }

int main(int argc, char** argv) {
  const std::vector<Target> targets = slcmap::fuzz::Targets();
  if (argc < 2) {
    for (const Target& target : targets) std::cout << target.name << "\n";
    return 0;
  }
  const auto found = std::ranges::find(targets, std::string(argv[1]), &Target::name);
  if (found == targets.end() || argc < 3) {
    std::cerr << "usage: " << argv[0] << " [NAME SECONDS [CORPUS [SEED]] | NAME FILE]\n";
    return 2;
  }
  const Target& target = *found;
  finding_path = "finding-" + target.name;
  if (std::filesystem::is_regular_file(argv[2])) {
    RunInput(target, slcmap::ReadFile(argv[2]));
    return 0;
  }
  HandleSignals();
  const std::vector<std::string> corpus = Corpus(target, argc > 3 ? argv[3] : "");
  if (corpus.empty()) {
    std::cerr << target.name << ": found no input, expected some in the corpus\n";
    return 2;
  }
  for (const std::string& input : corpus) RunInput(target, input);
  const uint32_t seed = argc > 4 ? static_cast<uint32_t>(std::stoul(argv[4])) : 1;
  const int64_t runs = MutateFor(std::stod(argv[2]), target, corpus, seed);
  std::cout << target.name << ": " << corpus.size() << " inputs and " << runs << " mutations in "
            << std::lround(CpuSeconds()) << " s of CPU\n";
}
