// One image of a sequence from its file.
#pragma once

#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>

namespace slcmap {

// An image, or why there is none: problem is then one of the kinds of data/warnings.h.
struct ImageRead {
  cv::Mat image;  // 8 bit, one channel; empty where there is a problem
  const char* problem = nullptr;
};

// How the pixels of a file are to be read, the same for all images of a camera.
struct PixelForm {
  int bits = 16;        // of a 16-bit file that hold the value; the upper 8 of them are read
  bool mosaic = false;  // of colours (Bayer): made grey by a filter that takes as much of each
};

// Reads an image as 8-bit grey (16 bits lose their lower byte). A PNG without its last chunk and a
// JPEG without its end mark count as truncated, whatever could be decoded of them; bytes behind
// these are passed over, as is an orientation: pixels are as the sensor has stored them. An image of
// another size than `size` (any, where that is empty) is a problem too.
ImageRead ReadGrayImage(const std::string& path, const cv::Size& size, const PixelForm& form = {});

// An image with the depth and the channels of its file; empty where it cannot be decoded.
cv::Mat ReadStoredImage(const std::string& path);

// Whether viewers show the image turned or mirrored, as its EXIF data ask for.
bool IsTurnedByOrientation(const std::string& path);

// What can be told to be wrong by the file's header and end, without decoding it: a kind of
// data/warnings.h, or nullptr. The size is known of PNG and JPEG files only.
const char* FindImageProblem(const std::string& path, const cv::Size& size);

// The same, but a PNG is only decoded by `decode`, which gives an empty image where its pixels are
// damaged; all other problems are found at once.
struct DeferredImageRead {
  std::function<cv::Mat()> decode;
  const char* problem = nullptr;
};
DeferredImageRead ReadGrayImageDeferred(const std::string& path, const cv::Size& size,
                                        const PixelForm& form = {});

}  // namespace slcmap
