#include "apps/maps/map_straightness.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "apps/evaluation/report.h"
#include "data/core/math.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kAround_m = 0.15;
constexpr double kAcrossLayer_m = 0.075;              // the other face of a thin wall is further
constexpr double kStorey_m = 2.75;                    // that leaning is told for
constexpr double kMaxOffSquare_deg = 3, kNear_m = 1;  // of faces that an angle is between
constexpr size_t kLookedAt = 3000;
constexpr size_t kFewAround = 10, kManyAround = 600;

struct Layer {
  double mpv_m2 = kNoFigure, mme = kNoFigure;
};

// The variances of points about a place, ascending; the least as if there were endless of them.
std::optional<Vector3d> VariancesAround(const SurfaceMap& map, const std::vector<int>& found,
                                        const SurfaceCube& at) {
  if (found.size() < kFewAround) return std::nullopt;
  const size_t step = found.size() / kManyAround + 1;
  Vector3d mean = Vector3d::Zero();
  Matrix3d products = Matrix3d::Zero();
  double count = 0;
  for (size_t i = 0; i < found.size(); i += step) {
    const Vector3d offset = map.points()[static_cast<size_t>(found[i])] - at.p;
    if (std::abs(at.normal.dot(offset)) > kAcrossLayer_m) continue;
    mean += offset;
    products += offset * offset.transpose();
    count += 1;
  }
  if (count < kFewAround) return std::nullopt;
  mean /= count;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(products / count - mean * mean.transpose());
  Vector3d variances = (solver.eigenvalues() * count / (count - 1)).cwiseMax(1e-12);
  variances[0] *= (count - 1) / (count - 3);
  return variances;
}

Layer MeasureLayer(const SurfaceMap& map) {
  std::vector<Eigen::Vector3f> places;
  if (map.points().empty()) return {};
  const Vector3d origin = map.points().front();
  for (const Vector3d& p : map.points()) places.push_back((p - origin).cast<float>());
  const PointTree tree(places);
  PointTree::Found found;
  const double radius_m = std::max(kAround_m, 2 * map.cube_m());
  const double two_pi_e = 2 * std::numbers::pi * std::numbers::e;
  double variances_m2 = 0, entropies = 0, count = 0;
  for (const size_t cube : map.SomePlanes(kLookedAt)) {
    const SurfaceCube& at = map.cubes()[cube];
    tree.FindWithin((at.p - origin).cast<float>(), radius_m, &found);
    const auto variances = VariancesAround(map, found.items, at);
    if (!variances) continue;
    variances_m2 += (*variances)[0];
    entropies += 0.5 * (3 * std::log(two_pi_e) + variances->array().log().sum());
    ++count;
  }
  if (count == 0) return {};
  return {variances_m2 / count, entropies / count};
}

// The stretch of a face along a direction, from a place.
Interval FindExtent(const FoundFace& face, const Vector3d& direction, const Vector3d& from,
                    const Vector3d& up) {
  const Vector3d half = 0.5 * face.length_m * up.cross(face.normal).normalized();
  const auto [from_m, to_m] = std::minmax(
      {direction.dot(face.middle - half - from), direction.dot(face.middle + half - from)});
  return {from_m, to_m};
}

// How far faces are from 90 degrees that are about so and within a metre of each other.
std::optional<double> FindOffSquare_deg(const FoundFace& a, const FoundFace& b,
                                        const Vector3d& up) {
  const auto level = [&](const Vector3d& n) { return Vector3d((n - up * up.dot(n)).normalized()); };
  // Of parallel ones it may be rounded to more than 1.
  const double off_rad = std::asin(std::clamp(level(a.normal).dot(level(b.normal)), -1.0, 1.0));
  if (std::abs(off_rad) > kMaxOffSquare_deg / kDegreesPerRadian) return std::nullopt;
  for (const auto& [face, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const Interval stretch = FindExtent(*face, other->normal, other->middle, up);
    if (stretch.from_m > kNear_m || stretch.to_m < -kNear_m) return std::nullopt;
  }
  return std::abs(off_rad) * kDegreesPerRadian;
}

double MeanSquareRoot(double squares, double weights) {
  return weights > 0 ? std::sqrt(squares / weights) : kNoFigure;
}

}  // namespace

