// Where the images of a recording are kept: in files, or in a bag, where they have names as files
// have them. The images of a sequence decoded, and how the pixels of a camera's files are to be
// read, found from a sample of them.
#pragma once

#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline data {

// An image as it is kept.
struct KeptImage {
  std::string bytes;  // of a file, such as a PNG; "" where there are pixels
  cv::Mat pixels;     // grey of 8 or 16 bits, of an image that is kept as such; else empty
  const char* problem = nullptr;  // a kind of data/core/error.h where there is neither
};

// May be asked by several threads.
class ImageStore {
 public:
  virtual ~ImageStore() = default;

  virtual bool Has(const std::string& path) const = 0;

  virtual KeptImage Read(const std::string& path) const = 0;

  // What can be told to be wrong without decoding it: a kind of data/core/error.h, or nullptr. A
  // `size` that is empty is any.
  virtual const char* FindProblem(const std::string& path, const cv::Size& size) const = 0;

  // Whether two images are the same to the byte; not where one cannot be read.
  virtual bool IsSame(const std::string& a, const std::string& b) const = 0;

  // A text that is another one once the image was changed.
  virtual std::string State(const std::string& path) const = 0;
};

using SharedImageStore = std::shared_ptr<const ImageStore>;

// Images that are files, by their paths.
SharedImageStore FileImages();

// An image, or why there is none: problem is then one of the kinds of data/core/error.h.
struct ImageRead {
  cv::Mat image;  // 8 bit, one channel; empty where there is a problem
  const char* problem = nullptr;
};

// How the pixels of a file are to be read, the same for all images of a camera.
struct PixelForm {
  int bits = 16;        // of a 16-bit file that hold the value; the upper 8 of them are read
  bool mosaic = false;  // of colours (Bayer): made grey by a filter that takes as much of each
  bool dots = false;    // of an emitter's light, which are taken out (data/io/light_dots.h)
};

// Reads an image as 8-bit grey (16 bits lose their lower byte). A PNG without its last chunk and a
// JPEG without its end mark count as truncated, whatever could be decoded of them; bytes behind
// these are passed over, as is an orientation: pixels are as the sensor has stored them. An image
// of another size than `size` (any, where that is empty) is a problem too.
ImageRead ReadGrayImage(const ImageStore& images, const std::string& path, const cv::Size& size,
                        const PixelForm& form = {});
ImageRead ReadGrayImage(const std::string& path, const cv::Size& size, const PixelForm& form = {});

// An image with the depth and the channels of its file; empty where it cannot be decoded.
cv::Mat ReadStoredImage(const std::string& path);

// The grey of an image that is kept, of 8 or 16 bits as there are; empty where it cannot be
// decoded.
cv::Mat StoredGray(const KeptImage& kept);

// What can be told to be wrong by a file's header and end, without decoding it: a kind of
// data/core/error.h, or nullptr. The size is known of PNG and JPEG files only.
const char* FindImageProblem(const std::string& path, const cv::Size& size);

// The same of a file's bytes.
const char* FindProblemOfBytes(const std::string& bytes, const cv::Size& size);

// The same, but a PNG is only decoded by `decode`, which gives an empty image where its pixels are
// damaged; all other problems are found at once.
struct DeferredImageRead {
  std::function<cv::Mat()> decode;
  const char* problem = nullptr;
};
DeferredImageRead ReadGrayImageDeferred(const ImageStore& images, const std::string& path,
                                        const cv::Size& size, const PixelForm& form = {});

// What FindPixelForms counts.
inline constexpr const char* kImageFewBits = "images_of_fewer_bits_than_their_files";
inline constexpr const char* kImageMosaic = "images_that_are_a_colour_mosaic";
inline constexpr const char* kImageDots = "images_with_dots_of_an_emitter_taken_out";
inline constexpr const char* kImageOrientation = "images_with_an_orientation_taken_as_stored";

// Of the images of all cameras, in their order. 16-bit files whose values reach
// up to 2^8, 2^10, 2^12 or 2^14 at most, over all that is sampled, hold so many
// bits; a mosaic is told by levels that differ between the pixels of each 2 x 2, the same over
// whole areas. What is out of the usual is counted, once a camera, where warnings are given.
std::vector<PixelForm> FindPixelForms(const ImageStore& images,
                                      const std::vector<std::vector<std::string>>& paths,
                                      Warnings* warnings = nullptr);

// As PNG, 8 or 16 bit. Speed, not size, matters: it is read back soon.
std::string EncodePng(const cv::Mat& image);
// Throws OutputError.
void WritePng(const std::string& path, const cv::Mat& image);

}  // namespace slcmap::data
