// In which form PLY files are written.
#pragma once

#include "data/ply.h"

namespace slcmap {

struct PlyOptions {
  bool ascii = false;  // as text, for scripts; up to two and a half times as large
  PlyForm form() const { return ascii ? PlyForm::kAscii : PlyForm::kBinary; }
};

}  // namespace slcmap
