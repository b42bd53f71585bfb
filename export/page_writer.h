// A map as one HTML file that shows itself in a browser, offline.
#pragma once

#include <string>
#include <vector>

#include "data/progress.h"
#include "export/page_images.h"
#include "mapping/map.h"

namespace slcmap {

struct PageOptions {
  std::string title;    // of the page; "" for the map's id
  int compression = 6;  // of zlib: 1 quickest to 9 smallest
  void Check() const;   // throws ConfigError
};

// The page of a map, with pictures of keyframes where there are some: `page_template` is the bundle
// of export/page, in which the map, compressed and as base64, takes the place of a mark. Throws
// ConfigError where the template lacks the mark or has it twice, and StoppedError when progress
// says so.
std::string MakePage(const MapResult& map, const std::string& page_template,
                     const PageOptions& options, const std::vector<PageImage>& images = {},
                     const Progress& progress = {});

}  // namespace slcmap
