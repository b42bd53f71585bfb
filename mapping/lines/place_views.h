// The views of which a line keeps places: a long recording shows it thousands of times, which tells
// nothing new and would not fit into memory.
#pragma once

#include <cstddef>

#include "mapping/lines/line_store.h"

namespace slcmap {

// To be called when a view's places, of which there may be none, were added behind the first
// `before` of a line. Keeps those of each view that shows it until they are of more than
// max_views; then of every second of these, and of those to come; and so on.
void LimitViews(size_t before, int max_views, TrackedLine* line);

}  // namespace slcmap
