// What happens to the points of a window: they are registered, triangulated from everything that
// has seen them, judged and described.
#pragma once

#include <optional>
#include <unordered_set>
#include <utility>

#include "odometry/run/run.h"
#include "odometry/window/marginalization.h"
#include "odometry/window/options.h"
#include "odometry/window/problem.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {

// The inverse depth (1 / m, in the host's left camera) that fits all measurements of the landmark
// best: linear least squares, then Gauss-Newton on the reprojections. Nothing where the rays are
// too parallel, the point lies behind a camera, or the fit is poor.
std::optional<double> TriangulateInverseDepth(const PointLandmark& landmark,
                                              const StereoGeometry& geometry,
                                              const PointTriangulationOptions& options);

// Adds the frame to every landmark that it measures; new landmarks are made.
void RegisterPoints(FrameState* frame, WindowState* window);

// Triangulates what is not yet, where its observations allow it.
void TriangulatePoints(const PointTriangulationOptions& options, const StereoGeometry& geometry,
                       WindowState* window);

// Squared whitened residuals of one observation, left and right apart (right 0 where it was not
// seen).
std::pair<double, double> ObservationChi2(const PointLandmark& landmark, const FrameState& frame,
                                          const CostModel& model);

// Rejects observations whose squared residual in one camera is above the limit, and the landmarks
// that have mostly such; returns the ids of these. `fit` becomes that of all observations.
std::unordered_set<int64_t> RejectPointOutliers(double max_chi2, const CostModel& model,
                                                WindowState* window, PointFit* fit = nullptr);

// Expresses a landmark in the next frame that saw it and forgets the observation of its host. False
// where that frame has it not in front of its camera.
bool Rehost(const StereoGeometry& geometry, PointLandmark* landmark);

// RMS of the whitened reprojection residuals of all landmarks.
double ReprojectionRms(const CostModel& model, const WindowState& window);
int TriangulatedCount(const WindowState& window);

// A triangulated landmark as a run holds it, but for its segment. Its sigma is kUnknownSigma_m
// where the window does not know it.
Landmark Describe(const PointLandmark& landmark, const CostModel& model,
                  const WindowCovariance& window);

}  // namespace slcmap::odometry