std::vector<StraightedgeFigures> Summarize(
    const std::vector<std::vector<LaidStraightedge>>& pieces) {
  std::vector<StraightedgeFigures> figures;
  for (const double length_m : kMapStraightedges_m) {
    StraightedgeFigures all;
    all.length_m = length_m;
    double squares = 0;
    std::vector<double> gaps_m;
    for (const std::vector<LaidStraightedge>& piece : pieces) {
      for (const LaidStraightedge& laid : piece) {
        if (laid.length_m != length_m) continue;
        ++all.pieces;
        all.laid_m += laid.laid_m;
        squares += laid.laid_m * laid.rms_m * laid.rms_m;
        gaps_m.push_back(laid.gap_m);
        all.within_din += laid.gap_m <= AllowedGap_m(length_m);
      }
    }
    all.rms_m = MeanSquareRoot(squares, all.laid_m);
    all.gap_median_m = QuantileFigure(gaps_m, 0.5);
    all.gap_worst_m = QuantileFigure(gaps_m, 1);
    figures.push_back(all);
  }
  return figures;
}

WallStraightness MeasureWalls(const SurfaceMap& map, const BuildingAxes& axes,
                              const std::vector<FoundFace>& faces) {
  WallStraightness result;
  const Vector3d up = axes.axes.col(2);
  std::vector<std::vector<LaidStraightedge>> laid;
  double lean_squares = 0;
  for (const FoundFace& face : faces) {
    ++result.walls;
    result.length_m += face.length_m;
    const double area_m2 = face.length_m * face.height_m;
    result.area_m2 += area_m2;
    laid.push_back(LayStraightedges(face.samples, face.noise_m));
    const double lean_m = kStorey_m * std::asin(face.normal.dot(up));
    lean_squares += area_m2 * lean_m * lean_m;
  }
  result.straightedges = Summarize(laid);
  result.lean_rms_m = MeanSquareRoot(lean_squares, result.area_m2);
  result.tilt_deg = axes.is_z_up ? axes.tilt_deg : kNoFigure;
  double angle_squares = 0, legs_m = 0;
  for (size_t i = 0; i < faces.size(); ++i) {
    for (size_t j = i + 1; j < faces.size(); ++j) {
      const auto off_deg = FindOffSquare_deg(faces[i], faces[j], up);
      if (!off_deg) continue;
      const double leg_m = std::min(faces[i].length_m, faces[j].length_m);
      ++result.angles;
      angle_squares += leg_m * *off_deg * *off_deg;
      legs_m += leg_m;
    }
  }
  result.angle_rms_deg = MeanSquareRoot(angle_squares, legs_m);
  const Layer layer = MeasureLayer(map);
  result.thickness_m = std::sqrt(layer.mpv_m2);
  result.mme = layer.mme;
  return result;
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kReach_m = 0.5;    // along an edge, between pieces of it
constexpr double kAside_m = 0.05;   // across it
constexpr double kTurn_rad = 0.09;  // between pieces that follow each other, and
constexpr double kEnd_m = 0.02;     // what an end may be off, that turns short pieces
constexpr double kKnot_m = 0.25;    // between the places by which pieces find each other
constexpr double kSample_m = 0.02;  // along a piece
constexpr double kLeastEdge_m = 0.3;
constexpr double kStretch_m = 1;  // whose direction counts as one

Vector3d Direction(const PlySegment& s) { return (s.end_world - s.start_world).normalized(); }

// Whether a piece goes on in another, seen from the first.
bool GoesOnIn(const PlySegment& a, const PlySegment& b) {
  const double turn_rad = std::acos(std::min(1.0, std::abs(Direction(a).dot(Direction(b)))));
  const double shorter_m = std::min(Length(a), Length(b));
  if (turn_rad > kTurn_rad + std::atan(kEnd_m / shorter_m)) return false;
  const Vector3d along = Direction(a);
  double from_m = along.dot(b.start_world - a.start_world),
         to_m = along.dot(b.end_world - a.start_world);
  Vector3d from = b.start_world, to = b.end_world;
  if (from_m > to_m) std::swap(from_m, to_m), std::swap(from, to);
  if (from_m > Length(a) + kReach_m || to_m < -kReach_m) return false;
  // Across, where they are beside each other, or where the second is nearest.
  const double at_m = std::clamp(0.5 * Length(a), from_m, to_m);
  const double share = to_m > from_m ? (at_m - from_m) / (to_m - from_m) : 0;
  const double near_share =
      std::clamp(share, std::clamp(-from_m / std::max(1e-9, to_m - from_m), 0.0, 1.0),
                 std::clamp((Length(a) - from_m) / std::max(1e-9, to_m - from_m), 0.0, 1.0));
  const Vector3d near = from + near_share * (to - from) - a.start_world;
  return (near - along.dot(near) * along).norm() < kAside_m;
}

class PieceSets {
 public:
  explicit PieceSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), size_t{0});
  }
  size_t Root(size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(size_t a, size_t b) {
    const size_t first = Root(a), second = Root(b);
    parent_[std::max(first, second)] = std::min(first, second);
  }

 private:
  std::vector<size_t> parent_;
};

