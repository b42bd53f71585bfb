// From landmarks to a point cloud.
#pragma once

#include <string>
#include <vector>

#include "data/progress.h"
#include "mapping/map.h"
#include "mapping/map_options.h"
#include "odometry/run.h"

namespace slcmap {

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

}  // namespace slcmap
