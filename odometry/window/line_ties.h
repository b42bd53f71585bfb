// How lines that may deviate from the axes of the building are tied to them, and to each other.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "odometry/structure/building_deviation.h"
#include "odometry/window/problem_builder.h"

namespace slcmap {

// Whether the angle between a line that may deviate and its axis or slope is larger than a limit.
bool IsOffAxis(const LineLandmark& line, double max_deviation_rad);

// Ties the directions of lines that may deviate from their axes by how much the building is known
// to, and to what they share with their neighbours.
void TieLines(const LineDeviations& deviations, WindowState* window);

// Shared deviations that no line will have any more once those of `gone` are forgotten are added to
// the terms by what was known of them, and their blocks to the dropped ones; ForgetShared() erases
// them once these lines are.
void ReleaseShared(const std::unordered_set<int64_t>& gone, WindowState* window,
                   std::vector<Term>* terms, std::vector<double*>* dropped);
void ForgetShared(WindowState* window);

// Finishes lines, but those exactly along their axes, that would become longer than is taken for
// straight with what the newest frame sees. Returns their ids.
std::unordered_set<int64_t> FinishPieces(const LineDeviations& deviations, const CostModel& model,
                                         WindowState* window);

}  // namespace slcmap
