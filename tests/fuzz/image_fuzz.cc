// Image files, read at once and deferred.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "data/io/image.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  cv::Mat image(12, 16, CV_8U);
  cv::randu(image, 0, 255);
  std::vector<std::string> seeds;
  for (const char* ending : {".jpg", ".tiff", ".bmp"}) {
    std::vector<uint8_t> bytes;
    cv::imencode(ending, image, bytes);
    seeds.emplace_back(bytes.begin(), bytes.end());
  }
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("image", bytes, size);
  fuzz::Refusing([&] { ReadGrayImage(path, {16, 12}); });
  fuzz::Refusing([&] {
    const DeferredImageRead read = ReadGrayImageDeferred(path, {16, 12});
    if (read.decode) read.decode();
  });
  return 0;
}
