// How far a simulated building is from plumb, straight and parallel.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

// The section `inexact` of a scene.
struct InexactOptions {
  double amount = 0;  // 0: the exact building; 1: about as far as building tolerances let pass
  int seed = 1;       // chooses the deviations; another amount scales the same ones

  void Read(YamlSection section);
  void Check() const;  // throws ConfigError
};

}  // namespace slcmap
