// How accurate, right, long-lived and cheap the tracks of straight edges are on a recording with
// true poses, and on a simulated one against its true edges.
//
//   line_quality SEQUENCE [lsd|fld|ed [first_image pairs step [folder_for_pictures]]]
//
// SEQUENCE is a folder in EuRoC's layout; every step-th pair is taken. Lines are predicted as the
// estimator would, from their last observations and the true poses. Judged in two ways: by how well
// all observations of a line fit one line in space (any edge, also of a texture), and by the
// distance from the true edges (truth/edges.csv), of which those that were never seen are left out.
// Of an inexact building only segments that lie on one piece of a bent edge count as on an edge.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <vector>

#include "apps/evaluation/truth.h"
#include "data/io/trajectory.h"
#include "data/source/asl_source.h"
#include "data/source/sequence.h"
#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_matcher.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/frontend/line_tracker.h"
#include "odometry/frontend/rectifier.h"
#include "tests/benchmarks/line_fit.h"
#include "tests/benchmarks/stage_clocks.h"

namespace slcmap {
namespace {

constexpr double kNearEdge_px = 1.5;
constexpr double kWrong_px = 3;

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const size_t i = std::min(values.size() - 1, static_cast<size_t>(q * values.size()));
  std::nth_element(values.begin(), values.begin() + i, values.end());
  return values[i];
}

// A part of an edge that was seen.
struct TrueEdge {
  int edge = 0;
  Segment3d ends_world;
};

// Empty where there is no such file.
std::vector<TrueEdge> ReadEdges(const std::string& sequence) {
  const std::string path = sequence + "/truth/edges.csv";
  std::vector<TrueEdge> edges;
  if (!std::filesystem::exists(path)) return edges;
  for (const EdgeRow& row : ReadEdgeTable(path)) {
    if (row.to_m <= row.from_m) continue;
    const PlySegment seen = row.Seen();
    edges.push_back({static_cast<int>(row.edge), {seen.start_world, seen.end_world}});
  }
  return edges;
}

struct Track {
  std::vector<View> views;  // left and right
  std::vector<std::set<int>> edges_of_view;
  int pairs = 0;
  int stereo = 0;
};

class Benchmark {
 public:
  Benchmark(const std::string& path, LineDetectorKind kind, const std::string& pictures)
      : pictures_(pictures),
        sequence_(OpenSequence(path)),
        rectifier_(sequence_.rig, RectifierOptions()),
        truth_(ReadTrajectory(sequence_.truth_path)),
        edges_(ReadEdges(path)),
        projector_(rectifier_.rectified_rig().cameras[0]),
        fitter_(rectifier_.rectified_rig().cameras[0]) {
    options_.detector.kind = kind;
  }

  void Run(int first, int pairs, int step) {
    cv::setNumThreads(1);
    LineTracker tracker(options_, rectifier_.rectified_rig(), rectifier_.mask(0),
                        rectifier_.mask(1));
    StereoReader reader(sequence_);
    for (int i = 0; i < first + pairs * step; ++i) {
      const auto pair = reader.Next();
      if (!pair) break;
      const auto pose = PoseAt(truth_, pair->stamp_ns);
      if (pose && i >= first && (i - first) % step == 0) {
        AddPair(&tracker, rectifier_.Rectify(pair->left, 0),
                rectifier_.Rectify(pair->decode_right(), 1), *pose);
      }
    }
    Report();
  }

 private:
  RigidTransform T_world_camera(const RigidTransform& T_world_imu, int camera) const {
    return T_world_imu * rectifier_.rectified_rig().T_imu_camera[camera];
  }

  void AddPair(LineTracker* tracker, const cv::Mat& left, const cv::Mat& right,
               const RigidTransform& T_world_imu) {
    const RigidTransform now = T_world_camera(T_world_imu, 0);
    const auto R = pairs_ > 0 ? (now.rotation.conjugate() * last_.rotation).normalized()
                              : Eigen::Quaterniond::Identity();
    const auto predictions = Predict(T_world_imu);
    clocks_.Run("all: LineTracker::Track",
                [&] { tracker->Track(left, right, R, predictions, {}); });
    TimeStages(left, right);
    observed_ += tracker->observations().size();
    predicted_ += predictions.size();
    std::set<int64_t> seen;
    for (const auto& o : tracker->observations()) {
      seen.insert(o.id);
      AddViews(o, T_world_imu);
    }
    for (const auto& p : predictions) predicted_seen_ += seen.contains(p.id);
    if (!pictures_.empty()) Draw(left, right, tracker->observations());
    last_ = now;
    ++pairs_;
  }

  void TimeStages(const cv::Mat& left, const cv::Mat& right) {
    const auto raw = clocks_.Run("detector alone, one image",
                                 [&] { return DetectRawSegments(left, options_.detector, 12); });
    const auto l = clocks_.Run("detected, refined, one image", [&] {
      return DetectSegments(left, rectifier_.mask(0), options_.detector);
    });
    const auto r = DetectSegments(right, rectifier_.mask(1), options_.detector);
    clocks_.Run("LBD, one image", [&] { return DescribeSegments(left, l); });
    clocks_.Run("stereo matching", [&] { return MatchStereo(left, right, l, r); });
    raw_ += raw.size();
    detected_ += l.size();
  }

