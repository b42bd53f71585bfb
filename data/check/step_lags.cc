#include "data/check/step_lags.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "data/calibration/calibration.h"
#include "data/calibration/mask.h"
#include "data/check/check.h"
#include "data/check/view_geometry.h"
#include "data/core/math.h"
#include "data/core/types.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {

GyroIntegral::GyroIntegral(const std::vector<ImuSample>& imu) {
  Eigen::Vector3d integral = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) {
    if (!IsPlausible(sample)) continue;
    if (!stamps_ns_.empty()) {
      integral += 0.5 * ToSeconds(sample.stamp_ns - stamps_ns_.back()) *
                  (rates_.back() + sample.angular_velocity_rad_s);
    }
    stamps_ns_.push_back(sample.stamp_ns);
    rates_.push_back(sample.angular_velocity_rad_s);
    integrals_.push_back(integral);
  }
}

bool GyroIntegral::Covers(int64_t from_ns, int64_t to_ns) const {
  return stamps_ns_.size() >= 2 && from_ns >= stamps_ns_.front() && to_ns <= stamps_ns_.back();
}

Eigen::Vector3d GyroIntegral::Between(int64_t from_ns, int64_t to_ns) const {
  return Until(to_ns) - Until(from_ns);
}

size_t GyroIntegral::Before(int64_t stamp_ns) const {
  const auto after = std::upper_bound(stamps_ns_.begin() + 1, stamps_ns_.end() - 1, stamp_ns);
  return static_cast<size_t>(after - stamps_ns_.begin()) - 1;
}

Eigen::Vector3d GyroIntegral::RateAt(int64_t stamp_ns) const {
  const size_t i = Before(stamp_ns);
  const double u = static_cast<double>(stamp_ns - stamps_ns_[i]) /
                   static_cast<double>(stamps_ns_[i + 1] - stamps_ns_[i]);
  return (1 - u) * rates_[i] + u * rates_[i + 1];
}

Eigen::Vector3d GyroIntegral::Until(int64_t stamp_ns) const {
  const size_t i = Before(stamp_ns);
  return integrals_[i] + 0.5 * ToSeconds(stamp_ns - stamps_ns_[i]) * (rates_[i] + RateAt(stamp_ns));
}

namespace {

constexpr int kMaxLag = 6;
constexpr int kLags = 2 * kMaxLag + 1;
constexpr double kStepShare = 0.05;  // of a step, by which nearer and farther places make it differ
constexpr double kMostMisfit = 9;    // squared deviations; a lost image fits nothing
constexpr double kChangePrice = 40;  // of a lag, in the same

// The median movement of corners from one image to the next, in pixels.
std::optional<Eigen::Vector2d> MedianFlow_px(const cv::Mat& before, const cv::Mat& after,
                                             const cv::Mat& mask) {
  constexpr int kCorners = 80;
  constexpr size_t kMinCorners = 12;
  std::vector<cv::Point2f> corners, found;
  cv::goodFeaturesToTrack(before, corners, kCorners, 0.02, 10, mask);
  if (corners.size() < kMinCorners) return std::nullopt;
  std::vector<uchar> is_found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(before, after, corners, found, is_found, error, {15, 15}, 4);
  std::vector<double> x_px, y_px;
  for (size_t i = 0; i < corners.size(); ++i) {
    if (!is_found[i]) continue;
    x_px.push_back(found[i].x - corners[i].x);
    y_px.push_back(found[i].y - corners[i].y);
  }
  if (x_px.size() < kMinCorners) return std::nullopt;
  return Eigen::Vector2d(Median(x_px), Median(y_px));
}

cv::Mat Halved(const cv::Mat& image) {
  cv::Mat half;
  if (!image.empty()) cv::resize(image, half, {}, 0.5, 0.5, cv::INTER_AREA);
  return half;
}

// What it costs to take the right step for the same as the left one.
double StepMisfit(const std::optional<Eigen::Vector2d>& left,
                  const std::optional<Eigen::Vector2d>& right, double noise_rad) {
  if (!left || !right) return 0.5 * kMostMisfit;
  const double sigma_rad = noise_rad + kStepShare * std::max(left->norm(), right->norm());
  return std::min(kMostMisfit, (*left - *right).squaredNorm() / (sigma_rad * sigma_rad));
}

std::optional<Eigen::Vector2d> At(const ImageSteps& steps, std::ptrdiff_t i) {
  return i >= 0 && i < std::ssize(steps) ? steps[static_cast<size_t>(i)] : std::nullopt;
}

// The mean square by which what is left of a piece's steps, without those of the gyroscope so many
// later, changes from one to the next; what comes of moving on changes slowly.
double Unexplained(const ImageSteps& left, const ImageSteps& gyro, size_t first, size_t end,
                   int later) {
  constexpr double kLeastSteps = 5;
  std::optional<Eigen::Vector2d> before;
  double squares = 0, count = 0;
  for (size_t i = first; i < end; ++i) {
    const auto turn = At(gyro, static_cast<std::ptrdiff_t>(i) + later);
    if (!left[i] || !turn) continue;
    const Eigen::Vector2d rest = *left[i] - *turn;
    if (before) squares += (rest - *before).squaredNorm(), ++count;
    before = rest;
  }
  return count < kLeastSteps ? 1e9 : squares / count;
}

}  // namespace

