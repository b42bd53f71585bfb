#include "mapping/lines/line_samples.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "data/core/parallel.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

// Cuts the range of u where a + u b is negative.
void Cut(double a, double b, double* from, double* to) {
  if (b > 0) *from = std::max(*from, -a / b);
  if (b < 0) *to = std::min(*to, -a / b);
  if (b == 0 && a < 0) *to = *from - 1;
}

}  // namespace

// Depth is linear along the line, and inverse depth along its image.
double LineInView::AlongAt(double share) const {
  const double far = share * start_depth_m, near = (1 - share) * end_depth_m;
  return from_m + far / (far + near) * (to_m - from_m);
}

double LineInView::DepthAt(double share) const {
  return 1 / ((1 - share) / start_depth_m + share / end_depth_m);
}

std::optional<LineInView> SeenPart(const PointAndDirection& line, const Interval& interval,
                                   const RigidTransform& T_camera_world, const Camera& camera,
                                   const ViewLimits& limits) {
  const Eigen::Vector3d p = T_camera_world * line.point_world;
  const Eigen::Vector3d d = T_camera_world.rotation * line.direction_world;
  double from = interval.from_m, to = interval.to_m;
  Cut(p.z() - limits.min_depth_m, d.z(), &from, &to);
  Cut(limits.max_depth_m - p.z(), -d.z(), &from, &to);
  // left <= x / z <= right and so on, with z > 0
  const auto cut_at = [&](const Eigen::Vector3d& normal) {
    Cut(normal.dot(p), normal.dot(d), &from, &to);
  };
  const double right = (camera.width_px - 1 - limits.margin_px - camera.cx_px) / camera.fx_px;
  const double bottom = (camera.height_px - 1 - limits.margin_px - camera.cy_px) / camera.fy_px;
  cut_at({1, 0, (camera.cx_px - limits.margin_px) / camera.fx_px});
  cut_at({-1, 0, right});
  cut_at({0, 1, (camera.cy_px - limits.margin_px) / camera.fy_px});
  cut_at({0, -1, bottom});
  if (!(from < to)) return std::nullopt;
  const Eigen::Vector3d start = p + from * d, end = p + to * d;
  return LineInView{
      {PixelFromPlane(camera, start.hnormalized()), PixelFromPlane(camera, end.hnormalized())},
      from,
      to,
      start.z(),
      end.z()};
}

