// The forms of other_calibrations.h: readers, a program each, and what they share.
#pragma once

#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "data/calibration/camera_words.h"
#include "data/calibration/rig_parts.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {

using Rows3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// What is gathered of several files.
struct Gathered {
  RigParts parts;                 // of the file that is read
  size_t cameras = 0;             // that files without a place of their own told
  std::vector<CameraInfo> infos;  // ROS': poses need both
  Mirrored mirrored = Mirrored::kRefused;
  Warnings* warnings = nullptr;
};

// The left camera, then the right one; a third is an InputFault.
void TakeCamera(const Camera& camera, const std::string& place, Gathered* gathered);

// All of them must be there.
std::vector<double> ReadNumbers(YamlSection* section, const std::vector<std::string>& keys);
cv::Size ReadSize(YamlSection* section, const std::string& width, const std::string& height);

// Of nine and three numbers.
RigidTransform FromRows(const std::vector<double>& rotation, const std::vector<double>& translation,
                        const std::string& place);

void ReadOrbSlam(YamlSection* root, Gathered* gathered);
void ReadVins(YamlSection* root, Gathered* gathered);
void ReadVinsCameraFile(YamlSection* root, Gathered* gathered);
void ReadBasalt(YamlSection* file, Gathered* gathered);

}  // namespace slcmap::data
