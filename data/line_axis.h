// The directions of a building that lines run along.
#pragma once

namespace slcmap {

// The axis of a Manhattan world that a line runs along. Files hold these numbers.
enum class LineAxis { kX = 0, kY = 1, kVertical = 2, kNone = 3 };

}  // namespace slcmap