namespace {

constexpr int kMaxReach_px = 4;
constexpr double kNear_px = 1.5, kFar_px = 5;  // from an edge, where its step is looked at

double Brightness(const cv::Mat& image, const Eigen::Vector2d& px) {
  const int u = static_cast<int>(px.x()), v = static_cast<int>(px.y());
  const double a = px.x() - u, b = px.y() - v;
  const uchar* top = image.ptr<uchar>(v) + u;
  const uchar* bottom = image.ptr<uchar>(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

bool IsInside(const cv::Mat& image, const Eigen::Vector2d& px) {
  return px.x() >= 0 && px.y() >= 0 && px.x() < image.cols - 1 && px.y() < image.rows - 1;
}

struct Rise {
  double across_px, gradient;
};

// Brightness across an edge, pixel by pixel; in whole registers of four: the last are the same.
template <int kSize>
using Profile = Eigen::Array<float, kSize, 1>;

// The sizes of the profiles of up to the usual reach, and of all.
constexpr int InRegisters(int reach_px) { return (2 * reach_px + 5 + 3) / 4 * 4; }
constexpr int kUsualReach_px = 3;

// At `count` places from `low` on, all inside.
template <int kSize>
Profile<kSize> ProfileAt(const cv::Mat& image, const Eigen::Vector2d& low,
                         const Eigen::Vector2d& normal, int count) {
  static const Profile<kSize> kSteps = Profile<kSize>::LinSpaced(0, kSize - 1);
  const Profile<kSize> steps = kSteps.min(static_cast<float>(count - 1));
  const Profile<kSize> u = static_cast<float>(low.x()) + steps * static_cast<float>(normal.x());
  const Profile<kSize> v = static_cast<float>(low.y()) + steps * static_cast<float>(normal.y());
  // What rounding moves over the border belongs to the last pixel before it.
  const Eigen::Array<int, kSize, 1> columns = u.template cast<int>().min(image.cols - 2);
  const Eigen::Array<int, kSize, 1> rows = v.template cast<int>().min(image.rows - 2);
  Profile<kSize> top_left, top_right, bottom_left, bottom_right;
  for (int i = 0; i < kSize; ++i) {
    const uchar* top = image.ptr<uchar>(rows[i]) + columns[i];
    const uchar* bottom = top + image.step[0];
    top_left[i] = top[0];
    top_right[i] = top[1];
    bottom_left[i] = bottom[0];
    bottom_right[i] = bottom[1];
  }
  const Profile<kSize> a = u - columns.template cast<float>();
  const Profile<kSize> b = v - rows.template cast<float>();
  const Profile<kSize> upper = top_left + a * (top_right - top_left);
  return upper + b * (bottom_left + a * (bottom_right - bottom_left) - upper);
}

// Where the bright side is saturated, as a window's is, only the foot of the blurred step is left,
// and the gradient is largest there: on the dark side of the edge, which in triangulation from few
// degrees is centimetres of depth. How far depends on the blur and on how much brighter than white
// it is, which the image does not say; this is the median in simulated offices.
template <int kSize>
double SaturationShift_px(const Profile<kSize>& values, double edge, int ends) {
  constexpr double kSaturated = 249, kShift_px = 0.46;
  constexpr int kBeside_px = 3;  // the bright side of an edge that is blurred
  const int from = static_cast<int>(std::lround(edge));
  const int to = std::min(2 * ends, from + kBeside_px);
  const float brightest = values.segment(from, to + 1 - from).maxCoeff();
  return brightest >= kSaturated ? kShift_px : 0;
}

// The place nearest to `center` where brightness rises most along `normal`, by a parabola through
// the gradients.
template <int kSize>
std::optional<Rise> NearestRiseIn(const cv::Mat& image, const Eigen::Vector2d& center,
                                  const Eigen::Vector2d& normal, int reach,
                                  const LineSampling& options) {
  const int ends = reach + 2;
  const Eigen::Vector2d low = center - ends * normal, high = center + ends * normal;
  if (!IsInside(image, low) || !IsInside(image, high)) return std::nullopt;
  const Profile<kSize> values = ProfileAt<kSize>(image, low, normal, 2 * ends + 1);
  const auto gradient = [&](int i) { return 0.5 * (values[i + 1] - values[i - 1]); };
  std::optional<Rise> nearest;
  for (int i = 2; i <= 2 * ends - 2; ++i) {
    const double before = gradient(i - 1), peak = gradient(i), after = gradient(i + 1);
    const double curvature = before - 2 * peak + after;
    if (peak < options.min_gradient || peak < before || peak < after || curvature >= 0) continue;
    const double across_px = i - ends + 0.5 * (before - after) / curvature;
    if (std::abs(across_px) > options.reach_px) continue;
    if (!nearest || std::abs(across_px) < std::abs(nearest->across_px)) {
      nearest = Rise{across_px, peak};
    }
  }
  if (nearest) nearest->across_px += SaturationShift_px(values, nearest->across_px + ends, ends);
  return nearest;
}

std::optional<Rise> NearestRise(const cv::Mat& image, const Eigen::Vector2d& center,
                                const Eigen::Vector2d& normal, const LineSampling& options) {
  const int reach = std::clamp(static_cast<int>(std::ceil(options.reach_px)), 1, kMaxReach_px);
  return reach <= kUsualReach_px
             ? NearestRiseIn<InRegisters(kUsualReach_px)>(image, center, normal, reach, options)
             : NearestRiseIn<InRegisters(kMaxReach_px)>(image, center, normal, reach, options);
}

// What is at the left and the right of a place, `offset` away from it; nothing at the border of
// the image.
struct Sides {
  double left = 0, right = 0;
};

std::optional<Sides> MeasureSides(const cv::Mat& image, const Eigen::Vector2d& px,
                                  const Eigen::Vector2d& offset) {
  const Eigen::Vector2d left = px + offset, right = px - offset;
  if (!IsInside(image, left) || !IsInside(image, right)) return std::nullopt;
  return Sides{Brightness(image, left), Brightness(image, right)};
}

void SetSteps(const cv::Mat& image, const Eigen::Vector2d& edge_px, const Eigen::Vector2d& normal,
              LineSample* sample) {
  const auto near = MeasureSides(image, edge_px, kNear_px * normal);
  const auto far = MeasureSides(image, edge_px, kFar_px * normal);
  if (!near || !far) return;  // steps are compared with each other and with the brightness
  sample->step = near->left - near->right;
  sample->lasting_step = far->left - far->right;
  sample->brightness = 0.5 * (far->left + far->right);
}

}  // namespace

std::vector<LineSample> SampleLine(const cv::Mat& image, const cv::Mat& mask,
                                   const LineInView& line, const LineSampling& options) {
  const double length_px = line.px.Length();
  const int count =
      std::min({options.max_samples, static_cast<int>(length_px / options.min_step_px),
                static_cast<int>((line.to_m - line.from_m) / options.step_m)});
  std::vector<LineSample> samples;
  if (count < 1) return samples;
  samples.reserve(count);
  const Eigen::Vector2d normal = Normal(line.px);
  for (int i = 0; i < count; ++i) {
    const double share = (i + 0.5) / count;
    LineSample sample;
    sample.px = line.px.start + share * (line.px.end - line.px.start);
    const int u = static_cast<int>(std::lround(sample.px.x()));
    const int v = static_cast<int>(std::lround(sample.px.y()));
    if (mask.at<uchar>(v, u) == 0) continue;
    sample.along_m = line.AlongAt(share);
    sample.reach_m = 0.5 * std::abs(line.AlongAt((i + 1.0) / count) -
                                    line.AlongAt(static_cast<double>(i) / count));
    sample.depth_m = line.DepthAt(share);
    if (const auto rise = NearestRise(image, sample.px, normal, options)) {
      sample.is_edge = true;
      sample.across_px = rise->across_px;
      sample.gradient = rise->gradient;
      SetSteps(image, sample.px + rise->across_px * normal, normal, &sample);
    }
    samples.push_back(sample);
  }
  return samples;
}

namespace {

constexpr int kCell_px = 8;
constexpr double kMinDepth_m = 0.2, kMaxDepth_m = 10;
// A surface this much nearer than a line hides it: an edge is on its surfaces, whose points lie up
// to a voxel beside it and are seen at an angle.
constexpr double kClearance_m = 0.12, kClearanceShare = 0.04;

}  // namespace

VisibilityDepths::VisibilityDepths(const std::vector<DensePoint>& cloud, double size_m,
                                   const ViewCameras& views, const Progress& progress)
    : size_m_(size_m),
      columns_((views.cameras[0].width_px + kCell_px - 1) / kCell_px),
      rows_((views.cameras[0].height_px + kCell_px - 1) / kCell_px),
      images_(views.T_camera_world.size()) {
  constexpr size_t kAtOnce = 16;  // views between reports
  const auto render = [&](size_t view) {
    for (const int camera : {0, 1}) {
      Render(cloud, size_m, views.cameras[camera], views.T_camera_world[view][camera],
             &images_[view][camera]);
    }
  };
  ForEachWatched(images_.size(), progress, render, kAtOnce);
}

void VisibilityDepths::Render(const std::vector<DensePoint>& cloud, double size_m,
                              const Camera& camera, const RigidTransform& T_camera_world,
                              DepthImage* image) const {
  image->assign(static_cast<size_t>(columns_) * rows_, std::numeric_limits<float>::infinity());
  const Eigen::Matrix3d R = T_camera_world.rotation.toRotationMatrix();
  const Eigen::Vector3d centre_world = -R.transpose() * T_camera_world.translation;
  for (const DensePoint& point : cloud) {
    const Eigen::Vector3d ray = point.p_world - centre_world;
    if (ray.dot(point.normal_world) > 0) continue;  // its back
    const Eigen::Vector3d p = R * ray;
    if (p.z() < kMinDepth_m || p.z() > kMaxDepth_m) continue;
    const Eigen::Vector2d px = PixelFromPlane(camera, Eigen::Vector2d(p.hnormalized()));
    const double half_px = 0.5 * camera.fx_px * size_m / p.z();
    const auto cell = [](double at_px) { return static_cast<int>(std::floor(at_px / kCell_px)); };
    // A cell is hidden where its middle is.
    const int left = std::max(0, cell(px.x() - half_px + 0.5 * kCell_px));
    const int right = std::min(columns_ - 1, cell(px.x() + half_px - 0.5 * kCell_px));
    const int top = std::max(0, cell(px.y() - half_px + 0.5 * kCell_px));
    const int bottom = std::min(rows_ - 1, cell(px.y() + half_px - 0.5 * kCell_px));
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        float& depth_m = (*image)[row * columns_ + column];
        depth_m = std::min(depth_m, static_cast<float>(p.z()));
      }
    }
  }
}

