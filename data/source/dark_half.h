// Recordings of a depth camera whose emitter lights every other image.
#pragma once

#include <vector>

#include "data/core/error.h"
#include "data/io/image_store.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

// Leaves out the half of the images that show the emitter's dots, where every other one does, and
// counts it.
void KeepDarkHalf(const ImageStore& images, std::vector<StereoEntry>* pairs, Warnings* warnings);

}  // namespace slcmap::data
