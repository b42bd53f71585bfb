// The pixels and files that messages of cameras hold.
#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "data/bag/messages.h"

namespace slcmap::inline data {

// How many bytes of pixels an image has by its size; nothing for an encoding without grey or
// colour, such as H.264.
std::optional<size_t> PixelBytes(const RosImage& image);

// Eight bits of grey, or the sixteen that are there; nothing as above. Throws DataError where there
// are fewer pixels than the size says.
std::optional<cv::Mat> GreyFrom(const RosImage& image);

// What the name of a file that begins so ends with: ".png" or ".jpg"; "" of others.
std::string ExtensionFor(std::string_view bytes);

}  // namespace slcmap::data
