// Which axis points up in an OBJ file.
#pragma once

#include <string>

namespace slcmap {

struct ObjOptions {
  std::string up = "z";  // or "y", as many programs of modelling and games have it
  void Check() const;    // throws ConfigError
};

}  // namespace slcmap