ImageSteps FollowSteps(const SequenceSource& source, int camera, const Progress& progress) {
  const Rig& rig = source.info().rig;
  const size_t pairs = source.info().pair_stamps_ns.size();
  const double per_half_px = 2 / rig.cameras[camera].MiddleFocal_px();
  const cv::Mat mask = Halved(rig.masks[camera]);
  const Eigen::Quaterniond R_left_camera =
      camera == 0 ? Eigen::Quaterniond::Identity() : LeftRight(rig).rotation;
  ImageSteps steps;
  cv::Mat before;
  for (size_t i = 0; i < pairs; ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs));
    const cv::Mat image = Halved(source.ReadImage(i, camera).image);
    if (i > 0) {
      const auto flow_px =
          before.empty() || image.empty() ? std::nullopt : MedianFlow_px(before, image, mask);
      steps.push_back(std::nullopt);
      if (flow_px) {
        const Eigen::Vector3d step(flow_px->x(), flow_px->y(), 0);
        steps.back() = per_half_px * (R_left_camera * step).head<2>();
      }
    }
    before = image;
  }
  return steps;
}

ImageSteps StepsOfGyro(const std::vector<int64_t>& stamps_ns, const Rig& rig,
                       const std::vector<ImuSample>& imu) {
  const GyroIntegral gyro(imu);
  const int64_t offset_ns = ToNanoseconds(rig.camera_time_offset_s);
  ImageSteps steps;
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    const int64_t from_ns = stamps_ns[i - 1] + offset_ns, to_ns = stamps_ns[i] + offset_ns;
    steps.push_back(std::nullopt);
    if (imu.empty() || !gyro.Covers(from_ns, to_ns)) continue;
    const Eigen::Vector3d turn_rad =
        rig.T_imu_camera[0].rotation.conjugate() * gyro.Between(from_ns, to_ns);
    steps.back() = Eigen::Vector2d(-turn_rad.y(), turn_rad.x());
  }
  return steps;
}

std::vector<int> FindLags(const ImageSteps& left, const ImageSteps& right, double noise_rad) {
  std::vector<std::array<int, kLags>> came_from(left.size());
  std::array<double, kLags> cost{};
  for (size_t i = 0; i < left.size(); ++i) {
    const auto cheapest =
        static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin());
    const double changed = cost[static_cast<size_t>(cheapest)] + kChangePrice;
    for (size_t k = 0; k < kLags; ++k) {
      came_from[i][k] = cost[k] <= changed ? static_cast<int>(k) : cheapest;
      const auto later = static_cast<std::ptrdiff_t>(i + k) - kMaxLag;
      cost[k] = std::min(cost[k], changed) + StepMisfit(left[i], At(right, later), noise_rad);
    }
  }
  std::vector<int> lags(left.size());
  auto k = static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  for (size_t i = left.size(); i-- > 0;) {
    lags[i] = k - kMaxLag;
    k = came_from[i][static_cast<size_t>(k)];
  }
  return lags;
}

int LateBy(const ImageSteps& left, const ImageSteps& gyro, size_t first, size_t end) {
  constexpr double kClearlyLess = 0.7;
  double best = kClearlyLess * Unexplained(left, gyro, first, end, 0);
  int late = 0;
  for (int later = -kMaxLag; later <= kMaxLag; ++later) {
    const double unexplained = Unexplained(left, gyro, first, end, later);
    if (unexplained >= best) continue;
    best = unexplained;
    late = later;
  }
  return late;
}

