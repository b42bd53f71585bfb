// What axes of lines are called in files.
#pragma once

#include "data/types.h"

namespace slcmap {

inline const char* AxisName(LineAxis axis) {
  switch (axis) {
    case LineAxis::kX:
      return "along x";
    case LineAxis::kY:
      return "along y";
    case LineAxis::kVertical:
      return "vertical";
    case LineAxis::kSloped:
      return "sloped";
    case LineAxis::kNone:
      break;
  }
  return "of no axis";
}

}  // namespace slcmap