bool VisibilityDepths::Hides(int view, int camera, const Eigen::Vector2d& px,
                             double depth_m) const {
  if (images_.empty() || images_[view][camera].empty()) return false;
  const int column = static_cast<int>(px.x()) / kCell_px, row = static_cast<int>(px.y()) / kCell_px;
  if (px.x() < 0 || px.y() < 0 || column >= columns_ || row >= rows_) return false;
  const double surface_m = images_[view][camera][row * columns_ + column];
  return surface_m < depth_m - std::max(kClearance_m, kClearanceShare * depth_m);
}

// Inverse depth is linear over the image of a plane. A piece that covers the middle of a cell has
// its own middle up to half its size from there, and the place is up to half a cell from there.
bool VisibilityDepths::HidesSurface(int view, int camera, const Camera& model,
                                    const Eigen::Vector3d& p_camera,
                                    const Eigen::Vector3d& normal_camera) const {
  const double z_m = p_camera.z();
  const double reach = 0.5 * kCell_px / model.fx_px + 0.5 * size_m_ / z_m;  // at depth 1
  const double from_plane_m = std::max(std::abs(normal_camera.dot(p_camera)), 1e-6);
  const double slope = normal_camera.head<2>().cwiseAbs().sum() / from_plane_m;
  return Hides(view, camera, PixelFromPlane(model, Eigen::Vector2d(p_camera.hnormalized())),
               1 / (1 / z_m + slope * reach));
}

}  // namespace slcmap::mapping
