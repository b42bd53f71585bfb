#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/report.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/ply.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {
namespace {

double SumLengths(const std::vector<PlySegment>& segments) {
  double length_m = 0;
  for (const PlySegment& segment : segments) length_m += Length(segment);
  return length_m;
}

constexpr double kSample_m = 0.02;  // between samples along mapped lines and true edges
// Between a sample's direction and that of what it is compared with.
constexpr double kMaxAngle_rad = 10 / kDegreesPerRadian;
constexpr double kSpacing_m = 0.1;    // of the points that stand for a segment in the tree
constexpr double kRounding_m = 1e-3;  // beyond that of the tree's floats

double Angle(const PlySegment& segment, const Eigen::Vector3d& direction) {
  return LineAngle_rad(segment.end_world - segment.start_world, direction);
}

// Points along the segments, none further than half the spacing from a place on its segment, and
// which one each is of.
std::vector<Eigen::Vector3f> PointsAlong(const std::vector<PlySegment>& segments,
                                         std::vector<std::size_t>* segment_of) {
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Eigen::Vector3d along = segments[i].end_world - segments[i].start_world;
    const double count = std::max(std::ceil(along.norm() / kSpacing_m), 1.0);
    for (double k = 0.5; k < count; ++k) {
      points.push_back((segments[i].start_world + k / count * along).cast<float>());
      segment_of->push_back(i);
    }
  }
  return points;
}

// Finds the segment that lies beside a point.
class SegmentIndex {
 public:
  // How a point with a direction lies to the segment found.
  struct Match {
    double distance_m = 0;
    double angle_rad = 0;  // between the directions, in [0, pi / 2]: a segment has no sense
    std::size_t segment = 0;
  };

  // All segments must have an extent.
  explicit SegmentIndex(std::vector<PlySegment> segments)
      : segments_(std::move(segments)), tree_(PointsAlong(segments_, &segment_of_)) {}

  // The nearest of the segments within both limits; distances are to the segment, not to its line.
  // `direction` has length 1.
  std::optional<Match> Nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                               double max_distance_m, double max_angle_rad) const {
    PointTree::Found near;
    tree_.FindWithin(point.cast<float>(), max_distance_m + kSpacing_m / 2 + kRounding_m, &near);
    std::vector<int>& found = near.items;
    for (int& index : found) index = static_cast<int>(segment_of_[index]);
    // In the order of segments, so that the first of equally near ones is chosen.
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    std::optional<Match> best;
    for (const int index : found) {
      const PlySegment& segment = segments_[static_cast<std::size_t>(index)];
      const Match match{Distance_m(segment, point), Angle(segment, direction),
                        static_cast<std::size_t>(index)};
      if (match.distance_m > max_distance_m || match.angle_rad > max_angle_rad) continue;
      if (!best || match.distance_m < best->distance_m) best = match;
    }
    return best;
  }

 private:
  std::vector<PlySegment> segments_;
  std::vector<std::size_t> segment_of_;  // by point of the tree
  PointTree tree_;
};

// Calls visit(segment, length, match) for each sample of the segments, one segment after the other:
// the length that it stands for, and the nearest of the others up to the largest tolerance, if any.
template <typename Visitor>
void ForEachSample(const std::vector<PlySegment>& segments, const SegmentIndex& others,
                   const Progress& progress, Visitor visit) {
  constexpr int kReportEvery = 256;
  const double all_m = SumLengths(segments);
  double done_m = 0;
  int samples = 0;
  for (const PlySegment& segment : segments) {
    const double length_m = Length(segment);
    const Eigen::Vector3d along = segment.end_world - segment.start_world;
    const double count = std::max(std::round(length_m / kSample_m), 1.0);
    for (double i = 0.5; i < count; ++i) {
      if (samples++ % kReportEvery == 0) {
        progress.ReportOrStop((done_m + i / count * length_m) / all_m);
      }
      visit(segment, length_m / count,
            others.Nearest(segment.start_world + i / count * along, along / length_m,
                           kLineTolerances_m.back(), kMaxAngle_rad));
    }
    done_m += length_m;
  }
}

// The length of the samples that have a match up to each tolerance.
class MatchedLengths {
 public:
  void Add(double length_m, double distance_m) {
    for (std::size_t i = 0; i < kLineTolerances_m.size(); ++i) {
      if (distance_m <= kLineTolerances_m[i]) lengths_m_[i] += length_m;
    }
  }

  double at(std::size_t tolerance) const { return lengths_m_[tolerance]; }

 private:
  std::array<double, kLineTolerances_m.size()> lengths_m_{};
};

// Sums, each sample counted by the length that it stands for.
struct AccuracySums {
  double length_m = 0, angle = 0, squared_angle = 0, squared_distance = 0;

