// Dense mapping of a simulated sequence with its true poses against its true surfaces: how many of
// the depths are right, stage by stage, and how good the
// cloud and the occupancy are.
//
//   dense_quality SEQ [OUTPUT [VIEWS]]     of the first VIEWS; writes OUTPUT/dense.ply and depth
//                                          images
#include <spdlog/fmt/fmt.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/evaluation/surface_metrics.h"
#include "data/calibration/calibration.h"
#include "data/io/file.h"
#include "data/io/output_folder.h"
#include "mapping/dense/dense_map.h"
#include "mapping/dense/depth_refinement.h"
#include "mapping/map/part_files.h"
#include "mapping/views/recorded_views.h"
#include "mapping/views/stereo_depth.h"

namespace slcmap {
namespace {

double Cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Depths against the true ones.
class DepthScore {
 public:
  explicit DepthScore(const Rig& rig)
      : camera_(rig.cameras[0]),
        baseline_m_((rig.T_imu_camera[1].translation - rig.T_imu_camera[0].translation).norm()) {}

  void Add(const DepthGrid& grid, const RigidTransform& T_world_camera,
           const TriangleTree& surfaces) {
    for (int row = 0; row < grid.rows; row += 3) {
      for (int column = 0; column < grid.columns; column += 3) {
        ++nodes_;
        const DepthNode& node = grid.At(column, row);
        if (!node.is_known()) continue;
        const Eigen::Vector3d ray =
            PinholeRay(camera_, grid.ColumnPixel(column), grid.RowPixel(row));
        const double range_m = surfaces.FirstHit_m(
            T_world_camera.translation, (T_world_camera.rotation * ray).normalized(), 50);
        const double true_inverse = ray.norm() / range_m;
        const double error = std::abs(node.inverse_depth - true_inverse);
        const double error_px = error * baseline_m_ * camera_.fx_px;
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
  const Camera camera_;
  const double baseline_m_;
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

struct Opened {
  Trajectory truth;
  RecordedViews recorded;
  TriangleTree surfaces;
  std::string folder, output;

  const Rig& rig() const { return recorded.images->rig(); }
  RigidTransform GetCamera(std::size_t view) const {
    return WorldFromCamera(recorded.views[view], rig());
  }
};

Opened Open(const std::string& folder, const std::string& output, std::size_t max_views) {
  Trajectory truth = ReadTrajectory(folder + "/truth/trajectory.tum");
  RecordedViews recorded = ViewsOfRun(RunAtPoses(folder, {}, truth), folder);
  if (recorded.views.size() > max_views) {
    recorded.views.resize(max_views);
    const int64_t last_ns = recorded.views.back().stamp_ns;
    std::erase_if(truth, [&](const StampedPose& pose) { return pose.stamp_ns > last_ns; });
  }
  return {std::move(truth), std::move(recorded),
          TriangleTree(ReadSurfaces(folder + "/truth/surfaces.ply")), folder, output};
}

// Every tenth view alone: its match, and that refined by its own right image.
void MeasurePairs(const Opened& sequence, const DenseOptions& options) {
  DepthScore matched(sequence.rig()), refined(sequence.rig());
  const RigidTransform T_right_left =
      sequence.rig().T_imu_camera[1].Inverse() * sequence.rig().T_imu_camera[0];
  const std::vector<std::size_t> selected = SelectDenseViews(sequence.recorded.views, options);
  for (std::size_t k = 0; k < selected.size(); k += 10) {
    const std::size_t i = selected[k];
    const StereoImage pair = sequence.recorded.images->Read(i);
    DepthGrid grid = StereoDepth(pair, sequence.recorded.images->mask(0), sequence.rig(), options);
    matched.Add(grid, sequence.GetCamera(i), sequence.surfaces);
    if (!sequence.output.empty()) {
      WriteDepthImage(fmt::format("{}/matched_{:04}.png", sequence.output, i), grid);
      cv::imwrite(fmt::format("{}/left_{:04}.png", sequence.output, i), pair.left);
    }
    const DepthPyramid left(pair.left), right(pair.right);
    RefineDepth(left, {{&right, T_right_left, options.pair_sigma_px}}, sequence.rig().cameras[0],
                &grid);
    refined.Add(grid, sequence.GetCamera(i), sequence.surfaces);
  }
  matched.Print("matched");
  refined.Print("refined");
}

void MeasureMap(const Opened& sequence, const DenseOptions& options) {
  OccupancyOptions occupancy_options;
  occupancy_options.resolution_m = 0.05;
  occupancy_options.max_range_m = 8;
  DepthOccupancy occupancy(occupancy_options);
  DepthScore confirmed(sequence.rig());
  const double start_s = Cpu_s();
  double scoring_s = 0, carving_s = 0;
  const DenseMap map = BuildDense(
      sequence.recorded.views, *sequence.recorded.images, options, {},
      [&](std::size_t i, const DepthGrid& depth) {
        const double sink_s = Cpu_s();
        occupancy.Add(sequence.GetCamera(i), sequence.rig().cameras[0], depth);
        carving_s += Cpu_s() - sink_s;
        confirmed.Add(depth, sequence.GetCamera(i), sequence.surfaces);
        if (!sequence.output.empty() && i % 10 == 0) {
          WriteDepthImage(fmt::format("{}/confirmed_{:04}.png", sequence.output, i), depth);
        }
        scoring_s += Cpu_s() - sink_s;
      });
  const double dense_s = Cpu_s() - start_s - scoring_s;
  confirmed.Print("confirmed");
  fmt::print("{} views, {} points; CPU: depth and cloud {:.1f} s, carving {:.1f} s, for {:.1f} s\n",
             map.views, map.points.size(), dense_s, carving_s,
             ToSeconds(sequence.truth.back().stamp_ns - sequence.truth.front().stamp_ns));
  if (sequence.output.empty()) return;
  const SurfaceInputs inputs{sequence.folder + "/truth/surfaces.ply", "",
                             sequence.output + "/dense.ply", sequence.output + "/occupancy.bt"};
  WriteDensePly(inputs.cloud, map.points);
  occupancy.Finish(map.points, options.voxel_m).Write(inputs.occupancy);
  const CloudMetricOptions cloud_options;
  const SurfaceMetrics metrics = EvaluateSurfaces(inputs, sequence.truth, {}, cloud_options, {});
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
  const std::size_t max_views = argc > 3 ? std::strtoul(argv[3], nullptr, 10) : SIZE_MAX;
  const slcmap::Opened sequence = slcmap::Open(argv[1], output, max_views);
  const slcmap::DenseOptions options;
  slcmap::MeasurePairs(sequence, options);
  slcmap::MeasureMap(sequence, options);
}
