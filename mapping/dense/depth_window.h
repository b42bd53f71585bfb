// The depth of views in their order, with as many images in memory as look at one place.
#pragma once

#include <deque>
#include <vector>

#include "mapping/dense/dense_options.h"
#include "mapping/dense/depth_grid.h"
#include "mapping/dense/depth_refinement.h"
#include "mapping/views/view.h"

namespace slcmap {

// The views that are looked at: of each segment the first, and those far enough from the one
// before.
std::vector<std::size_t> SelectDenseViews(const Views& views, const DenseOptions& options);

class DepthWindow {
 public:
  // `selected`: indices of views. All arguments outlive the window.
  DepthWindow(const Views& views, const std::vector<std::size_t>& selected,
              const ViewImages& images, const DenseOptions& options);

  struct ConfirmedView {
    std::size_t view = 0;  // index of the view
    DepthGrid depth;
  };

  // Reads and matches the next selected views, as many as threads can share well. Returns those
  // whose depth is confirmed by now, in order; once is_done(), all have been returned.
  std::vector<ConfirmedView> Next();
  bool is_done() const { return confirmed_ == selected_.size(); }
  std::size_t read() const { return read_; }  // of the selected
  int64_t without_images() const { return without_images_; }

 private:
  struct WindowView {
    RigidTransform T_world_camera;
    int segment = 0;
    DepthPyramid left, right;  // the right one until the depth is refined
    DepthGrid depth;
  };

  WindowView& At(std::size_t i) { return window_[i - first_]; }
  const WindowView& At(std::size_t i) const { return window_[i - first_]; }
  void Read(std::size_t i);
  void Refine(std::size_t i);
  DepthGrid Confirm(std::size_t i) const;
  // Of the selected views around one, those of its segment.
  std::vector<std::size_t> Around(std::size_t i) const;
  std::vector<std::size_t> NeighboursOf(std::size_t i) const;

  const Views& views_;
  const std::vector<std::size_t>& selected_;
  const ViewImages& images_;
  const DenseOptions options_;
  const Camera camera_;  // the rectified left one
  std::deque<WindowView> window_;
  std::size_t first_ = 0;                               // of the window
  std::size_t read_ = 0, refined_ = 0, confirmed_ = 0;  // how many are
  int64_t without_images_ = 0;
};

}  // namespace slcmap