  void Add(double part_m, double angle_rad, double part_squared_distance) {
    length_m += part_m;
    angle += part_m * angle_rad;
    squared_angle += part_m * angle_rad * angle_rad;
    squared_distance += part_squared_distance;
  }

  std::optional<LineAccuracy> Result() const {
    if (length_m == 0) return std::nullopt;
    return LineAccuracy{length_m, kDegreesPerRadian * angle / length_m,
                        kDegreesPerRadian * std::sqrt(squared_angle / length_m),
                        std::sqrt(squared_distance / length_m)};
  }
};

// Compares each line with the edges that its samples lie on. An edge that is bent has the mean
// direction of the pieces that the line covers, which is that of the chord of this part.
class EdgeAccuracy {
 public:
  explicit EdgeAccuracy(const TrueEdges& truth) : truth_(truth) {}

  // The samples of a line follow each other.
  void Add(const PlySegment& line, double sample_m, const SegmentIndex::Match& match) {
    if (&line != line_) Finish();
    line_ = &line;
    const auto edge = static_cast<int64_t>(match.segment);
    Covered& covered = edges_[truth_.edge_of_whole.empty() ? edge : truth_.edge_of_whole[edge]];
    const PlySegment& piece = truth_.whole[match.segment];
    const Eigen::Vector3d direction = (piece.end_world - piece.start_world).normalized();
    covered.directions +=
        covered.directions.dot(direction) < 0 ? Eigen::Vector3d(-direction) : direction;
    covered.length_m += sample_m;
    covered.squared_distance += sample_m * match.distance_m * match.distance_m;
  }

  std::optional<LineAccuracy> Result() {
    Finish();
    return sums_.Result();
  }

 private:
  struct Covered {
    Eigen::Vector3d directions = Eigen::Vector3d::Zero();
    double length_m = 0, squared_distance = 0;
  };

  void Finish() {
    if (!line_) return;
    const Eigen::Vector3d along = line_->end_world - line_->start_world;
    for (const auto& [edge, covered] : edges_) {
      const double angle_rad = std::atan2(along.cross(covered.directions).norm(),
                                          std::abs(along.dot(covered.directions)));
      sums_.Add(covered.length_m, angle_rad, covered.squared_distance);
    }
    edges_.clear();
    line_ = nullptr;
  }

  const TrueEdges& truth_;
  const PlySegment* line_ = nullptr;
  std::map<int64_t, Covered> edges_;  // of the line
  AccuracySums sums_;
};

std::vector<PlySegment> WithExtent(const std::vector<MapLine>& lines) {
  std::vector<PlySegment> segments;
  for (const MapLine& line : lines) {
    if (line.start_world != line.end_world) segments.push_back({line.start_world, line.end_world});
  }
  return segments;
}

// Before the first of them is made. A length that is not finite is refused too.
void CheckSamples(const TrueEdges& truth, const std::vector<PlySegment>& mapped, int max_samples) {
  double edges_m = std::max(SumLengths(truth.whole), SumLengths(truth.seen));
  if (truth.clear) edges_m = std::max(edges_m, SumLengths(*truth.clear));
  const double lines_m = SumLengths(mapped);
  const double samples = (edges_m + lines_m) / kSample_m;
  if (samples <= max_samples) return;
  throw DataError(
      fmt::format("found {:.6g} m of edges and {:.6g} m of lines, which take {:.3g} samples every "
                  "{} m; expected at most {} samples (--max-samples): are both in metres?",
                  edges_m, lines_m, samples, kSample_m, max_samples));
}

// The length of the segments that others lie beside, by tolerance.
MatchedLengths CoveredLengths(const std::vector<PlySegment>& segments, const SegmentIndex& others,
                              const Progress& progress = {}) {
  MatchedLengths covered;
  ForEachSample(segments, others, progress,
                [&](const PlySegment&, double length_m, const auto& match) {
                  if (match) covered.Add(length_m, match->distance_m);
                });
  return covered;
}

}  // namespace

