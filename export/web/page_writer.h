// A map as one HTML file that shows itself in a browser, offline.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/source/sequence_source.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// As the page's scripts know the type of an array.
template <typename Value>
constexpr const char* PageType() {
  if constexpr (std::same_as<Value, double>) return "f64";
  if constexpr (std::same_as<Value, float>) return "f32";
  if constexpr (std::same_as<Value, int32_t>) return "i32";
  if constexpr (std::same_as<Value, uint16_t>) return "u16";
  if constexpr (std::same_as<Value, uint8_t>) return "u8";
}

// Arrays of numbers, one behind the other.
class PageArrays {
 public:
  static_assert(std::endian::native == std::endian::little, "pages are little-endian");

  struct Entry {
    std::string name, type;
    std::size_t offset = 0, count = 0;
  };

  template <typename Value>
  void Add(const std::string& name, const std::vector<Value>& values) {
    entries_.push_back({name, PageType<Value>(), bytes_.size(), values.size()});
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
    bytes_.append((kAlignment - bytes_.size() % kAlignment) % kAlignment, '\0');
  }

  const std::vector<Entry>& entries() const { return entries_; }
  const std::string& bytes() const { return bytes_; }

  static constexpr std::size_t kAlignment = 8;  // of the largest type

 private:
  std::vector<Entry> entries_;
  std::string bytes_;
};

// The dense cloud as a page holds it.

inline constexpr double kPageChunk_m = 32;

// A cube of edge kPageChunk_m and the points in it.
struct PageChunk {
  Eigen::Vector3d corner_m = Eigen::Vector3d::Zero();  // lowest, relative to the origin
  std::size_t from = 0, count = 0;
};

// Points by chunk and, in a chunk, in Morton order: neighbours in space are neighbours in the list.
struct PagePoints {
  std::vector<PageChunk> chunks;
  std::vector<uint16_t> x, y, z;  // from the chunk's corner, 65535 for its far side
  std::vector<uint8_t> grey, sigma, source;
};

// The code of a standard deviation: 16 log2(sigma / 0.1 mm), rounded, within a byte: to 2 % up to
// 6 m.
uint8_t SigmaCode(double sigma_m);

// Throws StoppedError when progress says so.
PagePoints ChunkPoints(const MapResult& map, const Eigen::Vector3d& origin_world,
                       const Progress& progress = {});

// Pictures of keyframes for a page.

// What the left camera saw at a keyframe, as the map's rectified camera would have.
struct PageImage {
  std::size_t keyframe = 0;  // its index in the map's
  std::string jpeg;
};

struct PageImageOptions {
  int most = 200;      // every n-th keyframe has a picture, so that there are at most as many
  int width_px = 400;  // at most; with `most` it keeps the pictures of a page below 8 MB
};

// The pictures of a map's keyframes out of the recording that it was made of; those of images that
// cannot be read are left out. Throws DataError where none can be, and StoppedError when progress
// says so.
std::vector<PageImage> ReadPageImages(const MapResult& map, const SequenceSource& recording,
                                      const PageImageOptions& options,
                                      const Progress& progress = {});

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

// The page of a map, by its id where the title is "", with pictures of keyframes where there are
// some: `page_template` is the bundle of export/page, in which the map, compressed and as base64,
// takes the place of a mark. Throws ConfigError where the template lacks the mark or has it twice,
// and StoppedError when progress says so.
std::string MakePage(const MapResult& map, const std::string& page_template,
                     const std::string& title, const std::vector<PageImage>& images = {},
                     const Progress& progress = {});

// The page of tilesets (WriteTiles), whose addresses are relative to its own: `page_template`
// is the other bundle of export/page. Throws ConfigError as MakePage.
std::string MakeTilesPage(const std::string& page_template,
                          const std::vector<std::string>& tilesets);

}  // namespace slcmap::exporting
