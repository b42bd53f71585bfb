#include "mapping/dense/depth_window.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/dense/depth_confirmation.h"
#include "mapping/dense/parallel.h"
#include "mapping/dense/stereo_depth.h"

namespace slcmap {
namespace {

constexpr std::size_t kBatch = 8;      // views read at once
constexpr double kMaxTurn_rad = 0.45;  // of a neighbour's optical axis
constexpr double kMinOffset_m = 0.08;  // of a neighbour: nearer ones say little of depth
// Between a view and its neighbours: a fifth to a tenth of usual depths, so that some see what is
// near and some measure what is far.
constexpr std::array<double, 4> kWantedOffsets_m = {0.25, 0.5, 0.8, 0.4};

double OpticalAxesAngle(const RigidTransform& a, const RigidTransform& b) {
  const Eigen::Vector3d axis_a = a.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis_b = b.rotation * Eigen::Vector3d::UnitZ();
  return std::acos(std::clamp(axis_a.dot(axis_b), -1.0, 1.0));
}

}  // namespace

std::vector<std::size_t> SelectDenseViews(const Views& views, const DenseOptions& options) {
  std::vector<std::size_t> selected;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!selected.empty() && views[selected.back()].segment == views[i].segment) {
      const RigidTransform& before = views[selected.back()].T_world_imu;
      const RigidTransform& now = views[i].T_world_imu;
      if ((now.translation - before.translation).norm() < options.min_travel_m &&
          now.rotation.angularDistance(before.rotation) < options.min_turn_rad) {
        continue;
      }
    }
    selected.push_back(i);
  }
  return selected;
}

DepthWindow::DepthWindow(const Views& views, const std::vector<std::size_t>& selected,
                         const ViewImages& images, const DenseOptions& options)
    : views_(views),
      selected_(selected),
      images_(images),
      options_(options),
      camera_(images.rig().cameras[0]) {}

std::vector<DepthWindow::ConfirmedView> DepthWindow::Next() {
  const std::size_t reach = options_.window_views, count = selected_.size();
  // How many of the selected views can be worked on when those before `known` are.
  const auto ready = [&](std::size_t known) {
    return known == count ? count : known - std::min(known, reach);
  };
  const std::size_t next_read = std::min(read_ + kBatch, count);
  window_.resize(next_read - first_);
  ParallelFor(read_, next_read, options_.threads, [&](std::size_t i) { Read(i); });
  for (std::size_t i = read_; i < next_read; ++i) without_images_ += At(i).left.empty() ? 1 : 0;
  read_ = next_read;

  const std::size_t next_refined = ready(read_);
  ParallelFor(refined_, next_refined, options_.threads, [&](std::size_t i) { Refine(i); });
  refined_ = next_refined;

  const std::size_t begin = confirmed_;
  std::vector<ConfirmedView> done(ready(refined_) - begin);
  ParallelFor(begin, begin + done.size(), options_.threads, [&](std::size_t i) {
    done[i - begin] = {selected_[i], Confirm(i)};
  });
  confirmed_ += done.size();
  for (; first_ + reach < confirmed_; ++first_) window_.pop_front();
  return done;
}

void DepthWindow::Read(std::size_t i) {
  WindowView& view = At(i);
  const View& source = views_[selected_[i]];
  view.T_world_camera = WorldFromCamera(source, images_.rig());
  view.segment = source.segment;
  const StereoImage pair = images_.Read(selected_[i]);
  view.depth = StereoDepth(pair, images_.mask(0), images_.rig(), options_);
  if (pair.left.empty() || pair.right.empty()) return;
  view.left = DepthPyramid(pair.left);
  view.right = DepthPyramid(pair.right);
}

std::vector<std::size_t> DepthWindow::Around(std::size_t i) const {
  const std::size_t reach = options_.window_views;
  std::vector<std::size_t> around;
  for (std::size_t j = i - std::min(i, reach); j <= i + reach && j < read_; ++j) {
    if (j != i && At(j).segment == At(i).segment && !At(j).left.empty()) around.push_back(j);
  }
  return around;
}

std::vector<std::size_t> DepthWindow::NeighboursOf(std::size_t i) const {
  std::vector<std::size_t> candidates;
  const auto offset_m = [&](std::size_t j) {
    return (At(j).T_world_camera.translation - At(i).T_world_camera.translation).norm();
  };
  for (const std::size_t j : Around(i)) {
    if (offset_m(j) >= kMinOffset_m &&
        OpticalAxesAngle(At(i).T_world_camera, At(j).T_world_camera) <= kMaxTurn_rad) {
      candidates.push_back(j);
    }
  }
  std::vector<std::size_t> neighbours;
  for (int k = 0; k < options_.neighbours && !candidates.empty(); ++k) {
    const double wanted_m = kWantedOffsets_m[k % kWantedOffsets_m.size()];
    const auto nearest =
        std::min_element(candidates.begin(), candidates.end(), [&](std::size_t a, std::size_t b) {
          return std::abs(std::log(offset_m(a) / wanted_m)) <
                 std::abs(std::log(offset_m(b) / wanted_m));
        });
    neighbours.push_back(*nearest);
    candidates.erase(nearest);
  }
  return neighbours;
}

void DepthWindow::Refine(std::size_t i) {
  WindowView& view = At(i);
  if (view.left.empty()) return;
  const Rig& rig = images_.rig();
  std::vector<NeighbourImage> neighbours = {
      {&view.right, rig.T_imu_camera[1].Inverse() * rig.T_imu_camera[0], options_.pair_sigma_px}};
  for (const std::size_t j : NeighboursOf(i)) {
    neighbours.push_back({&At(j).left, At(j).T_world_camera.Inverse() * view.T_world_camera,
                          options_.pose_sigma_px});
  }
  RefineDepth(view.left, neighbours, camera_, options_, &view.depth);
  view.right = DepthPyramid();
}

DepthGrid DepthWindow::Confirm(std::size_t i) const {
  std::vector<PlacedGrid> others;
  for (const std::size_t j : Around(i)) others.push_back({At(j).T_world_camera, &At(j).depth});
  return ConfirmedDepth({At(i).T_world_camera, &At(i).depth}, others, camera_, options_);
}

}  // namespace slcmap