  std::vector<LinePrediction> Predict(const RigidTransform& T_world_imu) const {
    std::vector<LinePrediction> predictions;
    for (const auto& [id, track] : tracks_) {
      if (track.views.size() < 2 || pairs_ - last_seen_.at(id) > 10) continue;
      const size_t used = std::min<size_t>(track.views.size(), 10);
      const std::vector<View> views(track.views.end() - used, track.views.end());
      auto line = fitter_.Fit(views);
      if (!line) continue;
      line = Segment3d{fitter_.Foot(*line, views.back(), views.back().px.start),
                       fitter_.Foot(*line, views.back(), views.back().px.end)};
      const auto left = projector_.Project(T_world_camera(T_world_imu, 0).Inverse(), *line);
      if (!left || left->Length() < 10) continue;
      predictions.push_back(
          {id, *left, projector_.Project(T_world_camera(T_world_imu, 1).Inverse(), *line), 1.5});
    }
    return predictions;
  }

  void AddViews(const LineObservation& o, const RigidTransform& T_world_imu) {
    Track& track = tracks_[o.id];
    ++track.pairs;
    last_seen_[o.id] = pairs_;
    AddView(T_world_camera(T_world_imu, 0), o.left_px, &track);
    if (o.right_px) {
      AddView(T_world_camera(T_world_imu, 1), *o.right_px, &track);
      ++track.stereo;
      JudgeStereo(o, track);
    }
    lengths_px_.push_back(o.left_px.Length());
  }

  void AddView(const RigidTransform& T, const LineSegment& px, Track* track) {
    track->views.push_back({T, px});
    track->edges_of_view.push_back(EdgesAt(T.Inverse(), px));
  }

  // The true edges that a segment may be an observation of; notes its distance from the nearest.
  std::set<int> EdgesAt(const RigidTransform& T_camera_world, const LineSegment& px) {
    std::set<int> near;
    double best = kNearEdge_px;
    double signed_best = 0;
    for (const auto& e : edges_) {
      const auto s = projector_.Project(T_camera_world, e.ends_world);
      if (!s || s->Length() < 5 || Overlap_px(px, *s) < 0.5 * px.Length()) continue;
      const double start = DistanceAcross_px(*s, px.start), end = DistanceAcross_px(*s, px.end);
      const double largest = std::max(std::abs(start), std::abs(end));
      if (largest < kWrong_px) near.insert(e.edge);
      if (largest >= best) continue;
      best = largest;
      signed_best = 0.5 * (start + end) * (Normal(px).dot(Normal(*s)) > 0 ? 1 : -1);
    }
    ++judged_;
    if (best < kNearEdge_px) {
      edge_errors_px_.push_back(best);
      edge_offsets_px_.push_back(signed_best);
    }
    return near;
  }

  void JudgeStereo(const LineObservation&, const Track& track) {
    const auto& right = track.edges_of_view.back();
    const auto& left = track.edges_of_view[track.edges_of_view.size() - 2];
    if (left.empty()) return;
    ++stereo_judged_;
    stereo_right_ +=
        std::any_of(left.begin(), left.end(), [&](int e) { return right.contains(e); });
  }

  void Report() {
    std::vector<double> errors_px, lives;
    int wrong = 0, observations = 0, kept_tracks = 0, wrong_tracks = 0;
    for (const auto& [id, track] : tracks_) {
      lives.push_back(track.pairs);
      if (track.pairs < 2 || track.views.size() < 3) continue;
      const auto line = fitter_.Fit(track.views);
      if (!line) continue;
      int wrong_here = 0;
      for (const auto& view : track.views) {
        const auto e = fitter_.Errors_px(*line, view);
        wrong_here += std::max(std::abs(e[0]), std::abs(e[1])) > kWrong_px;
        for (const double x : e) {
          if (std::abs(x) < kWrong_px) errors_px.push_back(std::abs(x));
        }
      }
      ++kept_tracks;
      wrong_tracks += wrong_here > 0;
      wrong += wrong_here;
      observations += track.views.size();
    }
    int temporal = 0, temporal_right = 0;
    for (const auto& [id, track] : tracks_) CountTemporal(track, &temporal, &temporal_right);
    const double n = std::max(1, pairs_);
    printf(
        "%d pairs; an image: raw %.1f, detected %.1f; a pair: tracked %.1f, predicted %.1f, of "
        "them seen %.1f %%\n",
        pairs_, raw_ / n, detected_ / n, observed_ / n, predicted_ / n,
        100.0 * predicted_seen_ / std::max(1, predicted_));
    double stereo = 0;
    for (const auto& [id, track] : tracks_) stereo += track.stereo;
    double long_lived = 0;
    for (const double l : lives) long_lived += l >= 4 ? l : 0;
    printf(
        "length median %.0f px; seen right %.0f %%; %zu lines; life in pairs: mean %.1f, of the "
        "observations' lines median %.0f; observations of lines with 4 or more: %.0f %%\n",
        Quantile(lengths_px_, 0.5), 100 * stereo / observed_, tracks_.size(),
        static_cast<double>(observed_) / tracks_.size(), MedianLifeOfObservations(),
        100 * long_lived / observed_);
    printf(
        "fit to one line: error of the ends median %.2f 68%% %.2f 95%% %.2f 99%% %.2f px; "
        "observations > %.0f px: %.2f %%; lines with such: %.1f %% of %d\n",
        Quantile(errors_px, 0.5), Quantile(errors_px, 0.68), Quantile(errors_px, 0.95),
        Quantile(errors_px, 0.99), kWrong_px, 100.0 * wrong / std::max(1, observations),
        100.0 * wrong_tracks / std::max(1, kept_tracks), kept_tracks);
    if (!edges_.empty()) {
      double mean = 0;
      for (const double o : edge_offsets_px_) mean += o / edge_offsets_px_.size();
      printf(
          "true edges: %.0f %% of the observations; error median %.2f 68%% %.2f 95%% %.2f, mean to "
          "the "
          "bright side %.3f px; matches right: pair to pair %.2f %% of %d, left to right %.2f %% "
          "of %d\n",
          100.0 * edge_errors_px_.size() / std::max(1, judged_), Quantile(edge_errors_px_, 0.5),
          Quantile(edge_errors_px_, 0.68), Quantile(edge_errors_px_, 0.95), mean,
          100.0 * temporal_right / std::max(1, temporal), temporal,
          100.0 * stereo_right_ / std::max(1, stereo_judged_), stereo_judged_);
    }
    clocks_.Print();
  }

