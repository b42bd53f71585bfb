// Names of AprilTags and ArUco tags, as control points have them: "tag36h11:5".
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slcmap::inline data {

struct TagName {
  int dictionary = -1;  // of OpenCV (cv::aruco::PREDEFINED_DICTIONARY_NAME); -1: not said
  int id = 0;
};

// What the dictionaries are called: "tag36h11" and the other families of AprilTag, "aruco4x4_50"
// and so on; their place is their number in OpenCV.
const std::vector<std::string>& TagFamilies();

// "tag36h11:5", or "5" of a family that is not said; nothing for the name of what is no tag.
std::optional<TagName> ParseTagName(const std::string& name);

}  // namespace slcmap::data
