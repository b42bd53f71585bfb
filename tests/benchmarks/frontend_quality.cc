// How accurate, long and cheap the tracks of the points are on a recording with true poses.
//
//   frontend_quality SEQUENCE [first_frame frames [folder_for_pictures]]
//
// SEQUENCE is a folder in EuRoC's layout. All tracks are bundle-adjusted together with the camera
// poses, which start from and are held loosely at the true ones (the true rotations of real
// recordings are not exact to a pixel); what remains of the residuals is the error of the tracks.
#include <ceres/ceres.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "data/io/trajectory.h"
#include "data/source/asl_source.h"
#include "data/source/sequence.h"
#include "odometry/frontend/point_tracker.h"
#include "odometry/frontend/rectifier.h"
#include "tests/benchmarks/stage_clocks.h"

namespace slcmap {
namespace {

struct View {
  int frame = 0;
  int camera = 0;
  int age = 0;
  Eigen::Vector2d px;
};

struct Track {
  std::vector<View> views;
  Eigen::Vector3d p_world;
};

struct ReprojectionError {
  ReprojectionError(const Camera& camera, const RigidTransform& T_camera_imu,
                    const Eigen::Vector2d& px)
      : camera(camera), T_camera_imu(T_camera_imu), px(px) {}
  template <typename T>
  bool operator()(const T* q, const T* t, const T* p, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> R_world_imu(q);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> p_world_imu(t), p_world(p);
    const Eigen::Matrix<T, 3, 1> p_imu = R_world_imu.conjugate() * (p_world - p_world_imu);
    const Eigen::Matrix<T, 3, 1> p_camera =
        T_camera_imu.rotation.cast<T>() * p_imu + T_camera_imu.translation.cast<T>();
    if (p_camera.z() < T(0.05)) return false;
    residual[0] = p_camera.x() / p_camera.z() * camera.fx_px + camera.cx_px - px.x();
    residual[1] = p_camera.y() / p_camera.z() * camera.fy_px + camera.cy_px - px.y();
    return true;
  }
  Camera camera;
  RigidTransform T_camera_imu;
  Eigen::Vector2d px;
};

struct PosePrior {
  RigidTransform T;
  template <typename T_>
  bool operator()(const T_* q, const T_* t, T_* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T_>> R(q);
    const Eigen::Map<const Eigen::Matrix<T_, 3, 1>> p(t);
    Eigen::Map<Eigen::Matrix<T_, 6, 1>> r(residual);
    const Eigen::Quaternion<T_> d = T.rotation.cast<T_>().conjugate() * R;
    const T_ sign(d.w() < T_(0) ? -1.0 : 1.0);
    r.template head<3>() = (p - T.translation.cast<T_>()) / T_(0.02);
    r.template tail<3>() = sign * T_(2) * d.vec() / T_(0.01);
    return true;
  }
};

class Benchmark {
 public:
  // pictures: a folder for images of the tracks, or empty.
  Benchmark(const std::string& path, const std::string& pictures)
      : pictures_(pictures),
        sequence_(OpenSequence(path)),
        rectifier_(sequence_.rig, RectifierOptions()),
        truth_(ReadTrajectory(sequence_.truth_path)) {}

  void Run(int first, int frames) {
    TrackAll(first, frames);
    Adjust();
    Report();
  }

 private:
  void TrackAll(int first, int frames) {
    cv::setNumThreads(1);
    PointTracker tracker(PointTrackerOptions(), rectifier_.rectified_rig(), rectifier_.mask(0));
    StereoReader reader(sequence_);
    for (int i = 0; i < first + frames; ++i) {
      const auto pair = reader.Next();
      if (!pair) return;
      const auto pose = PoseAt(truth_, pair->stamp_ns);
      if (pose && i >= first) AddFrame(&tracker, pair->left, pair->decode_right(), *pose);
    }
  }

