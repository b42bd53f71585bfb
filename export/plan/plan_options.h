// Options of drawn plans.
#pragma once

namespace slcmap {

struct PlanOptions {
  // 1 : scale, for all storeys; 0: 1:50 where a sheet of A2 holds each storey, else 1:100, and
  // smaller only where A0 does not.
  int scale = 0;
  bool wall_sigma = false;  // write the standard deviation of its face beside each wall
  void Check() const;       // throws ConfigError
};

}  // namespace slcmap
