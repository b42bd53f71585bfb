// Which headings of a building are found on simulated recordings, when, and how exactly; and how
// many segments get the right axis.
//
//   manhattan_quality SEQUENCE [tilt_deg [drift_deg_per_min]]
//
// SEQUENCE is a folder in EuRoC's layout with truth/trajectory.tum and truth/edges.csv beside mav0.
// Every fifth image is taken as a keyframe. Its true rotation is tilted by tilt_deg about an axis
// that turns slowly, and turned about the vertical by the drift. A segment's true direction is that
// of the true edge whose image it lies on, where all such edges have the same.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <vector>

#include "apps/evaluation/truth.h"
#include "data/core/math.h"
#include "data/io/image.h"
#include "data/io/trajectory.h"
#include "data/source/sequence.h"
#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/structure/manhattan_detector.h"
#include "tests/benchmarks/stage_clocks.h"

namespace slcmap {
namespace {

constexpr int kEvery = 5;

Eigen::Vector3d GetDirection(const EdgeRow& edge) {
  return (edge.whole.end_world - edge.whole.start_world).normalized();
}

// The angle between two headings that repeat after a quarter turn, in degrees, signed.
double HeadingError(double heading_rad, double true_rad) {
  const double quarter = std::numbers::pi / 2;
  const double d = heading_rad - true_rad;
  return (d - quarter * std::round(d / quarter)) / kDegree;
}

class Benchmark {
 public:
  Benchmark(const std::string& path, double tilt_rad, double drift_rad_s)
      : tilt_rad_(tilt_rad),
        drift_rad_s_(drift_rad_s),
        sequence_(OpenSequence(path)),
        rectifier_(sequence_.rig, RectifierOptions()),
        camera_(rectifier_.rectified_rig().cameras[0]),
        truth_(ReadTrajectory(path + "/truth/trajectory.tum")),
        edges_(ReadEdgeTable(path + "/truth/edges.csv")),
        detector_(ManhattanOptions(), LineClassifierOptions().end_sigma_px, camera_.fx_px),
        classifier_(LineClassifierOptions(), camera_.fx_px) {
    for (const EdgeRow& edge : edges_) {
      if (edge.axis == 0 || edge.axis == 1) AddTrueHeading(GetDirection(edge));
    }
  }

  void Run() {
    std::printf("%s: true headings", sequence_.folder.c_str());
    for (const double heading_rad : true_headings_) std::printf(" %.2f", heading_rad / kDegree);
    std::printf(" degrees\n");
    for (size_t i = 0; i < sequence_.images.size(); i += kEvery) {
      const StereoEntry& entry = sequence_.images[i];
      const auto pose = PoseAt(truth_, entry.stamp_ns);
      const ImageRead read = ReadGrayImage(entry.left_path, cv::Size());
      if (!pose || read.problem) continue;
      AddImage(rectifier_.Rectify(read.image, 0), entry.stamp_ns, *pose);
    }
    Report();
  }

 private:
  void AddTrueHeading(const Eigen::Vector3d& d) {
    const double heading_rad = std::atan2(d.y(), d.x());
    const bool known = std::any_of(true_headings_.begin(), true_headings_.end(), [&](double h) {
      return std::abs(HeadingError(heading_rad, h)) < 1;
    });
    if (!known) true_headings_.push_back(heading_rad);
  }

  void AddImage(const cv::Mat& image, int64_t stamp_ns, const RigidTransform& T_world_imu) {
    const double t_s = ToSeconds(stamp_ns - sequence_.images.front().stamp_ns);
    const RigidTransform T_world_camera = T_world_imu * rectifier_.rectified_rig().T_imu_camera[0];
    const Eigen::Vector3d tilt_axis(std::cos(0.1 * t_s), std::sin(0.1 * t_s), 0);
    const Eigen::Quaterniond error =
        Eigen::AngleAxisd(drift_rad_s_ * t_s, Eigen::Vector3d::UnitZ()) *
        Eigen::Quaterniond(Eigen::AngleAxisd(tilt_rad_, tilt_axis));
    const Eigen::Matrix3d R_world_camera = (error * T_world_camera.rotation).toRotationMatrix();

    const std::vector<LineSegment> segments_px =
        DetectSegments(image, rectifier_.mask(0), LineDetectorOptions());
    std::vector<LineSegment> segments;
    for (const LineSegment& s : segments_px) segments.push_back({OnPlane(s.start), OnPlane(s.end)});
    const double start_s = ThreadCpu_s();
    const auto found = detector_.AddImage(segments, R_world_camera);
    detector_s_ += ThreadCpu_s() - start_s;
    ++images_;
    for (const HeadingEvidence& e : found) ReportFound(e, t_s);
    if (!detector_.known_headings_rad().empty()) {
      JudgeClasses(segments_px, segments, R_world_camera, T_world_camera);
    }
  }

  void ReportFound(const HeadingEvidence& e, double t_s) const {
    std::printf("  found at %.1f s: %.2f degrees", t_s, e.heading_rad / kDegree);
    for (const double heading_rad : true_headings_) {
      const double error_deg = HeadingError(e.heading_rad - drift_rad_s_ * t_s, heading_rad);
      if (std::abs(error_deg) < 4) std::printf(", error %.2f", error_deg);
    }
    std::printf(" (sigma %.2f, share %.2f, minor %.2f, spread %.2f, overhead %.2f, images %d)\n",
                e.sigma_rad / kDegree, e.share, e.minor_share, e.spread, e.overhead_share,
                e.images);
  }