  void AddFrame(PointTracker* tracker, const cv::Mat& raw_left, const cv::Mat& raw_right,
                const RigidTransform& T_world_imu) {
    const cv::Mat left = clocks_.Run("rectify", [&] { return rectifier_.Rectify(raw_left, 0); });
    const cv::Mat right = clocks_.Run("rectify", [&] { return rectifier_.Rectify(raw_right, 1); });
    const Eigen::Quaterniond R_imu_camera = rectifier_.rectified_rig().T_imu_camera[0].rotation;
    Eigen::Quaterniond R_now_previous = Eigen::Quaterniond::Identity();
    if (!poses_.empty()) {
      R_now_previous = (T_world_imu.rotation * R_imu_camera).conjugate() *
                       (poses_.back().rotation * R_imu_camera);
    }
    poses_.push_back(T_world_imu);
    const size_t before = tracker->observations().size();
    clocks_.Run("track", [&] { tracker->Track(left, R_now_previous); });
    lost_ += before - tracker->observations().size();
    followed_ += before;
    const int frame = static_cast<int>(poses_.size()) - 1;
    if (frame % 4 == 0) clocks_.Run("detect", [&] { tracker->Detect(right); });
    for (const auto& p : tracker->observations()) Record(frame, p);
    if (!pictures_.empty()) Draw(frame, left, right);
  }

  void Record(int frame, const PointObservation& p) {
    Track& track = tracks_[p.id];
    const int age = track.views.empty() ? 0 : frame - track.views.front().frame;
    track.views.push_back({frame, 0, age, p.left_px});
    if (p.right_px) track.views.push_back({frame, 1, age, *p.right_px});
    ++points_;
    if (p.right_px) ++right_points_;
  }

  void Draw(int frame, const cv::Mat& left, const cv::Mat& right) const {
    cv::Mat both;
    cv::hconcat(left, right, both);
    cv::cvtColor(both, both, cv::COLOR_GRAY2BGR);
    for (const auto& [id, t] : tracks_) {
      if (t.views.back().frame != frame) continue;
      const cv::Scalar color(id * 71 % 200 + 55, id * 37 % 200 + 55, id * 113 % 200 + 55);
      cv::Point last(-1, -1);
      for (const auto& v : t.views) {
        const cv::Point at(std::lround(v.px.x()) + v.camera * left.cols, std::lround(v.px.y()));
        if (v.frame == frame) cv::circle(both, at, 3, color, 1);
        if (v.camera) continue;
        if (last.x >= 0) cv::line(both, last, at, color, 1);
        last = at;
      }
    }
    cv::imwrite(pictures_ + "/" + std::to_string(1000 + frame) + ".png", both);
  }

  // Triangulates linearly from all views with the current poses, then refines.
  bool Triangulate(Track* track) const {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const auto& v : track->views) {
      const RigidTransform T = poses_[v.frame] * Rectified().T_imu_camera[v.camera];
      const Eigen::Vector3d ray = T.rotation * *Rectified().cameras[v.camera].Unproject(v.px);
      const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - ray * ray.transpose();
      H += P;
      b += P * T.translation;
    }
    track->p_world = H.ldlt().solve(b);
    for (const auto& v : track->views) {
      if (PointInCamera(*track, v).z() < 0.1) return false;
    }
    return true;
  }

  Eigen::Vector3d PointInCamera(const Track& t, const View& v) const {
    return (poses_[v.frame] * Rectified().T_imu_camera[v.camera]).Inverse() * t.p_world;
  }

  const Rig& Rectified() const { return rectifier_.rectified_rig(); }

  void Adjust() {
    for (auto it = tracks_.begin(); it != tracks_.end();) {
      const bool usable = it->second.views.size() >= 6;
      if (!usable) ++short_;
      if (usable && !Triangulate(&it->second)) {
        bad_views_ += it->second.views.size();
        ++bad_;
        it = tracks_.erase(it);
      } else {
        it = usable ? std::next(it) : tracks_.erase(it);
      }
    }
    true_poses_ = poses_;
    ceres::Problem problem;
    for (size_t i = 0; i < poses_.size(); ++i) {
      double* q = poses_[i].rotation.coeffs().data();
      double* t = poses_[i].translation.data();
      problem.AddParameterBlock(q, 4, new ceres::EigenQuaternionManifold);
      problem.AddParameterBlock(t, 3);
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PosePrior, 6, 4, 3>(new PosePrior{poses_[i]}), nullptr, q,
          t);
    }
    for (auto& [id, track] : tracks_) {
      for (const auto& v : track.views) {
        problem.AddResidualBlock(
            new ceres::AutoDiffCostFunction<ReprojectionError, 2, 4, 3, 3>(new ReprojectionError(
                Rectified().cameras[v.camera], Rectified().T_imu_camera[v.camera].Inverse(), v.px)),
            new ceres::CauchyLoss(0.5), poses_[v.frame].rotation.coeffs().data(),
            poses_[v.frame].translation.data(), track.p_world.data());
      }
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_SCHUR;
    options.max_num_iterations = 8;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }

