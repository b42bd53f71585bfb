// Asks the images of all patches, with few images in memory.
#pragma once

#include <array>
#include <vector>

#include "data/progress.h"
#include "mapping/planes/asked_planes.h"

namespace slcmap {

class PatchSweeper {
 public:
  // All arguments outlive it.
  PatchSweeper(const Views& views, const ViewImages& images, const SightDepths& depths,
               const PlaneOptions& options, int threads);

  // Sets images and sweep of each patch of the planes. Returns whether it came to its end; progress
  // may end it before.
  bool Sweep(std::vector<AskedPlane>* planes, const Progress& progress);

 private:
  void ChooseImages(AskedPatch* asked) const;
  void Load(std::vector<int> needed);
  void SweepOne(AskedPatch* asked) const;

  const Views& views_;
  const ViewImages& images_;
  const SightDepths& depths_;
  const PlaneOptions& options_;
  const int threads_;
  const ViewCameras cameras_;
  std::vector<std::array<DepthPyramid, 2>> pyramids_;  // by view; most are empty
  std::vector<int> loaded_;
};

}  // namespace slcmap
