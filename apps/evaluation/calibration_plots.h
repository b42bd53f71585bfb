// Plots of what a run found of its rig's calibration.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

// Draws a run folder's calibration.csv over time, an item a file: time_offset.svg (ms),
// imu_rotation.svg (degrees), lever.svg (mm), right_rotation.svg (degrees), focal_length.svg
// (percent) and right_centre.svg (px), into a folder, which is made where it is missing. Curves are
// corrections of what was given, bars their standard deviations to either side; items that were
// held have no file. The range is that of the last two thirds of the rows, and what lies beyond is
// drawn at its border. Returns the files' paths. Throws DataError where the table is not one,
// OutputError.
std::vector<std::string> WriteCalibrationPlots(const std::string& folder,
                                               const std::string& calibration_csv);

}  // namespace slcmap