namespace {

constexpr size_t kMaxTurns = 12;      // that are looked at, the largest
constexpr double kTurnTime_s = 1;     // from the first image of a turn to its last
constexpr double kTurnStep_s = 0.25;  // between the first images of turns, at least
constexpr double kMinTurn_rad =
    4 * kDegree;                         // of the optical axis: the building moves on by a cell
constexpr double kMostBias_rad_s = 0.1;  // of a gyroscope, which is not known yet
constexpr size_t kSpreadImages = 12;     // over the recording, that are compared with each other
constexpr double kApart_s = 2;           // where they are so far apart
constexpr std::array<int, 2> kMinComparisons = {2, 6};  // of a cell, by kind
constexpr double kSameShare = 0.75;  // of a cell's comparisons, of what is carried
constexpr double kSameCorrelation = 0.7;
constexpr double kMinTexture_grey = 4;  // RMS of a cell's fine texture; noise has less
constexpr double kMinSide = 0.3;        // the same along the side with less of it
constexpr int kColumns = 24;            // cells across the image
constexpr double kLeastShare = 0.01;    // of the image that is worth a mask
constexpr double kFine_px = 6;          // texture that is finer than this is compared

// Fine texture: what a plain wall with light and shade has not.
cv::Mat FineTexture(const cv::Mat& image) {
  cv::Mat grey, smooth;
  image.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, grey, {}, 1);
  cv::GaussianBlur(grey, smooth, {}, kFine_px);
  return grey - smooth;
}

// RMS of the texture, and of it once it is averaged along columns or rows: an edge along one of
// them looks the same wherever the camera slides along it.
bool HasTexture(const cv::Mat& cell) {
  const double rms = std::sqrt(cell.dot(cell) / static_cast<double>(cell.total()));
  if (rms < kMinTexture_grey) return false;
  for (const int along : {0, 1}) {
    cv::Mat mean;
    cv::reduce(cell, mean, along, cv::REDUCE_AVG);
    cv::Mat rest = cell - cv::repeat(mean, along == 0 ? cell.rows : 1, along == 0 ? 1 : cell.cols);
    if (std::sqrt(rest.dot(rest) / static_cast<double>(rest.total())) < kMinSide * rms)
      return false;
  }
  return true;
}

double Correlation(const cv::Mat& a, const cv::Mat& b) {
  return a.dot(b) / std::sqrt(a.dot(a) * b.dot(b));
}

// The cells of an image, and how many comparisons found the same in each: of images of one turn, in
// which the building moves on, and of images far apart in time, as what a camera circles stays in
// the middle meanwhile.
class CarriedCells {
 public:
  explicit CarriedCells(const Camera& camera)
      : size_(camera.width_px, camera.height_px),
        side_px_(std::max(12, camera.width_px / kColumns)),
        cells_(camera.width_px / side_px_, camera.height_px / side_px_),
        compared_{cv::Mat::zeros(cells_, CV_32S), cv::Mat::zeros(cells_, CV_32S)},
        same_{cv::Mat::zeros(cells_, CV_32S), cv::Mat::zeros(cells_, CV_32S)} {}

  enum Kind { kOfOneTurn, kFarApart };

  void Compare(const cv::Mat& a, const cv::Mat& b, Kind kind) {
    for (int y = 0; y < cells_.height; ++y) {
      for (int x = 0; x < cells_.width; ++x) {
        const cv::Mat cell_a = a(Area(x, y)), cell_b = b(Area(x, y));
        if (!HasTexture(cell_a) || !HasTexture(cell_b)) continue;
        ++compared_[kind].at<int>(y, x);
        same_[kind].at<int>(y, x) += Correlation(cell_a, cell_b) > kSameCorrelation;
      }
    }
  }

