#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "data/core/error.h"
#include "export/plan/section_view.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

void PlanOptions::Check() const {
  constexpr int kLargest = 1000000;
  if (scale < 0 || scale > kLargest) {
    throw ConfigError(fmt::format("plan scale: found 1:{}, expected 1:1 to 1:{}, or 0 to choose",
                                  scale, kLargest));
  }
  if (north_deg && !(std::abs(*north_deg) <= 360)) {
    throw ConfigError(
        fmt::format("plan north: found {} degrees, expected -360 to 360: clockwise "
                    "from up on the sheet",
                    *north_deg));
  }
  CheckSections(*this);
}

}  // namespace slcmap::exporting