// Calls visit with places along a piece, both ends among them, at most step_m apart.
template <typename Visit>
void AlongPiece(const PlySegment& s, double step_m, Visit visit) {
  const int steps = std::max(1, static_cast<int>(std::ceil(Length(s) / step_m)));
  for (int i = 0; i <= steps; ++i) {
    visit(Vector3d(s.start_world + (s.end_world - s.start_world) * i / steps));
  }
}

using Edge = std::vector<PlySegment>;

// The ends of pieces, and who ends there.
using EndPlace = std::array<int64_t, 3>;
using EndsAt = std::map<EndPlace, std::vector<size_t>>;

EndPlace RoundEnd(const Vector3d& p) {
  constexpr double kGrid_m = 1e-4;
  return {std::llround(p.x() / kGrid_m), std::llround(p.y() / kGrid_m),
          std::llround(p.z() / kGrid_m)};
}

// The places of a chain that stay where it is drawn as straight as its ends are known, and both
// ends (D. Douglas and T. Peucker, 1973).
std::vector<size_t> FindCorners(const std::vector<Vector3d>& chain) {
  std::vector<size_t> corners = {0, chain.size() - 1};
  std::vector<std::pair<size_t, size_t>> left = {{0, chain.size() - 1}};
  while (!left.empty()) {
    const auto [from, to] = left.back();
    left.pop_back();
    const Vector3d chord = chain[to] - chain[from];
    size_t farthest = from;
    double most_m = kEnd_m;
    for (size_t i = from + 1; i < to; ++i) {
      const Vector3d offset = chain[i] - chain[from];
      const double share =
          chord.isZero() ? 0 : std::clamp(offset.dot(chord) / chord.squaredNorm(), 0.0, 1.0);
      const double off_m = (offset - share * chord).norm();
      if (off_m > most_m) most_m = off_m, farthest = i;
    }
    if (farthest == from) continue;
    corners.push_back(farthest);
    left.insert(left.end(), {{from, farthest}, {farthest, to}});
  }
  std::ranges::sort(corners);
  return corners;
}

// Pieces in a row, each of which ends where the next one begins, and the places between them.
struct Chain {
  std::vector<size_t> pieces;
  std::vector<Vector3d> places;
};

Chain FollowChain(const std::vector<PlySegment>& lines, const EndsAt& ends, size_t first,
                  bool backwards, std::vector<bool>* passed) {
  Chain chain{{}, {backwards ? lines[first].end_world : lines[first].start_world}};
  for (size_t piece = first; !(*passed)[piece];) {
    (*passed)[piece] = true;
    const PlySegment& line = lines[piece];
    const bool is_turned = RoundEnd(line.start_world) != RoundEnd(chain.places.back());
    chain.pieces.push_back(piece);
    chain.places.push_back(is_turned ? line.start_world : line.end_world);
    const std::vector<size_t>& next = ends.at(RoundEnd(chain.places.back()));
    if (next.size() == 2) piece = next[0] == piece ? next[1] : next[0];
  }
  return chain;
}

