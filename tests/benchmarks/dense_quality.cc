// Dense mapping of a simulated sequence with its true poses against its true surfaces: how many of
// the depths are right, stage by stage, and how long each stage takes.
//
//   dense_quality SEQ [OUTPUT [VIEWS]]     of the first VIEWS; writes OUTPUT/dense.ply and depth
//                                          images
#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/evaluation/surface_report.h"
#include "data/calibration.h"
#include "data/file.h"
#include "data/output_folder.h"
#include "mapping/dense/dense_file.h"
#include "mapping/dense/dense_map.h"
#include "mapping/dense/depth_refinement.h"
#include "mapping/dense/depth_window.h"
#include "mapping/dense/stereo_depth.h"
#include "mapping/views/recorded_views.h"

namespace slcmap {
namespace {

double Now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Depths against the true ones.
class DepthScore {
 public:
  void Add(const DepthGrid& grid, const Camera& camera, double baseline_m,
           const RigidTransform& T_world_camera, const TriangleTree& surfaces) {
    for (int row = 0; row < grid.rows; row += 3) {
      for (int column = 0; column < grid.columns; column += 3) {
        ++nodes_;
        const DepthNode& node = grid.At(column, row);
        if (!node.is_known()) continue;
        const Eigen::Vector3d ray =
            PinholeRay(camera, grid.ColumnPixel(column), grid.RowPixel(row));
        const double range_m = surfaces.FirstHit_m(
            T_world_camera.translation, (T_world_camera.rotation * ray).normalized(), 50);
        const double true_inverse = ray.norm() / range_m;
        const double error = std::abs(node.inverse_depth - true_inverse);
        const double error_px = error * baseline_m * camera.fx_px;
        const double error_m = std::abs(node.depth_m() - 1 / true_inverse);
        ++known_;
        quarter_ += error_px < 0.25;
        far_off_ += error_px > 3;
        near_ += error_m < 0.05;
        ten_ += error_m < 0.1;
        one_sigma_ += error < node.sigma;
        two_sigma_ += error < 2 * node.sigma;
      }
    }
  }

  void Print(const char* stage) const {
    const auto share = [&](int64_t n) { return 100.0 * static_cast<double>(n) / known_; };
    fmt::print(
        "{:<10} known {:.1f} %  within 0.25 px {:.1f}  off > 3 px {:.1f}  within 5 cm {:.1f}  10 "
        "cm {:.1f}  "
        "1 sigma {:.1f}  2 sigma {:.1f} %\n",
        stage, 100.0 * static_cast<double>(known_) / nodes_, share(quarter_), share(far_off_),
        share(near_), share(ten_), share(one_sigma_), share(two_sigma_));
  }