  double MedianLifeOfObservations() const {
    std::vector<double> lives;
    for (const auto& [id, track] : tracks_) lives.insert(lives.end(), track.pairs, track.pairs);
    return Quantile(lives, 0.5);
  }

  // Neighbouring observations of which the first is on a true edge.
  static void CountTemporal(const Track& track, int* all, int* right) {
    for (size_t i = 1; i < track.views.size(); ++i) {
      const auto& a = track.edges_of_view[i - 1];
      const auto& b = track.edges_of_view[i];
      if (a.empty()) continue;
      ++*all;
      *right += std::any_of(a.begin(), a.end(), [&](int e) { return b.contains(e); });
    }
  }

  void Draw(const cv::Mat& left, const cv::Mat& right, const std::vector<LineObservation>& lines) {
    cv::Mat both, picture;
    cv::hconcat(left, right, both);
    cv::cvtColor(both, picture, cv::COLOR_GRAY2BGR);
    for (const auto& o : lines) {
      const cv::Scalar color((o.id * 67) % 200 + 55, (o.id * 131) % 200 + 55,
                             (o.id * 29) % 200 + 55);
      DrawSegment(o.left_px, 0, color, std::to_string(o.id), &picture);
      if (o.right_px) DrawSegment(*o.right_px, left.cols, color, std::to_string(o.id), &picture);
    }
    char name[32];
    std::snprintf(name, sizeof(name), "/%04d.png", pairs_);
    cv::imwrite(pictures_ + name, picture);
  }

  static void DrawSegment(const LineSegment& s, int offset_px, const cv::Scalar& color,
                          const std::string& label, cv::Mat* picture) {
    const cv::Point a(cvRound(s.start.x()) + offset_px, cvRound(s.start.y()));
    const cv::Point b(cvRound(s.end.x()) + offset_px, cvRound(s.end.y()));
    cv::line(*picture, a, b, color, 1, cv::LINE_AA);
    cv::putText(*picture, label, (a + b) / 2, cv::FONT_HERSHEY_PLAIN, 0.8, color);
  }

  LineTrackerOptions options_;
  std::string pictures_;
  Sequence sequence_;
  Rectifier rectifier_;
  Trajectory truth_;
  std::vector<TrueEdge> edges_;
  Projector projector_;
  LineFitter fitter_;
  StageClocks clocks_;
  std::map<int64_t, Track> tracks_;
  std::map<int64_t, int> last_seen_;
  RigidTransform last_;
  int pairs_ = 0, observed_ = 0, predicted_ = 0, predicted_seen_ = 0, raw_ = 0, detected_ = 0;
  int judged_ = 0, stereo_judged_ = 0, stereo_right_ = 0;
  std::vector<double> lengths_px_, edge_errors_px_, edge_offsets_px_;
};

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc < 2) {
    fprintf(stderr,
            "usage: line_quality SEQUENCE [lsd|fld|ed [first_image pairs step "
            "[folder_for_pictures]]]\n");
    return 2;
  }
  const auto kind =
      argc > 2 ? slcmap::LineDetectorFromName(argv[2]) : slcmap::LineDetectorOptions().kind;
  const int first = argc > 5 ? std::atoi(argv[3]) : 0;
  const int pairs = argc > 5 ? std::atoi(argv[4]) : 100;
  const int step = argc > 5 ? std::atoi(argv[5]) : 4;
  slcmap::Benchmark(argv[1], kind, argc > 6 ? argv[6] : "").Run(first, pairs, step);
}
