// The order in which a problem's normal equations are solved for its blocks.
#pragma once

#include <ceres/ordered_groups.h>
#include <ceres/problem.h>

#include <memory>
#include <vector>

namespace slcmap {

// The blocks of `first`, between any two of which there is no term, are group 0; those of `last`,
// which most others are tied to, come last of all. The others come by nested dissection of what the
// elimination of `first` ties together (METIS): where many visits of the same places hang together,
// as a building of rooms does, that fills the equations far less than a minimum degree does. The
// same problem is ordered alike each time, unless another thread calls rand() meanwhile. Throws
// Error where a term binds two blocks of `first`.
std::shared_ptr<ceres::ParameterBlockOrdering> EliminationOrder(const ceres::Problem& problem,
                                                                const std::vector<double*>& first,
                                                                const std::vector<double*>& last);

}  // namespace slcmap