  Eigen::Vector2d Residual(const Track& t, const View& v) const {
    const Eigen::Vector3d p = PointInCamera(t, v);
    if (p.z() < 0.05) return {1e3, 1e3};
    return *Rectified().cameras[v.camera].Project(p) - v.px;
  }

  void Report() const {
    struct Group {
      std::vector<double> x, y, norm;
      void Add(const Eigen::Vector2d& r) {
        x.push_back(std::abs(r.x()));
        y.push_back(std::abs(r.y()));
        norm.push_back(r.norm());
      }
      static double Quantile(std::vector<double> v, double q) {
        if (v.empty()) return 0;
        std::sort(v.begin(), v.end());
        return v[static_cast<size_t>(q * (v.size() - 1))];
      }
      void Print(const char* name) const {
        double in = 0, n = 0, out = 0, gross = 0;
        for (double r : norm) {
          if (r > 1.5) ++out;
          if (r > 3) ++gross;
          if (r <= 3) in += r * r, ++n;
        }
        printf(
            "%-12s n %7zu  median %.3f  q90 %.3f  rms/axis(<3px) %.3f  sigma(MAD) x %.3f y %.3f  "
            ">1.5px %.2f%%  >3px %.2f%%\n",
            name, norm.size(), Quantile(norm, 0.5), Quantile(norm, 0.9),
            std::sqrt(in / std::max(1.0, n) / 2), 1.4826 * Quantile(x, 0.5),
            1.4826 * Quantile(y, 0.5), 100 * out / norm.size(), 100 * gross / norm.size());
      }
    };
    Group all[2], by_age[6];
    const int limits[] = {2, 8, 20, 50, 100, 1 << 30};
    double length = 0, n_tracks = 0;
    std::vector<double> lengths;
    for (const auto& [id, t] : tracks_) {
      for (const auto& v : t.views) {
        const Eigen::Vector2d r = Residual(t, v);
        all[v.camera].Add(r);
        if (v.camera == 0) {
          int bucket = 0;
          while (v.age >= limits[bucket]) ++bucket;
          by_age[bucket].Add(r);
        }
      }
      length += t.views.back().age + 1;
      lengths.push_back(t.views.back().age + 1);
      ++n_tracks;
    }
    const double frames = poses_.size();
    printf("image %d x %d, %g frames\n", Rectified().cameras[0].width_px,
           Rectified().cameras[0].height_px, frames);
    printf(
        "points/frame %.1f, with right %.1f%%; tracks %g (+%d short, +%d untriangulable with %d "
        "views), mean length %.1f, "
        "median %.0f; lost/frame %.2f%%\n",
        points_ / frames, 100. * right_points_ / points_, n_tracks, short_, bad_, bad_views_,
        length / n_tracks, Group::Quantile(lengths, 0.5), 100. * lost_ / std::max(1, followed_));
    all[0].Print("left");
    all[1].Print("right");
    const char* names[] = {"age<2", "<8", "<20", "<50", "<100", ">=100"};
    for (int i = 0; i < 6; ++i) {
      if (!by_age[i].norm.empty()) by_age[i].Print(names[i]);
    }
    double drift = 0;
    for (size_t i = 0; i < poses_.size(); ++i) {
      drift += (poses_[i].translation - true_poses_[i].translation).squaredNorm();
    }
    printf("poses moved by %.2f mm RMS\n", 1e3 * std::sqrt(drift / frames));
    printf("CPU ms: rectify %.2f a pair, track %.2f a frame, detect %.2f a call\n",
           2 * clocks_.Mean_ms("rectify"), clocks_.Mean_ms("track"), clocks_.Mean_ms("detect"));
  }

  std::string pictures_;
  Sequence sequence_;
  Rectifier rectifier_;
  Trajectory truth_;
  std::vector<RigidTransform> poses_, true_poses_;
  std::map<int64_t, Track> tracks_;
  StageClocks clocks_;
  int lost_ = 0, followed_ = 0, points_ = 0, right_points_ = 0, short_ = 0, bad_ = 0,
      bad_views_ = 0;
};

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc < 2) {
    fprintf(stderr,
            "usage: frontend_quality SEQUENCE [first_frame frames [folder_for_pictures]]\n");
    return 2;
  }
  const int first = argc > 3 ? std::atoi(argv[2]) : 0;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 1 << 20;
  slcmap::Benchmark(argv[1], argc > 4 ? argv[4] : "").Run(first, frames);
}
