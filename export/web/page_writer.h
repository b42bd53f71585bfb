// A map as one HTML file that shows itself in a browser, offline.
#pragma once

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "export/web/page_data.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// The block: the length of the JSON document as a little-endian uint32, the document (UTF-8, padded
// by spaces to a multiple of 8 bytes), then the arrays, little-endian, each padded to a multiple of
// 8 bytes. The document's "arrays" gives type ("f64", "f32", "i32", "u16", "u8"), offset in bytes
// behind the document and number of values of each by its name.
//
// Coordinates are metres relative to the document's "origin" (in the world, z up), which keeps
// floats exact to a micrometre or so; "georeference" says where the world lies in a grid, as
// map.json has it. The dense cloud is in chunks of "chunk_m": coordinates are uint16 from a chunk's
// corner, 65535 for its far side, half a millimetre a step; in a chunk, points are in Morton order.
// Pictures are one behind the other in "image_bytes", the first from byte 0 to "image_end"[0]. A
// pipe is nine of "pipes": the ends of its axis, its radius, and the standard deviations of axis
// and radius. Throws StoppedError when progress says so.
std::string PackForPage(const MapResult& map, const std::string& title,
                        const std::vector<PageImage>& images = {}, const Progress& progress = {});

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

// The page of tilesets (tiles_writer.h), whose addresses are relative to its own: `page_template`
// is the other bundle of export/page. Throws ConfigError as MakePage.
std::string MakeTilesPage(const std::string& page_template,
                          const std::vector<std::string>& tilesets);

}  // namespace slcmap::exporting
