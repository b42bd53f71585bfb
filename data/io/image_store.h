// Where the images of a recording are kept: in files, or in a bag, where they have names as files
// have them.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

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

}  // namespace slcmap::data