  // With the cells beside and between what is carried; empty where that is hardly any.
  cv::Mat Mask() const {
    cv::Mat carried(cells_, CV_8UC1, cv::Scalar(0));
    for (int y = 0; y < cells_.height; ++y) {
      for (int x = 0; x < cells_.width; ++x) {
        if (IsSame(kOfOneTurn, x, y) && IsSame(kFarApart, x, y)) carried.at<uchar>(y, x) = 255;
      }
    }
    cv::morphologyEx(carried, carried, cv::MORPH_CLOSE, cv::Mat::ones(3, 3, CV_8UC1));
    // Single cells are dirt on a lens.
    cv::Mat solid;
    const cv::Mat four = cv::Mat::ones(2, 2, CV_8UC1);
    cv::erode(carried, solid, four, {0, 0});
    cv::dilate(solid, solid, four, {1, 1});
    if (cv::countNonZero(solid) < kLeastShare * cells_.area()) return {};
    cv::dilate(solid, solid, cv::Mat::ones(3, 3, CV_8UC1));
    cv::Mat mask;
    cv::resize(solid, mask, {cells_.width * side_px_, cells_.height * side_px_}, 0, 0,
               cv::INTER_NEAREST);
    cv::copyMakeBorder(mask, mask, 0, size_.height - mask.rows, 0, size_.width - mask.cols,
                       cv::BORDER_REPLICATE);
    return mask == 0;
  }

 private:
  bool IsSame(Kind kind, int x, int y) const {
    const int compared = compared_[kind].at<int>(y, x);
    return compared >= kMinComparisons[kind] && same_[kind].at<int>(y, x) > kSameShare * compared;
  }
  cv::Rect Area(int x, int y) const { return {x * side_px_, y * side_px_, side_px_, side_px_}; }

  const cv::Size size_;
  const int side_px_;
  const cv::Size cells_;
  std::array<cv::Mat, 2> compared_, same_;  // by kind
};

// A turn of the rig between two pairs.
struct Turn {
  size_t first = 0, last = 0;
  double turn_rad = 0;  // of the left camera's optical axis, at least
};

std::vector<Turn> LargestTurns(const SourceInfo& info, const std::vector<ImuSample>& samples) {
  const GyroIntegral gyro(samples);
  const int64_t offset_ns = ToNanoseconds(info.rig.camera_time_offset_s);
  const std::vector<int64_t>& stamps_ns = info.pair_stamps_ns;
  const Eigen::Quaterniond R_camera_imu = info.rig.T_imu_camera[0].rotation.conjugate();
  std::vector<Turn> turns;
  for (size_t first = 0, last = 0; first < stamps_ns.size(); ++first) {
    const auto time_s = [&] { return ToSeconds(stamps_ns[last] - stamps_ns[first]); };
    while (last < stamps_ns.size() && time_s() < kTurnTime_s) ++last;
    if (last == stamps_ns.size()) break;
    const int64_t from_ns = stamps_ns[first] + offset_ns, to_ns = stamps_ns[last] + offset_ns;
    if (time_s() > 1.5 * kTurnTime_s || !gyro.Covers(from_ns, to_ns)) continue;
    const Eigen::Vector3d turn_rad = R_camera_imu * gyro.Between(from_ns, to_ns);
    turns.push_back({first, last, turn_rad.head<2>().norm() - kMostBias_rad_s * time_s()});
  }
  std::stable_sort(turns.begin(), turns.end(),
                   [](const Turn& a, const Turn& b) { return a.turn_rad > b.turn_rad; });
  std::vector<Turn> chosen;
  for (const Turn& turn : turns) {
    if (turn.turn_rad < kMinTurn_rad || chosen.size() == kMaxTurns) break;
    const bool is_apart = std::none_of(chosen.begin(), chosen.end(), [&](const Turn& other) {
      return std::abs(ToSeconds(stamps_ns[turn.first] - stamps_ns[other.first])) < kTurnStep_s;
    });
    if (is_apart) chosen.push_back(turn);
  }
  return chosen;
}

void CompareTurns(const SequenceSource& source, const std::vector<Turn>& turns, int camera,
                  const Progress& progress, CarriedCells* cells) {
  for (size_t i = 0; i < turns.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(turns.size()));
    const cv::Mat first = source.ReadImage(turns[i].first, camera).image;
    const cv::Mat last = source.ReadImage(turns[i].last, camera).image;
    if (first.empty() || last.empty()) continue;
    cells->Compare(FineTexture(first), FineTexture(last), CarriedCells::kOfOneTurn);
  }
}

void CompareFarApart(const SequenceSource& source, int camera, const Progress& progress,
                     CarriedCells* cells) {
  const std::vector<int64_t>& stamps_ns = source.info().pair_stamps_ns;
  std::vector<std::pair<int64_t, cv::Mat>> before;
  for (size_t i = 0; i < kSpreadImages; ++i) {
    progress.ReportOrStop(static_cast<double>(i) / kSpreadImages);
    const size_t pair = i * (stamps_ns.size() - 1) / (kSpreadImages - 1);
    const cv::Mat image = source.ReadImage(pair, camera).image;
    if (image.empty()) continue;
    const cv::Mat texture = FineTexture(image);
    for (const auto& [stamp_ns, other] : before) {
      if (ToSeconds(stamps_ns[pair] - stamp_ns) < kApart_s) continue;
      cells->Compare(texture, other, CarriedCells::kFarApart);
    }
    before.emplace_back(stamps_ns[pair], texture);
  }
}

