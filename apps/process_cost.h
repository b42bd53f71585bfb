// What this process has cost so far.
#pragma once

namespace slcmap {

struct ProcessCost {
  double cpu_s = 0;   // user + system, all threads
  double wall_s = 0;  // on a clock of its own zero
  double peak_memory_mib = 0;
};

ProcessCost CostSoFar();

}  // namespace slcmap
