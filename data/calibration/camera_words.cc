#include "data/calibration/camera_words.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "data/calibration/calibration_keys.h"
#include "data/core/error.h"
#include "data/core/types.h"

namespace slcmap::inline data {
namespace {

struct Lens {
  Distortion distortion;
  const char* name;
  size_t shapes = 0;  // numbers before the focal lengths
};
constexpr Lens kLenses[] = {{Distortion::kOmni, "omni", 1},
                            {Distortion::kExtendedUnified, "eucm", 2},
                            {Distortion::kDoubleSphere, "ds", 2}};

constexpr Lens kDistortions[] = {{Distortion::kRadialTangential, "radial-tangential"},
                                 {Distortion::kRadialTangential, "radtan"},
                                 {Distortion::kRadialTangential, "plumb_bob"},
                                 {Distortion::kRadialTangential, "rational_polynomial"},
                                 {Distortion::kRadialTangential, "radtan8"},
                                 {Distortion::kEquidistant, "equidistant"},
                                 {Distortion::kEquidistant, "equi"},
                                 {Distortion::kEquidistant, "fisheye"},
                                 {Distortion::kEquidistant, "kannala_brandt"},
                                 {Distortion::kEquidistant, "kannala_brandt4"},
                                 {Distortion::kEquidistant, "kb4"},
                                 {Distortion::kFieldOfView, "fov"},
                                 {Distortion::kNone, "none"}};

// Without what is zero at the end, but no less than `least`.
size_t CountUsed(const std::vector<double>& values, size_t least) {
  size_t count = values.size();
  while (count > least && values[count - 1] == 0) --count;
  return count;
}

std::vector<double> GetRadialTangential(const Camera& camera) {
  std::vector<double> k(camera.coefficients.begin(), camera.coefficients.end());
  k.insert(k.end(), camera.higher_coefficients.begin(), camera.higher_coefficients.end());
  const size_t used = CountUsed(k, 4);
  k.resize(used <= 4 ? 4 : used <= 5 ? 5 : used <= 8 ? 8 : 12);
  return k;
}

std::optional<CameraFault> ReadRadialTangential(const std::vector<double>& k, Camera* camera) {
  const bool has_known_size = std::ranges::count(std::array<size_t, 5>{4, 5, 8, 12, 14}, k.size());
  if (!has_known_size) {
    return CameraFault{
        "coefficients", fmt::format("{} numbers", k.size()),
        "4 (k1, k2, p1, p2), 5 (then k3), 8 (then k4, k5, k6) or 12 (then s1 to s4)"};
  }
  if (k.size() == 14 && (k[12] != 0 || k[13] != 0)) {
    return CameraFault{"coefficients", fmt::format("a tilted sensor ({}, {})", k[12], k[13]),
                       "zeros as the last two of 14 numbers"};
  }
  std::copy_n(k.begin(), 4, camera->coefficients.begin());
  std::copy_n(k.begin() + 4, std::min<size_t>(8, k.size() - 4),
              camera->higher_coefficients.begin());
  return std::nullopt;
}

std::optional<CameraFault> ReadEquidistant(const std::vector<double>& k, Camera* camera) {
  if (k.size() > 4) {
    return CameraFault{"coefficients", fmt::format("{} numbers", k.size()),
                       "at most 4 (k1 to k4) of a fisheye lens"};
  }
  std::copy(k.begin(), k.end(), camera->coefficients.begin());
  return std::nullopt;
}

std::optional<CameraFault> ReadFieldOfView(const std::vector<double>& k, Camera* camera) {
  if (k.size() != 1) {
    return CameraFault{"coefficients", fmt::format("{} numbers", k.size()), "1 (w, in radians)"};
  }
  camera->shape[0] = k[0];
  return std::nullopt;
}

template <typename Table>
std::string ListNames(const Table& table) {
  std::string names;
  for (const auto& entry : table) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

std::optional<CameraFault> ReadDistortion(const CameraWords& words, Camera* camera) {
  const auto known = std::ranges::find_if(
      kDistortions, [&](const Lens& d) { return words.distortion_model == d.name; });
  if (known == std::end(kDistortions)) {
    return CameraFault{"distortion_model", "'" + words.distortion_model + "'",
                       "one of " + ListNames(kDistortions)};
  }
  camera->distortion = known->distortion;
  switch (known->distortion) {
    case Distortion::kRadialTangential:
      return ReadRadialTangential(words.coefficients, camera);
    case Distortion::kEquidistant:
      return ReadEquidistant(words.coefficients, camera);
    case Distortion::kFieldOfView:
      return ReadFieldOfView(words.coefficients, camera);
    default:
      break;
  }
  if (CountUsed(words.coefficients, 0) == 0) return std::nullopt;
  return CameraFault{"coefficients", fmt::format("{} numbers", words.coefficients.size()),
                     "none, or zeros, with distortion_model none"};
}

// What comes with a lens: omni with radial-tangential distortion or none, the others with none.
std::optional<CameraFault> ReadLens(const Lens& lens, const CameraWords& words, Camera* camera) {
  if (const auto fault = ReadDistortion(words, camera)) return fault;
  const bool fits =
      camera->distortion == Distortion::kNone ||
      (lens.distortion == Distortion::kOmni && camera->distortion == Distortion::kRadialTangential);
  if (!fits) {
    return CameraFault{
        "distortion_model", "'" + words.distortion_model + "'",
        fmt::format("none{} with camera_model {}",
                    lens.distortion == Distortion::kOmni ? " or radtan" : "", lens.name)};
  }
  camera->distortion = lens.distortion;
  return std::nullopt;
}

// Takes the numbers behind the first four intrinsics as coefficients.
void SplitIntrinsics(const char* distortion_model, CameraWords* words) {
  words->camera_model = "pinhole";
  if (words->distortion_model == "none") words->distortion_model = distortion_model;
  if (words->intrinsics.size() <= 4 || !words->coefficients.empty()) return;
  words->coefficients.assign(words->intrinsics.begin() + 4, words->intrinsics.end());
  words->intrinsics.resize(4);
}

// Basalt's names and its order, in which the numbers of a lens come last; principal points are
// never so small.
CameraWords InKalibrsWords(CameraWords words) {
  constexpr double kLargestLensNumber = 8;
  constexpr size_t kRadtan8Numbers = 12;  // one more says how far out the lens was calibrated
  if (words.camera_model == "kb4") SplitIntrinsics("equidistant", &words);
  if (words.camera_model == "pinhole-radtan8") {
    if (words.intrinsics.size() == kRadtan8Numbers + 1) words.intrinsics.pop_back();
    SplitIntrinsics("radtan", &words);
  }
  std::vector<double>& numbers = words.intrinsics;
  const bool lens_is_last = numbers.size() > 4 && numbers.front() > kLargestLensNumber &&
                            std::abs(numbers.back()) < kLargestLensNumber;
  if (lens_is_last) std::ranges::rotate(numbers, numbers.begin() + 4);
  if (words.camera_model == "ucm") {  // EUCM with beta 1
    words.camera_model = "eucm";
    if (!numbers.empty()) numbers.insert(numbers.begin() + 1, 1);
  }
  return words;
}

}  // namespace

const char* GetName(Distortion distortion) {
  for (const Lens& known : kDistortions) {
    if (known.distortion == distortion) return known.name;
  }
  return std::ranges::find(kLenses, distortion, &Lens::distortion)->name;
}

std::optional<Distortion> FindDistortion(const std::string& name) {
  for (const Lens& known : kDistortions) {
    if (known.name == name) return known.distortion;
  }
  for (const Lens& known : kLenses) {
    if (known.name == name) return known.distortion;
  }
  return std::nullopt;
}

CameraWords DescribeCamera(const Camera& camera) {
  CameraWords words{"pinhole", "none", {}, {}};
  for (const Lens& lens : kLenses) {
    if (camera.distortion != lens.distortion) continue;
    words.camera_model = lens.name;
    words.intrinsics.assign(camera.shape.begin(),
                            camera.shape.begin() + static_cast<int>(lens.shapes));
  }
  words.intrinsics.insert(words.intrinsics.end(),
                          {camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px});
  const bool is_omni = camera.distortion == Distortion::kOmni;
  if (camera.distortion == Distortion::kRadialTangential || is_omni) {
    words.distortion_model = "radtan";
    words.coefficients = GetRadialTangential(camera);
  } else if (camera.distortion == Distortion::kEquidistant) {
    words.distortion_model = "equidistant";
    words.coefficients.assign(camera.coefficients.begin(), camera.coefficients.end());
  } else if (camera.distortion == Distortion::kFieldOfView) {
    words.distortion_model = "fov";
    words.coefficients = {camera.shape[0]};
  }
  return words;
}

std::optional<Camera> GetCamera(const CameraWords& words, CameraFault* fault) {
  const auto fail = [&](const CameraFault& what) -> std::optional<Camera> {
    *fault = what;
    return std::nullopt;
  };
  Camera camera;
  const CameraWords read = InKalibrsWords(words);
  const auto lens = std::ranges::find_if(
      kLenses, [&](const Lens& known) { return read.camera_model == known.name; });
  const bool is_pinhole = read.camera_model == "pinhole";
  if (lens == std::end(kLenses) && !is_pinhole) {
    return fail({"camera_model", "'" + words.camera_model + "'",
                 "one of pinhole (a fisheye lens too, with distortion_model equidistant), kb4, "
                 "pinhole-radtan8, ucm, " +
                     ListNames(kLenses)});
  }
  const size_t shapes = is_pinhole ? 0 : lens->shapes;
  if (read.intrinsics.size() != shapes + 4) {
    return fail({"intrinsics", fmt::format("{} numbers", words.intrinsics.size()),
                 fmt::format("{}fx, fy, cx, cy", shapes == 0   ? ""
                                                 : shapes == 1 ? "xi, "
                                                 : lens->distortion == Distortion::kDoubleSphere
                                                     ? "xi, alpha, "
                                                     : "alpha, beta, ")});
  }
  if (const auto wrong =
          is_pinhole ? ReadDistortion(read, &camera) : ReadLens(*lens, read, &camera)) {
    return fail(*wrong);
  }
  std::copy_n(read.intrinsics.begin(), shapes, camera.shape.begin());
  const double* f = read.intrinsics.data() + shapes;
  camera.fx_px = f[0];
  camera.fy_px = f[1];
  camera.cx_px = f[2];
  camera.cy_px = f[3];
  return camera;
}

namespace {

constexpr double kUsualDistance_m = 4;   // of what both see
constexpr double kGoodBaseline_m = 0.1;  // less of it tells less of distances
constexpr double kClearlyBetter = 1.05;  // than a pair that comes first

// The share of the first camera's image that the second one sees.
double Overlap(const ChainCamera& first, const ChainCamera& second) {
  constexpr int kSteps = 16;
  const RigidTransform T_second_first = second.T_imu_camera.Inverse() * first.T_imu_camera;
  int seen = 0;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const Eigen::Vector2d pixel_px((i % kSteps + 0.5) / kSteps * first.camera.width_px,
                                   (i / kSteps + 0.5) / kSteps * first.camera.height_px);
    const auto ray = first.camera.Unproject(pixel_px);
    const auto there =
        ray ? second.camera.Project(T_second_first * (kUsualDistance_m * *ray)) : std::nullopt;
    seen += there && second.camera.Contains(*there);
  }
  return static_cast<double>(seen) / (kSteps * kSteps);
}

Eigen::Vector3d OpticalAxis(const ChainCamera& camera) {
  return camera.T_imu_camera.rotation * Eigen::Vector3d::UnitZ();
}

// None where one looks another way or stands before the other: they cannot be rectified.
double Usefulness(const ChainCamera& first, const ChainCamera& second) {
  if (LookApart(first.T_imu_camera, second.T_imu_camera)) return 0;
  const Eigen::Vector3d z_first = OpticalAxis(first), z_second = OpticalAxis(second);
  const double baseline_m = (first.T_imu_camera.translation - second.T_imu_camera.translation)
                                .cross((z_first + z_second).normalized())
                                .norm();
  return Overlap(first, second) * std::min(1.0, baseline_m / kGoodBaseline_m);
}

std::vector<size_t> FindWanted(const std::vector<ChainCamera>& chain,
                               const std::vector<int>& wanted) {
  std::vector<size_t> chosen;
  for (const int index : wanted) {
    const auto camera = std::ranges::find(chain, index, &ChainCamera::index);
    if (camera == chain.end() || std::ranges::count(wanted, index) > 1) {
      std::string names;
      for (const ChainCamera& known : chain) names += fmt::format(" cam{}", known.index);
      throw InputFault("cameras",
                       fmt::format("--cameras: found {}, expected different ones of{}",
                                   fmt::join(wanted, ","), names),
                       "name cameras that the calibration has, as --cameras 0,1");
    }
    chosen.push_back(static_cast<size_t>(camera - chain.begin()));
  }
  return chosen;
}

}  // namespace

std::vector<size_t> ChooseCameras(const std::vector<ChainCamera>& chain,
                                  const std::vector<int>& wanted) {
  if (!wanted.empty()) return FindWanted(chain, wanted);
  std::vector<size_t> chosen, left;
  for (size_t i = 0; i < chain.size(); ++i) left.push_back(i);
  while (chain.size() > 2) {
    std::vector<size_t> best;
    double most = 0;
    for (const size_t i : left) {
      for (const size_t j : left) {
        const double useful = i < j ? Usefulness(chain[i], chain[j]) : 0;
        if (useful <= kClearlyBetter * most) continue;
        most = useful;
        best = {i, j};
      }
    }
    if (best.empty()) break;
    chosen.insert(chosen.end(), best.begin(), best.end());
    std::erase_if(left, [&](size_t i) { return std::ranges::count(best, i) > 0; });
  }
  // One that looks as the lone one before it does, and is of no use beside it, as depth beside
  // colour, would be taken for its right camera.
  const size_t in_pairs = chosen.size();
  for (const size_t i : left) {
    const bool is_no_pair = chain.size() > 2 && chosen.size() > in_pairs &&
                            !LookApart(chain[chosen.back()].T_imu_camera, chain[i].T_imu_camera) &&
                            !StandBehind(chain[chosen.back()].T_imu_camera, chain[i].T_imu_camera);
    if (!is_no_pair) chosen.push_back(i);
  }
  return chosen;
}

namespace {

constexpr double kSameFocal = 1e-4;          // relative; rectified pairs have one to the last digit
constexpr double kMinInfoBaseline_m = 1e-3;  // less is a driver that writes none

bool HasDistortion(const CameraInfo& info) {
  return std::ranges::any_of(info.d, [](double value) { return value != 0; });
}

bool HasProjection(const CameraInfo& info) { return info.p(0, 0) > 0 && info.p(1, 1) > 0; }

bool IsRotation(const Eigen::Matrix3d& r) {
  constexpr double kMaxError = 1e-3;
  return (r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < kMaxError &&
         r.determinant() > 0;
}

// Where a camera stands on the common x axis, in metres.
double PlaceOnBaseline_m(const CameraInfo& info) { return -info.p(0, 3) / info.p(0, 0); }

// Drivers that know no rectification write identities as R.
bool AreRectifying(const CameraInfo& left, const CameraInfo& right) {
  if (left.r.isIdentity(0) && right.r.isIdentity(0)) return false;
  const auto same = [](double a, double b) { return std::abs(a - b) <= kSameFocal * std::abs(a); };
  return IsRotation(left.r) && IsRotation(right.r) && same(left.p(0, 0), right.p(0, 0)) &&
         same(left.p(1, 1), right.p(1, 1)) && same(left.p(1, 2), right.p(1, 2));
}

[[noreturn]] void FailInfo(const CameraInfo& info, const std::string& found) {
  throw InputFault(
      "calibration",
      fmt::format("{}: found {}, expected the camera's calibration", info.place, found),
      "the driver had no calibration: calibrate the rig, and name the file with "
      "--calibration");
}

}  // namespace

bool IsUndistorted(const CameraInfo& info) {
  constexpr double kSame_px = 1e-3;
  return !HasDistortion(info) && (info.k - info.p.leftCols<3>()).cwiseAbs().maxCoeff() < kSame_px;
}

Camera CameraFromInfo(const CameraInfo& info, ImageKind kind) {
  if (info.k.isZero(0) && info.p.isZero(0)) FailInfo(info, "zeros as K and P");
  CameraWords words{"pinhole", "none", {}, {}};
  if (kind == ImageKind::kRectified && HasProjection(info)) {
    words.intrinsics = {info.p(0, 0), info.p(1, 1), info.p(0, 2), info.p(1, 2)};
  } else if (kind == ImageKind::kRectified && HasDistortion(info)) {
    FailInfo(info, "zeros as P of rectified images");
  } else {
    if (info.k.isZero(0)) FailInfo(info, "zeros as K");
    words.intrinsics = {info.k(0, 0), info.k(1, 1), info.k(0, 2), info.k(1, 2)};
    if (HasDistortion(info)) {
      words.distortion_model = info.distortion_model;
      words.coefficients = info.d;
      // Drivers fill up what a lens has not.
      const bool is_fisheye = FindDistortion(info.distortion_model) == Distortion::kEquidistant;
      while (is_fisheye && words.coefficients.size() > 4 && words.coefficients.back() == 0) {
        words.coefficients.pop_back();
      }
    }
  }
  return RequiredCamera(words, {info.width_px, info.height_px}, info.place);
}

std::optional<RigidTransform> RightPoseFromInfo(const CameraInfo& left, const CameraInfo& right,
                                                ImageKind kind) {
  if (!HasProjection(left) || !HasProjection(right)) return std::nullopt;
  const double baseline_m = PlaceOnBaseline_m(right) - PlaceOnBaseline_m(left);
  if (!(std::abs(baseline_m) >= kMinInfoBaseline_m)) return std::nullopt;
  const RigidTransform T_rectified(Eigen::Quaterniond::Identity(), {baseline_m, 0, 0});
  if (kind == ImageKind::kRectified) return T_rectified;
  if (!AreRectifying(left, right)) return std::nullopt;
  const RigidTransform of_left(Eigen::Quaterniond(left.r).normalized(), Eigen::Vector3d::Zero());
  const RigidTransform of_right(Eigen::Quaterniond(right.r).normalized(), Eigen::Vector3d::Zero());
  return of_left.Inverse() * T_rectified * of_right;
}

}  // namespace slcmap::data
