#include "export/plan/plan_options.h"

#include <spdlog/fmt/fmt.h>

#include "data/error.h"

namespace slcmap {

void PlanOptions::Check() const {
  constexpr int kLargest = 1000000;
  if (scale >= 0 && scale <= kLargest) return;
  throw ConfigError(
      fmt::format("plan scale: found 1:{}, expected 1:1 to 1:{}, or 0 to choose", scale, kLargest));
}

}  // namespace slcmap
