// The main() of all test programs. What is skipped is not hidden among what passed: the program
// says at its end which cases were and why, and ends with kSkipped, which ctest shows as "Skipped".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/testing/watched_threads.h"

namespace {

constexpr int kSkipped = 77;  // SKIP_RETURN_CODE in tests/CMakeLists.txt

std::string ReasonOf(const testing::TestResult& result) {
  for (int i = 0; i < result.total_part_count(); ++i) {
    if (result.GetTestPartResult(i).skipped()) return result.GetTestPartResult(i).message();
  }
  return "";
}

// Prints a row for each skipped case, and returns how many there are.
int PrintSkipped(const testing::UnitTest& program) {
  int skipped = 0;
  for (int s = 0; s < program.total_test_suite_count(); ++s) {
    const testing::TestSuite& suite = *program.GetTestSuite(s);
    for (int t = 0; t < suite.total_test_count(); ++t) {
      const testing::TestInfo& test = *suite.GetTestInfo(t);
      if (!test.result()->Skipped()) continue;
      ++skipped;
      std::printf("skipped: %s.%s: %s\n", suite.name(), test.name(),
                  ReasonOf(*test.result()).c_str());
    }
  }
  return skipped;
}

}  // namespace

int main(int argc, char** argv) {
#ifdef SLCMAP_WATCH_THREADS
  slcmap::testing::RunOnWatchedThreads();
#endif
  testing::InitGoogleMock(&argc, argv);
  const int result = RUN_ALL_TESTS();
  if (testing::UnitTest::GetInstance()->test_to_run_count() == 0) {
    std::printf("no test of that name\n");
    return 1;
  }
  const int skipped = PrintSkipped(*testing::UnitTest::GetInstance());
  return result == 0 && skipped > 0 ? kSkipped : result;
}
