#include "mapping/planes/patch_sweeper.h"

#include <algorithm>

#include "mapping/dense/parallel.h"

namespace slcmap {
namespace {

constexpr int kViews = 16;  // that patches are seen best in, at once

int BestView(const AskedPatch* asked) { return asked->images.front().view; }

}  // namespace

PatchSweeper::PatchSweeper(const Views& views, const ViewImages& images, const SightDepths& depths,
                           const PlaneOptions& options, int threads)
    : views_(views),
      images_(images),
      depths_(depths),
      options_(options),
      threads_(threads),
      cameras_(views, images.rig()),
      pyramids_(views.size()) {}

bool PatchSweeper::Sweep(std::vector<AskedPlane>* planes, const Progress& progress) {
  std::vector<AskedPatch*> patches;
  for (AskedPlane& plane : *planes) {
    for (AskedPatch& asked : plane.patches) patches.push_back(&asked);
  }
  ParallelFor(0, patches.size(), threads_, [&](size_t i) { ChooseImages(patches[i]); });
  std::erase_if(patches, [](const AskedPatch* asked) { return asked->images.empty(); });
  std::stable_sort(patches.begin(), patches.end(), [](const AskedPatch* a, const AskedPatch* b) {
    return BestView(a) < BestView(b);
  });
  for (size_t begin = 0, end = 0; begin < patches.size(); begin = end) {
    if (!progress.Report(static_cast<double>(begin) / static_cast<double>(patches.size()))) {
      return false;
    }
    std::vector<int> needed;
    for (; end < patches.size() && BestView(patches[end]) < BestView(patches[begin]) + kViews;
         ++end) {
      for (const PatchImage& image : patches[end]->images) needed.push_back(image.view);
    }
    Load(std::move(needed));
    ParallelFor(begin, end, threads_, [&](size_t i) { SweepOne(patches[i]); });
  }
  return true;
}

void PatchSweeper::ChooseImages(AskedPatch* asked) const {
  asked->images = ImagesOfPatch(asked->patch, views_, cameras_, depths_, options_);
  if (static_cast<int>(asked->images.size()) < options_.min_images) asked->images.clear();
}

void PatchSweeper::Load(std::vector<int> needed) {
  std::sort(needed.begin(), needed.end());
  needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
  for (const int view : loaded_) {
    if (!std::binary_search(needed.begin(), needed.end(), view)) pyramids_[view] = {};
  }
  loaded_ = std::move(needed);
  ParallelFor(0, loaded_.size(), threads_, [&](size_t i) {
    std::array<DepthPyramid, 2>& pyramids = pyramids_[loaded_[i]];
    if (!pyramids[0].empty()) return;
    const StereoImage pair = images_.Read(loaded_[i]);
    pyramids = {DepthPyramid(pair.left), DepthPyramid(pair.right)};
  });
}

void PatchSweeper::SweepOne(AskedPatch* asked) const {
  std::vector<SeenPatch> seen;
  for (const PatchImage& image : asked->images) {
    const DepthPyramid& pyramid = pyramids_[image.view][image.camera];
    if (pyramid.empty()) continue;
    seen.push_back({&pyramid, cameras_.T_camera_world[image.view][image.camera]});
  }
  if (static_cast<int>(seen.size()) < options_.min_images) return;
  asked->sweep = SweepPatch(asked->patch, seen, images_.rig().cameras[0], options_);
}

}  // namespace slcmap