  Eigen::Vector2d OnPlane(const Eigen::Vector2d& px) const {
    return {(px.x() - camera_.cx_px) / camera_.fx_px, (px.y() - camera_.cy_px) / camera_.fy_px};
  }

  // Within 1.5 px across the edge's image, and inside it.
  bool LiesOn(const LineSegment& segment, const Eigen::Vector2d& a,
              const Eigen::Vector2d& b) const {
    const Eigen::Vector2d d = (b - a).normalized();
    for (const Eigen::Vector2d& end : {segment.start, segment.end}) {
      const Eigen::Vector2d from_a = end - a;
      const double along = from_a.dot(d);
      if (std::abs(from_a.x() * d.y() - from_a.y() * d.x()) > 1.5) return false;
      if (along < -4 || along > (b - a).norm() + 4) return false;
    }
    return true;
  }

  std::optional<LineSegment> Image(const EdgeRow& edge,
                                   const RigidTransform& T_camera_world) const {
    Eigen::Vector3d a = T_camera_world * edge.whole.start_world,
                    b = T_camera_world * edge.whole.end_world;
    if (std::max(a.z(), b.z()) < 0.1) return std::nullopt;
    if (a.z() < 0.1) a = b + (a - b) * (b.z() - 0.1) / (b.z() - a.z());
    if (b.z() < 0.1) b = a + (b - a) * (a.z() - 0.1) / (a.z() - b.z());
    const auto a_px = camera_.Project(a), b_px = camera_.Project(b);
    if (!a_px || !b_px) return std::nullopt;
    return LineSegment{*a_px, *b_px};
  }

  void JudgeClasses(const std::vector<LineSegment>& segments_px,
                    const std::vector<LineSegment>& segments, const Eigen::Matrix3d& R_world_camera,
                    const RigidTransform& T_world_camera) {
    const RigidTransform T_camera_world = T_world_camera.Inverse();
    std::vector<std::pair<LineSegment, Eigen::Vector3d>> images;
    for (const EdgeRow& edge : edges_) {
      const auto image = Image(edge, T_camera_world);
      if (image) images.emplace_back(*image, GetDirection(edge));
    }
    const auto& known_rad = detector_.known_headings_rad();
    const std::vector<std::optional<double>> headings_rad(known_rad.begin(), known_rad.end());
    const auto directions = StructuralDirections(headings_rad);
    for (size_t i = 0; i < segments.size(); ++i) {
      std::vector<Eigen::Vector3d> true_directions;
      for (const auto& [image, d] : images) {
        if (LiesOn(segments_px[i], image.start, image.end)) true_directions.push_back(d);
      }
      if (true_directions.empty()) continue;
      const auto line_class = classifier_.Classify(segments[i], R_world_camera, headings_rad);
      Judge(true_directions, line_class, directions, segments_px[i].Length());
    }
  }

  void Judge(const std::vector<Eigen::Vector3d>& true_directions,
             const std::optional<LineClass>& line_class,
             const std::vector<StructuralDirection>& directions, double length_px) {
    const auto follows = [](const Eigen::Vector3d& d, const Eigen::Vector3d& axis) {
      return std::abs(d.dot(axis)) > std::cos(1.0 * kDegree);
    };
    const auto is_class = [&](const StructuralDirection& s) { return s.line_class == *line_class; };
    const bool structural = std::any_of(directions.begin(), directions.end(), [&](const auto& s) {
      return follows(true_directions.front(), s.d_world);
    });
    if (structural) structural_px_ += length_px;
    if (!line_class) return;
    classified_px_ += length_px;
    const auto axis = std::find_if(directions.begin(), directions.end(), is_class);
    const bool right = std::any_of(true_directions.begin(), true_directions.end(),
                                   [&](const auto& d) { return follows(d, axis->d_world); });
    if (right) right_px_ += length_px;
  }

  void Report() const {
    std::printf("  %zu headings found in %d images; detector %.2f ms an image\n",
                detector_.known_headings_rad().size(), images_, 1e3 * detector_s_ / images_);
    if (classified_px_ == 0) return;
    std::printf(
        "  of the length of segments on true edges: classes right %.3f; structural %.0f px,"
        " classified %.2f of it\n",
        right_px_ / classified_px_, structural_px_, right_px_ / structural_px_);
  }

  double tilt_rad_, drift_rad_s_;
  Sequence sequence_;
  Rectifier rectifier_;
  Camera camera_;
  Trajectory truth_;
  std::vector<EdgeRow> edges_;
  std::vector<double> true_headings_;
  ManhattanDetector detector_;
  LineClassifier classifier_;
  double structural_px_ = 0, classified_px_ = 0, right_px_ = 0;
  double detector_s_ = 0;
  int images_ = 0;
};

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: manhattan_quality SEQUENCE [tilt_deg [drift_deg_per_min]]\n");
    return 2;
  }
  const double tilt_deg = argc > 2 ? std::atof(argv[2]) : 0;
  const double drift_deg_per_min = argc > 3 ? std::atof(argv[3]) : 0;
  try {
    slcmap::Benchmark(argv[1], tilt_deg * slcmap::kDegree, drift_deg_per_min * slcmap::kDegree / 60)
        .Run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