cv::Mat FindInCamera(const SequenceSource& source, const std::vector<Turn>& turns, int camera,
                     const Progress& progress) {
  CarriedCells cells(source.info().rig.cameras[camera]);
  CompareTurns(source, turns, camera, progress.Part(0, 0.6), &cells);
  CompareFarApart(source, camera, progress.Part(0.6, 1), &cells);
  return cells.Mask();
}

// Shares of the images of the cameras.
std::string SharesInWords(const std::vector<double>& shares, const SourceInfo& info) {
  if (shares.size() == 2) {
    return fmt::format("{:.0f} % of the left and {:.0f} % of the right image", 100 * shares[0],
                       100 * shares[1]);
  }
  std::string words;
  for (size_t i = 0; i < shares.size(); ++i) {
    words += fmt::format("{}{:.0f} % of {}", i == 0 ? "" : ", ", 100 * shares[i], info.cameras[i]);
  }
  return words;
}

// Of what was found, what given masks do not leave out: they are inverted, or miss a camera.
void WarnOfSeen(const std::vector<cv::Mat>& found, const SourceInfo& info, CheckReport* report) {
  constexpr double kMostSeen = 0.05;  // of the image; a border by hand may differ by less
  const std::vector<cv::Mat>& given = info.rig.masks;
  std::vector<double> seen;
  for (size_t i = 0; i < found.size(); ++i) {
    const cv::Mat both =
        given[i].empty() || found[i].empty() ? found[i] : found[i] | (given[i] == 0);
    seen.push_back(LeftOut(both));
  }
  if (std::ranges::max(seen) < kMostSeen) return;
  report->Warn("mask",
               SharesInWords(seen, info) + " move with the rig, where the masks leave out nothing",
               "give a mask for each camera, white where the rig or its carrier is seen; or leave "
               "--mask away");
}

}  // namespace

std::vector<cv::Mat> FindCarried(const SequenceSource& source,
                                 const std::vector<ImuSample>& samples, const Progress& progress) {
  const std::vector<Turn> turns = LargestTurns(source.info(), samples);
  const int count = CameraCount(source.info().rig);
  std::vector<cv::Mat> masks(source.info().rig.cameras.size());
  if (turns.size() < static_cast<size_t>(kMinComparisons[CarriedCells::kOfOneTurn])) return masks;
  for (int camera = 0; camera < count; ++camera) {
    masks[camera] = FindInCamera(source, turns, camera,
                                 progress.Part(1.0 * camera / count, (camera + 1.0) / count));
  }
  return masks;
}

void CheckCarried(SequenceSource* source, const std::vector<ImuSample>& samples,
                  const Progress& progress, CheckReport* report) {
  const Rig& rig = source->info().rig;
  for (size_t i = 0; i < rig.masks.size(); ++i) {
    if (rig.masks[i].empty()) continue;
    report->AddFigure(fmt::format("left out of {} by its mask", source->info().cameras[i]),
                      100 * LeftOut(rig.masks[i]), "%");
  }
  const auto is_there = [](const cv::Mat& mask) { return !mask.empty(); };
  const bool given = std::ranges::any_of(rig.masks, is_there);
  if (!source->info().finds_carried && !given) return;
  const std::vector<cv::Mat> masks = FindCarried(*source, samples, progress);
  if (std::ranges::none_of(masks, is_there)) return;
  if (given) {
    WarnOfSeen(masks, source->info(), report);
    return;
  }
  std::vector<double> shares;
  for (const cv::Mat& mask : masks) shares.push_back(LeftOut(mask));
  source->SetMasks(masks);
  report->Warn("carried",
               HasTwoCameras(rig) ? SharesInWords(shares, source->info()) + " move with the rig"
                                  : fmt::format("{:.0f} % of the image moves with the rig",
                                                100 * LeftOut(masks[0])),
               "mount the rig so that it sees past whoever carries it; that part is left out "
               "(--mask gives another, --mask none leaves out nothing)");
}

}  // namespace slcmap::data
