// How the pixels of a camera's image files are to be read, found from a sample of them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "data/image_file.h"
#include "data/warnings.h"

namespace slcmap {

// What FindPixelForms counts.
inline constexpr const char* kImageFewBits = "images_of_fewer_bits_than_their_files";
inline constexpr const char* kImageMosaic = "images_that_are_a_colour_mosaic";
inline constexpr const char* kImageOrientation = "images_with_an_orientation_taken_as_stored";

// Of the images of the left and the right camera, in their order. 16-bit files whose values reach
// up to 2^8, 2^10, 2^12 or 2^14 at most, over all that is sampled of both cameras, hold so many
// bits; a mosaic is told by levels that differ between the pixels of each 2 x 2, the same over
// whole areas. What is out of the usual is counted, once a camera, where warnings are given.
std::array<PixelForm, 2> FindPixelForms(const std::array<std::vector<std::string>, 2>& paths,
                                        Warnings* warnings = nullptr);

}  // namespace slcmap
