// What a line is of.
#pragma once

#include "data/map_line.h"
#include "mapping/lines/line_options.h"
#include "mapping/lines/line_store.h"

namespace slcmap {

// By the surfaces beside it: an edge where they end or bend. What is on a flat surface is the
// outline of a thing on it if its step of brightness is large against how bright it is, and lasts
// unless it is larger still, as of narrow trims; else a mark: beside grain, joints and print the
// image is soon as bright as on the other side. A step that only grows away from the line is none
// of an edge, but of a shadow. What hardly stands out among many lines beside each other is a mark,
// where surfaces are known. Where the surfaces are not known, a line whose step lasts is of
// unknown kind.
LineKind KindOf(const TrackedLine& line, const LineKindOptions& options);

}  // namespace slcmap