// Pieces that follow each other straight on, as one: its direction does not hang on how short they
// are.
std::vector<std::pair<PlySegment, std::vector<size_t>>> FindRuns(
    const std::vector<PlySegment>& lines) {
  EndsAt ends;
  for (size_t i = 0; i < lines.size(); ++i) {
    ends[RoundEnd(lines[i].start_world)].push_back(i);
    ends[RoundEnd(lines[i].end_world)].push_back(i);
  }
  std::vector<std::pair<PlySegment, std::vector<size_t>>> runs;
  std::vector<bool> passed(lines.size(), false);
  const auto follow = [&](size_t first, bool backwards) {
    const Chain chain = FollowChain(lines, ends, first, backwards, &passed);
    if (chain.pieces.empty()) return;
    const std::vector<size_t> kept = FindCorners(chain.places);
    for (size_t k = 1; k < kept.size(); ++k) {
      const auto at = [&](size_t i) { return chain.pieces.begin() + static_cast<int64_t>(i); };
      runs.push_back(
          {{chain.places[kept[k - 1]], chain.places[kept[k]]}, {at(kept[k - 1]), at(kept[k])}});
    }
  };
  for (size_t i = 0; i < lines.size(); ++i) {
    for (const bool backwards : {false, true}) {
      const Vector3d& end = backwards ? lines[i].end_world : lines[i].start_world;
      if (ends.at(RoundEnd(end)).size() != 2) follow(i, backwards);
    }
  }
  for (size_t i = 0; i < lines.size(); ++i) follow(i, false);  // those that close
  return runs;
}

std::vector<Edge> AssembleEdges(const std::vector<PlySegment>& pieces) {
  const auto runs = FindRuns(pieces);
  std::vector<PlySegment> lines;
  for (const auto& [line, own] : runs) lines.push_back(line);
  std::vector<Eigen::Vector3f> knots;
  std::vector<size_t> piece_of;
  const Vector3d origin = lines.front().start_world;
  for (size_t i = 0; i < lines.size(); ++i) {
    AlongPiece(lines[i], kKnot_m, [&](const Vector3d& p) {
      knots.push_back((p - origin).cast<float>());
      piece_of.push_back(i);
    });
  }
  const PointTree tree(knots);
  PieceSets sets(lines.size());
  PointTree::Found found;
  for (size_t i = 0; i < knots.size(); ++i) {
    tree.FindWithin(knots[i], kReach_m + kAside_m, &found);
    for (const int item : found.items) {
      const size_t a = piece_of[i], b = piece_of[static_cast<size_t>(item)];
      if (a >= b || sets.Root(a) == sets.Root(b)) continue;
      const bool is_longer = Length(lines[a]) >= Length(lines[b]);
      if (GoesOnIn(lines[is_longer ? a : b], lines[is_longer ? b : a])) sets.Join(a, b);
    }
  }
  std::map<size_t, Edge> edges;
  for (size_t i = 0; i < runs.size(); ++i) {
    for (const size_t piece : runs[i].second) edges[sets.Root(i)].push_back(pieces[piece]);
  }
  std::vector<Edge> all;
  for (auto& [root, edge] : edges) all.push_back(std::move(edge));
  return all;
}

// An edge by places along it, each with its share of the length: where pieces lie beside each
// other, they share it.
struct EdgePlaces {
  Vector3d middle, along, first_across, second_across;
  std::vector<Vector3d> places;  // along, off in two directions
  std::vector<double> weights_m;
  double length_m = 0, covered_m = 0;
};

EdgePlaces PlaceEdge(const Edge& edge) {
  EdgePlaces result;
  std::vector<Vector3d> samples;
  std::vector<double> weights;
  for (const PlySegment& piece : edge) {
    const int steps = std::max(1, static_cast<int>(std::ceil(Length(piece) / kSample_m)));
    for (int i = 0; i < steps; ++i) {
      samples.push_back(piece.start_world +
                        (piece.end_world - piece.start_world) * (i + 0.5) / steps);
      weights.push_back(Length(piece) / steps);
    }
  }
  double sum = 0;
  result.middle = Vector3d::Zero();
  for (size_t i = 0; i < samples.size(); ++i) {
    result.middle += weights[i] * samples[i];
    sum += weights[i];
  }
  result.middle /= sum;
  Matrix3d spread = Matrix3d::Zero();
  for (size_t i = 0; i < samples.size(); ++i) {
    const Vector3d offset = samples[i] - result.middle;
    spread += weights[i] * offset * offset.transpose();
  }
  const Matrix3d axes = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors();
  result.along = axes.col(2), result.first_across = axes.col(1), result.second_across = axes.col(0);
  std::map<int64_t, double> lengths_m;  // of pieces, by place along the edge
  const auto cell = [](double along_m) {
    return static_cast<int64_t>(std::floor(along_m / (2 * kSample_m)));
  };
  for (const Vector3d& sample : samples) {
    const Vector3d offset = sample - result.middle;
    result.places.emplace_back(result.along.dot(offset), result.first_across.dot(offset),
                               result.second_across.dot(offset));
  }
  for (size_t i = 0; i < samples.size(); ++i) {
    const double low_m = result.places[i].x() - 0.5 * weights[i], high_m = low_m + weights[i];
    for (int64_t at = cell(low_m); at <= cell(high_m); ++at) {
      const double from_m = 2 * kSample_m * static_cast<double>(at);
      lengths_m[at] += std::min(high_m, from_m + 2 * kSample_m) - std::max(low_m, from_m);
    }
  }
  double from_m = HUGE_VAL, to_m = -HUGE_VAL;
  for (size_t i = 0; i < samples.size(); ++i) {
    const double beside = std::max(1.0, lengths_m[cell(result.places[i].x())] / (2 * kSample_m));
    result.weights_m.push_back(weights[i] / beside);
    result.covered_m += result.weights_m.back();
    from_m = std::min(from_m, result.places[i].x());
    to_m = std::max(to_m, result.places[i].x());
  }
  result.length_m = to_m - from_m;
  return result;
}

