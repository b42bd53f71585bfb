// From the landmarks and lines of a run to those of a map: the point cloud, its lines, which lines
// its points lie on, and what keyframes saw of it.
#pragma once

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/io/map_line.h"
#include "mapping/map/map.h"
#include "mapping/map/options.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// The landmarks that are certain enough, finite and within 10,000 km, in their order.
std::vector<Landmark> SelectLandmarks(const std::vector<Landmark>& landmarks,
                                      const CloudOptions& options);

// One point for all landmarks that a segment has in a voxel: their mean, weighted by inverse
// variance. Segments are kept apart, since what moved between them is not known. Points are ordered
// by segment and voxel. The grid is not bounded, as that of PCL is (2^31 voxels: 64 m at 5 cm).
// Once progress says so, later landmarks are left out.
std::vector<MapPoint> FuseLandmarks(const std::vector<Landmark>& landmarks,
                                    const CloudOptions& options, const Progress& progress = {});

// Drops points whose mean distance to their nearest neighbours is more than outlier_sigmas standard
// deviations above the mean of those distances, as PCL's StatisticalOutlierRemoval does. A cloud
// with no more points than neighbours to look at stays as it is, and so does one that progress says
// to leave.
std::vector<MapPoint> RemoveOutliers(std::vector<MapPoint> points, const CloudOptions& options,
                                     const Progress& progress = {});

// Writes points as binary PCD with the fields x y z sigma_m (float) and observations (int). No
// points make a valid file too. Throws OutputError.
void WritePcd(const std::string& path, const std::vector<MapPoint>& points);

// Sets line_id of all points: the nearest line of those within three standard deviations of both
// together, and within 4 cm; -1 where there is none.
void FindLinesOfPoints(const std::vector<MapLine>& lines, std::vector<MapPoint>* points);

// What the run's keyframes saw of the landmarks that points were fused of, a track a landmark, in
// the images that a rig has (the run's own, or that of images rectified with the calibration that
// was found). The run's calibration is taken into account.
std::vector<MapPointObservation> CollectObservations(const std::vector<MapPoint>& points,
                                                     const OdometryRun& run, const Rig& rig);

// The run's lines that are certain enough, were seen often enough and have an extent, in their
// order.
std::vector<MapLine> SelectLines(const OdometryRun& run, const RunLineOptions& options);

// What the run knows of some of its lines. Of the direction of a line it knows only how well it is
// known where that is worst, so all directions across the line are given that; lines of which it
// does not know that have no covariance.
LineEvidence CollectEvidence(const std::vector<MapLine>& lines, const OdometryRun& run);

}  // namespace slcmap::mapping
