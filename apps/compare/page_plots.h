// The plots of a comparison's page, as SVG elements for an HTML document.
#pragma once

#include <string>

#include "apps/compare/comparison.h"

namespace slcmap::inline evaluation {

// The colour of a sequence's method, by its index, in CSS.
std::string MethodColour(const SequenceResult& sequence, size_t method);

// What plots look like: for the page and, by itself, for those that are saved from it.
extern const char kPlotStyle[];

// A bar a method, on a logarithmic scale where one would hide the others, with its standard
// deviation as a whisker, and a line where `floor` is.
std::string BarPlot(const SequenceResult& sequence, const FigureInfo& figure, const double* floor);

// The paths from above: the truth below, the methods over it.
std::string PathPlot(const SequenceResult& sequence);

// The distance from the truth over time; "" without truth.
std::string ErrorPlot(const SequenceResult& sequence);

// The lines of one method over the true edges, from above.
std::string LineMapPlot(const SequenceResult& sequence, const MethodResult& method);

// Wall time by stage, a bar a method; "" without any.
std::string StagePlot(const SequenceResult& sequence);

}  // namespace slcmap::evaluation