// The straightedges of both directions across an edge, as distances from one line.
std::vector<LaidStraightedge> LayOnEdge(const EdgePlaces& edge) {
  std::vector<std::vector<LaidStraightedge>> both;
  for (const int across : {1, 2}) {
    std::vector<StraightSample> samples;
    for (size_t i = 0; i < edge.places.size(); ++i) {
      samples.push_back({edge.places[i].x(), 0, edge.places[i][across], edge.weights_m[i]});
    }
    both.push_back(LayStraightedges(std::move(samples), 0));
  }
  std::vector<LaidStraightedge> laid;
  for (const LaidStraightedge& first : both[0]) {
    for (const LaidStraightedge& second : both[1]) {
      if (first.length_m != second.length_m) continue;
      laid.push_back({first.length_m, first.laid_m, std::hypot(first.rms_m, second.rms_m),
                      std::max(first.gap_m, second.gap_m)});
    }
  }
  return laid;
}

// Directions of stretches of an edge, of a metre or the whole of it.
void AddDirections(const EdgePlaces& edge, std::vector<WeightedDirection>* directions) {
  const int stretches = std::max(1, static_cast<int>(std::floor(edge.length_m / kStretch_m)));
  double from_m = HUGE_VAL;
  for (const Vector3d& p : edge.places) from_m = std::min(from_m, p.x());
  for (int k = 0; k < stretches; ++k) {
    const double start_m = from_m + edge.length_m * k / stretches;
    const double end_m = from_m + edge.length_m * (k + 1) / stretches;
    double sum = 0, squares = 0;
    Vector3d mean = Vector3d::Zero(), with_along = Vector3d::Zero();
    for (size_t i = 0; i < edge.places.size(); ++i) {
      if (edge.places[i].x() < start_m || edge.places[i].x() > end_m) continue;
      const double x = edge.places[i].x() - start_m, w = edge.weights_m[i];
      sum += w, squares += w * x * x;
      mean += w * Vector3d(x, edge.places[i].y(), edge.places[i].z());
      with_along += w * x * Vector3d(x, edge.places[i].y(), edge.places[i].z());
    }
    if (!(sum > 0)) continue;
    mean /= sum;
    const double spread = squares / sum - mean.x() * mean.x();
    if (!(spread > 0)) continue;
    const Vector3d slope = (with_along / sum - mean.x() * mean) / spread;
    const Vector3d direction =
        edge.along + slope.y() * edge.first_across + slope.z() * edge.second_across;
    directions->push_back({direction.normalized(), sum});
  }
}

}  // namespace

LineStraightness MeasureLines(const std::vector<PlySegment>& lines) {
  LineStraightness result;
  if (lines.empty()) return result;
  std::vector<std::vector<LaidStraightedge>> laid;
  std::vector<WeightedDirection> directions;
  for (const PlySegment& line : lines) result.length_m += Length(line);
  result.pieces = static_cast<int64_t>(lines.size());
  for (const Edge& edge : AssembleEdges(lines)) {
    const EdgePlaces places = PlaceEdge(edge);
    result.edges_m += places.covered_m;
    if (places.length_m < kLeastEdge_m) continue;
    ++result.edges;
    laid.push_back(LayOnEdge(places));
    AddDirections(places, &directions);
  }
  result.straightedges = Summarize(laid);
  result.directions = MeasureDirections(directions);
  return result;
}

}  // namespace slcmap::evaluation