 private:
  int64_t nodes_ = 0, known_ = 0, quarter_ = 0, far_off_ = 0, near_ = 0, ten_ = 0, one_sigma_ = 0,
          two_sigma_ = 0;
};

void WriteDepthImage(const std::string& path, const DepthGrid& grid) {
  cv::Mat image(grid.rows, grid.columns, CV_8UC1, cv::Scalar(0)), coloured, large;
  for (std::size_t i = 0; i < grid.nodes.size(); ++i) {
    if (grid.nodes[i].is_known()) {
      image.data[i] =
          cv::saturate_cast<uint8_t>(40 + 150 * std::log(grid.nodes[i].depth_m()) / 1.6);
    }
  }
  cv::applyColorMap(image, coloured, cv::COLORMAP_JET);
  coloured.setTo(cv::Scalar(0, 0, 0), image == 0);
  cv::resize(coloured, large, {}, 4, 4, cv::INTER_NEAREST);
  cv::imwrite(path, large);
}

void Measure(const std::string& sequence, const std::string& output, std::size_t max_views) {
  Trajectory truth = ReadTrajectory(sequence + "/truth/trajectory.tum");
  RecordedViews recorded = ViewsOfRun(RunAtPoses(sequence, "", truth), "");
  if (recorded.views.size() > max_views) {
    recorded.views.resize(max_views);
    const int64_t last_ns = recorded.views.back().stamp_ns;
    std::erase_if(truth, [&](const StampedPose& pose) { return pose.stamp_ns > last_ns; });
  }
  const Rig& rig = recorded.images->rig();
  const double baseline_m =
      (rig.T_imu_camera[1].translation - rig.T_imu_camera[0].translation).norm();
  SurfaceInputs inputs{sequence + "/truth/surfaces.ply", "", "", ""};
  const TriangleTree surfaces(ReadSurfaces(inputs.true_surfaces));
  DenseOptions options;
  DepthScore stereo, stereo_refined, confirmed;
  double stereo_s = 0, refine_s = 0;
  const std::vector<std::size_t> selected = SelectDenseViews(recorded.views, options);
  for (std::size_t k = 0; k < selected.size(); k += 10) {
    const std::size_t i = selected[k];
    const StereoImage pair = recorded.images->Read(i);
    const RigidTransform T_world_camera = WorldFromCamera(recorded.views[i], rig);
    double start_s = Now_s();
    DepthGrid grid = StereoDepth(pair, recorded.images->mask(0), rig, options);
    stereo_s += Now_s() - start_s;
    stereo.Add(grid, rig.cameras[0], baseline_m, T_world_camera, surfaces);
    if (!output.empty() && k % 40 == 0) {
      WriteDepthImage(fmt::format("{}/sgbm_{:04}.png", output, i), grid);
      cv::imwrite(fmt::format("{}/left_{:04}.png", output, i), pair.left);
    }
    start_s = Now_s();
    const DepthPyramid left(pair.left), right(pair.right);
    RefineDepth(left, {{&right, rig.T_imu_camera[1].Inverse() * rig.T_imu_camera[0], 0.05}},
                rig.cameras[0], options, &grid);
    refine_s += Now_s() - start_s;
    stereo_refined.Add(grid, rig.cameras[0], baseline_m, T_world_camera, surfaces);
  }
  stereo.Print("matched");
  stereo_refined.Print("refined");
  fmt::print("stereo {:.0f} ms, refinement in the pair alone {:.0f} ms a view\n",
             1e4 * stereo_s / static_cast<double>(selected.size()),
             1e4 * refine_s / static_cast<double>(selected.size()));

  const double start_s = Now_s();
  double busy = 0;
  const DenseMap map = BuildDense(
      recorded.views, *recorded.images, options, {}, [&](std::size_t i, const DepthGrid& depth) {
        const double sink_s = Now_s();
        confirmed.Add(depth, rig.cameras[0], baseline_m, WorldFromCamera(recorded.views[i], rig),
                      surfaces);
        if (!output.empty() && i % 10 == 0)
          WriteDepthImage(fmt::format("{}/confirmed_{:04}.png", output, i), depth);
        busy += Now_s() - sink_s;
      });
  confirmed.Print("confirmed");
  fmt::print("{} views, {} points in {:.1f} s, {:.1f} s of recording\n", map.views,
             map.points.size(), Now_s() - start_s - busy,
             ToSeconds(truth.back().stamp_ns - truth.front().stamp_ns));
  if (output.empty()) return;
  inputs.cloud = output + "/dense.ply";
  WriteDensePly(inputs.cloud, map.points);
  const CloudMetricOptions cloud_options;
  const SurfaceMetrics metrics = EvaluateSurfaces(inputs, truth, {}, cloud_options, {});
  std::fputs(SurfaceTable(inputs, metrics, cloud_options).c_str(), stdout);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  cv::setNumThreads(1);
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::string output = argc > 2 ? argv[2] : "";
  if (!output.empty()) slcmap::MakeFolder(output);
  slcmap::Measure(argv[1], output, argc > 3 ? std::strtoul(argv[3], nullptr, 10) : SIZE_MAX);
}