LineMetrics EvaluateLines(const TrueEdges& truth, const std::vector<MapLine>& lines,
                          int max_samples, const Progress& progress) {
  const std::vector<PlySegment> mapped = WithExtent(lines);
  CheckSamples(truth, mapped, max_samples);
  LineMetrics metrics;
  metrics.lines = static_cast<int64_t>(lines.size());
  metrics.without_extent = static_cast<int64_t>(lines.size() - mapped.size());
  metrics.mapped_length_m = SumLengths(mapped);
  metrics.seen_length_m = SumLengths(truth.seen);

  const double seen_done = truth.clear ? 0.9 : 1;
  const SegmentIndex mapped_index(mapped);
  MatchedLengths correct;
  EdgeAccuracy accuracy(truth);
  ForEachSample(mapped, SegmentIndex(truth.whole), progress.Part(0, 0.5),
                [&](const PlySegment& line, double length_m, const auto& match) {
                  if (!match) return;
                  correct.Add(length_m, match->distance_m);
                  accuracy.Add(line, length_m, *match);
                });
  const MatchedLengths covered =
      CoveredLengths(truth.seen, mapped_index, progress.Part(0.5, seen_done));
  for (std::size_t i = 0; i < kLineTolerances_m.size(); ++i) {
    metrics.scores.push_back({kLineTolerances_m[i], covered.at(i),
                              ComputeShare(covered.at(i), metrics.seen_length_m), std::nullopt,
                              correct.at(i), ComputeShare(correct.at(i), metrics.mapped_length_m),
                              ComputeShare(metrics.mapped_length_m, covered.at(i))});
  }
  metrics.accuracy = accuracy.Result();
  if (truth.clear) {
    metrics.clear_length_m = SumLengths(*truth.clear);
    const MatchedLengths clear =
        CoveredLengths(*truth.clear, mapped_index, progress.Part(seen_done, 1));
    for (std::size_t i = 0; i < kLineTolerances_m.size(); ++i) {
      metrics.scores[i].clear_recall = ComputeShare(clear.at(i), *metrics.clear_length_m);
    }
  }
  return metrics;
}

void EvaluateMarks(const TrueEdges& truth, const std::vector<MapLine>& marks, int max_samples,
                   LineMetrics* metrics) {
  const std::vector<PlySegment> mapped = WithExtent(marks);
  CheckSamples(truth, mapped, max_samples);
  metrics->marks_length_m = SumLengths(mapped);
  const MatchedLengths on_edges = CoveredLengths(mapped, SegmentIndex(truth.whole));
  for (std::size_t i = 0; i < metrics->scores.size(); ++i) {
    const LineScore& score = metrics->scores[i];
    const double edges_m = score.correct_m;
    const double others_m = metrics->mapped_length_m - edges_m;
    const double marks_m = metrics->marks_length_m - on_edges.at(i);
    metrics->kinds.push_back({score.tolerance_m, ComputeShare(others_m, others_m + marks_m),
                              ComputeShare(on_edges.at(i), on_edges.at(i) + edges_m)});
  }
}

std::vector<MapLine> Aligned(const Alignment& alignment, std::vector<MapLine> lines) {
  for (MapLine& line : lines) {
    line.start_world = alignment.Position(line.start_world);
    line.end_world = alignment.Position(line.end_world);
  }
  return lines;
}

namespace {

using Json = nlohmann::ordered_json;

Json ScoreJson(const LineScore& score) {
  Json json = {{"tolerance_m", score.tolerance_m},
               {"recall_m", score.recall_m},
               {"recall", score.recall},
               {"precision", score.precision},
               {"redundancy", score.redundancy}};
  if (score.clear_recall) json["clear_recall"] = *score.clear_recall;
  return json;
}

Json KindsJson(const LineMetrics& metrics) {
  Json json = {{"marks_length_m", metrics.marks_length_m}, {"scores", Json::array()}};
  for (const KindScore& score : metrics.kinds) {
    json["scores"].push_back({{"tolerance_m", score.tolerance_m},
                              {"marks_called_edges", score.marks_called_edges},
                              {"edges_called_marks", score.edges_called_marks}});
  }
  return json;
}

Json AccuracyJson(const LineAccuracy& accuracy) {
  return {{"length_m", accuracy.length_m},
          {"direction_mean_deg", accuracy.direction_mean_deg},
          {"direction_rms_deg", accuracy.direction_rms_deg},
          {"offset_rms_m", accuracy.offset_rms_m}};
}

}  // namespace

Json LineJson(const ComparedFiles& inputs, const LineMetrics& metrics) {
  Json json = {{"true_edges", inputs.truth},
               {"file", inputs.mapped},
               {"lines", metrics.lines},
               {"without_extent", metrics.without_extent},
               {"mapped_length_m", metrics.mapped_length_m},
               {"seen_length_m", metrics.seen_length_m}};
  if (metrics.clear_length_m) json["clear_length_m"] = *metrics.clear_length_m;
  json["scores"] = Json::array();
  for (const LineScore& score : metrics.scores) json["scores"].push_back(ScoreJson(score));
  json["accuracy"] = metrics.accuracy ? AccuracyJson(*metrics.accuracy) : Json();
  if (!metrics.kinds.empty()) json["kinds"] = KindsJson(metrics);
  return json;
}

}  // namespace slcmap::evaluation
