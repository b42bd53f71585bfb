// Which heights a grid for navigation is made of.
#pragma once

namespace slcmap {

struct GridOptions {
  // Over the floor: what is below a robot's wheels or above its head is in nobody's way.
  double low_m = 0.2, high_m = 1.8;
  void Check() const;  // throws ConfigError
};

}  // namespace slcmap
