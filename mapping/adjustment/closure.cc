#include "mapping/adjustment/closure.h"

namespace slcmap {
namespace {

constexpr double kEdgeGateSigmas = 3;

}  // namespace

std::vector<double> PathLengths(const AdjustmentState& state) {
  std::vector<double> lengths;
  for (size_t k = 0; k < state.frames.size(); ++k) {
    const bool goes_on =
        k > 0 && state.frames[k].keyframe->segment == state.frames[k - 1].keyframe->segment;
    const double step_m = goes_on ? (PoseFromBlock(state.frames[k].pose).translation -
                                     PoseFromBlock(state.frames[k - 1].pose).translation)
                                        .norm()
                                  : 0;
    lengths.push_back(goes_on ? lengths.back() + step_m : 0);
  }
  return lengths;
}

ShiftSigma SigmaOver(double path_m, const ClosureOptions& options) {
  return {(options.gate_m + options.gate_per_m * path_m) / kEdgeGateSigmas,
          (options.gate_rad + options.gate_rad_per_m * path_m) / kEdgeGateSigmas};
}

bool IsUnique(const Agreement& agreement, int min_votes, const ClosureOptions& options) {
  return agreement.votes >= min_votes && agreement.votes >= options.min_lead * agreement.runner_up;
}

}  // namespace slcmap
