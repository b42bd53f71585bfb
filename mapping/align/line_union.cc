#include "mapping/align/line_union.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "data/core/math.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_merging.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kSameAxis_rad = 0.02;
constexpr double kInPiece_m = 1e-6;  // of the ends of a line within a piece that was made of it

using PieceKey = std::pair<int64_t, int>;

// The axes of the first map, and those that the second adds, each with its direction.
class UnitedAxes {
 public:
  struct Axis {
    LineAxis axis = LineAxis::kVertical;
    int world = -1;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  };

  void AddFirst(const std::vector<MapLine>& lines) {
    for (const auto& [key, direction] : GatherDirections(lines)) Add(key, direction);
  }

  // Renames the axes of the lines of another map.
  void AddSecond(std::vector<MapLine>* lines) {
    std::map<std::pair<LineAxis, int>, std::pair<LineAxis, int>> names;
    std::map<std::pair<bool, int>, int> new_worlds;  // of the second's, sloped or not
    for (const auto& [key, direction] : GatherDirections(*lines)) {
      if (const Axis* known = Near(direction)) {
        names[key] = {known->axis, known->world};
        continue;
      }
      const auto [world, is_new] =
          new_worlds.insert({{key.first == LineAxis::kSloped, key.second}, NextWorld(key.first)});
      names[key] = {key.first, key.second < 0 ? -1 : world->second};
      Add(names[key], direction);
    }
    for (MapLine& line : *lines) {
      if (line.axis == LineAxis::kNone) continue;
      std::tie(line.axis, line.world) = names.at({line.axis, line.world});
    }
  }

  // That a line of no axis may be merged with lines of; -1: none.
  int FindIndex(const Eigen::Vector3d& direction) const {
    const Axis* axis = Near(direction);
    return axis ? static_cast<int>(axis - axes_.data()) : -1;
  }

 private:
  using Key = std::pair<LineAxis, int>;

  static std::map<Key, Eigen::Vector3d> GatherDirections(const std::vector<MapLine>& lines) {
    std::map<Key, Eigen::Matrix3d> moments;
    for (const MapLine& line : lines) {
      if (line.axis == LineAxis::kNone) continue;
      const Eigen::Vector3d way = line.end_world - line.start_world;
      Eigen::Matrix3d& moment =
          moments.try_emplace({line.axis, line.world}, Eigen::Matrix3d::Zero()).first->second;
      moment += way * way.transpose();
    }
    std::map<Key, Eigen::Vector3d> directions;
    for (const auto& [key, moment] : moments) {
      directions[key] =
          Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors().col(2);
    }
    return directions;
  }

  void Add(const Key& key, const Eigen::Vector3d& direction) {
    axes_.push_back({key.first, key.second, direction});
  }

  const Axis* Near(const Eigen::Vector3d& direction) const {
    const Axis* nearest = nullptr;
    double best = std::cos(kSameAxis_rad);
    for (const Axis& axis : axes_) {
      const double cosine = std::abs(axis.direction.dot(direction));
      if (cosine < best) continue;
      best = cosine;
      nearest = &axis;
    }
    return nearest;
  }

  int NextWorld(LineAxis kind) const {
    int next = 0;
    for (const Axis& axis : axes_) {
      if ((axis.axis == LineAxis::kSloped) == (kind == LineAxis::kSloped)) {
        next = std::max(next, axis.world + 1);
      }
    }
    return next;
  }

  std::vector<Axis> axes_;
};

// A line of one of the maps: its pieces share their id.
struct SourceLine {
  int map = 0;
  std::vector<MapLine> pieces;
  std::vector<const LineCovariance*> covariances;  // by piece; null: not known
};

std::vector<SourceLine> CollectSourceLines(const LinesOfMap& map, int number) {
  std::map<int64_t, SourceLine> by_id;
  for (const MapLine& piece : map.lines) {
    SourceLine& line = by_id[piece.id];
    line.map = number;
    line.pieces.push_back(piece);
  }
  for (auto& [id, line] : by_id) line.covariances.resize(line.pieces.size());
  for (const LineCovariance& covariance : map.evidence.covariances) {
    by_id.at(covariance.line_id).covariances[covariance.piece] = &covariance;
  }
  std::vector<SourceLine> lines;
  for (auto& [id, line] : by_id) lines.push_back(std::move(line));
  return lines;
}

// Places across a line, from the four numbers of LineFit: at its point, and by metre along it.
using AcrossShift = Eigen::Matrix<double, 3, 4>;
AcrossShift GetShift(const LineFit& fit, double along_m) {
  AcrossShift shift;
  shift << fit.across, along_m * fit.across;
  return shift;
}

// The covariance of a fit whose point is the middle of a piece.
Eigen::Matrix4d FitCovariance(const LineCovariance& piece, double length_m,
                              const Eigen::Matrix<double, 3, 2>& across) {
  Eigen::Matrix<double, 6, 6> ends;
  ends << piece.start_m2, piece.start_end_m2, piece.start_end_m2.transpose(), piece.end_m2;
  Eigen::Matrix<double, 4, 6> to_fit;
  to_fit << 0.5 * across.transpose(), 0.5 * across.transpose(), -across.transpose() / length_m,
      across.transpose() / length_m;
  return to_fit * ends * to_fit.transpose();
}

Eigen::Matrix4d FitCovariance(const MapLine& piece) {
  Eigen::Vector4d variances;
  variances << Eigen::Vector2d::Constant(piece.sigma_m * piece.sigma_m),
      Eigen::Vector2d::Constant(piece.deviation_sigma_rad * piece.deviation_sigma_rad);
  return variances.asDiagonal();
}

int CollectObservations(const SourceLine& line) { return line.pieces.front().observations; }

// The pieces as intervals, and a place for each, which says later what became of it.
void AddPieces(const SourceLine& source, int index, TrackedLine* line) {
  const auto along_m = [&](const Eigen::Vector3d& p) {
    return line->line.direction_world.dot(p - line->line.point_world);
  };
  for (std::size_t i = 0; i < source.pieces.size(); ++i) {
    const double a = along_m(source.pieces[i].start_world), b = along_m(source.pieces[i].end_world);
    const Interval piece{std::min(a, b), std::max(a, b)};
    line->intervals.push_back(piece);
    EdgePoint place;
    place.view = index;
    place.samples = static_cast<int>(i);
    place.from_m = static_cast<float>(piece.from_m);
    place.to_m = static_cast<float>(piece.to_m);
    place.along_m = static_cast<float>(0.5 * (piece.from_m + piece.to_m));
    line->places.push_back(place);
  }
  std::sort(line->intervals.begin(), line->intervals.end(),
            [](const Interval& x, const Interval& y) { return x.from_m < y.from_m; });
}

// As it is merged.
TrackedLine TrackedFrom(const SourceLine& source, int index, const UnitedAxes& axes) {
  const auto longest = std::max_element(
      source.pieces.begin(), source.pieces.end(), [](const MapLine& a, const MapLine& b) {
        return (a.end_world - a.start_world).norm() < (b.end_world - b.start_world).norm();
      });
  const Eigen::Vector3d way = longest->end_world - longest->start_world;
  TrackedLine line;
  line.line = {0.5 * (longest->start_world + longest->end_world), way.normalized()};
  line.axis = axes.FindIndex(line.line.direction_world);
  line.map = source.map;
  line.fit.line = line.line;
  line.fit.across = ComputeAcross(line.line.direction_world);
  const LineCovariance* known = source.covariances[longest - source.pieces.begin()];
  line.fit.covariance =
      known ? FitCovariance(*known, way.norm(), line.fit.across) : FitCovariance(*longest);
  line.fit.views = CollectObservations(source);
  AddPieces(source, index, &line);
  return line;
}

// Its own place comes first: those of others are added behind.
int FindLeader(const TrackedLine& line) { return line.places.front().view; }

std::vector<int> FindMembers(const TrackedLine& line) {
  std::vector<int> members;
  for (const EdgePoint& place : line.places) {
    if (std::find(members.begin(), members.end(), place.view) == members.end()) {
      members.push_back(place.view);
    }
  }
  return members;
}

// The mean over the length and the images of the members.
double ComputeProbability(const std::vector<const SourceLine*>& members) {
  double sum = 0, weights = 0;
  for (const SourceLine* member : members) {
    for (const MapLine& piece : member->pieces) {
      const double weight = (piece.end_world - piece.start_world).norm() * piece.observations;
      sum += weight * piece.edge_probability;
      weights += weight;
    }
  }
  return weights > 0 ? sum / weights : members.front()->pieces.front().edge_probability;
}

LineCovariance CovarianceAt(const LineFit& fit, const Interval& piece) {
  const AcrossShift start = GetShift(fit, piece.from_m), end = GetShift(fit, piece.to_m);
  return {0, 0, start * fit.covariance * start.transpose(), end * fit.covariance * end.transpose(),
          start * fit.covariance * end.transpose()};
}

// The piece that a place of the merged line is in; -1: none.
int PieceAt(const TrackedLine& line, const EdgePoint& place) {
  for (std::size_t i = 0; i < line.intervals.size(); ++i) {
    if (place.along_m >= line.intervals[i].from_m - kInPiece_m &&
        place.along_m <= line.intervals[i].to_m + kInPiece_m) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

class UnionOfLines {
 public:
  UnionOfLines(std::vector<SourceLine> sources, double alignment_m)
      : sources_(std::move(sources)), alignment_m_(alignment_m) {}

  LinesOfMap Of(const LinesOfMap& first, const LinesOfMap& second, const UnitedAxes& axes) {
    std::vector<TrackedLine> tracked;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      tracked.push_back(TrackedFrom(sources_[i], static_cast<int>(i), axes));
    }
    for (const TrackedLine& line : MergeLines(std::move(tracked), alignment_m_)) Add(line);
    AddSupports(first, 0);
    AddSupports(second, 1);
    SortSupports();
    return std::move(united_);
  }

 private:
  void Add(const TrackedLine& line) {
    std::vector<const SourceLine*> members;
    for (const int member : FindMembers(line)) members.push_back(&sources_[member]);
    const SourceLine& leader = sources_[FindLeader(line)];
    MapLine piece = leader.pieces.front();
    piece.id = next_id_;
    piece.segment = 0;
    piece.SetProbability(ComputeProbability(members));
    piece.observations = 0;
    piece.recent = false;
    for (const SourceLine* member : members) {
      piece.observations += CollectObservations(*member);
      piece.recent = piece.recent || member->pieces.front().recent;
    }
    for (const Interval& interval : line.intervals) {
      piece.start_world = line.line.point_world + interval.from_m * line.line.direction_world;
      piece.end_world = line.line.point_world + interval.to_m * line.line.direction_world;
      united_.lines.push_back(piece);
    }
    for (const EdgePoint& place : line.places) {
      const SourceLine& source = sources_[place.view];
      pieces_[{source.map, source.pieces.front().id, place.samples}] = {next_id_,
                                                                        PieceAt(line, place)};
    }
    AddCovariances(line, leader);
    ++next_id_;
  }

  // As the best is known.
  void AddCovariances(const TrackedLine& line, const SourceLine& leader) {
    if (std::none_of(leader.covariances.begin(), leader.covariances.end(),
                     [](const LineCovariance* c) { return c != nullptr; })) {
      return;
    }
    for (std::size_t i = 0; i < line.intervals.size(); ++i) {
      LineCovariance covariance = CovarianceAt(line.fit, line.intervals[i]);
      covariance.line_id = next_id_;
      covariance.piece = static_cast<int>(i);
      united_.evidence.covariances.push_back(covariance);
    }
  }

  void AddSupports(const LinesOfMap& map, int number) {
    for (LineSupport support : map.evidence.supports) {
      const auto& [id, piece] = pieces_.at({number, support.line_id, support.piece});
      if (piece < 0) continue;
      support.line_id = id;
      support.piece = piece;
      united_.evidence.supports.push_back(support);
    }
  }

  // Of what one image shows of a piece twice, as of two lines that became one, the longer stays.
  void SortSupports() {
    std::vector<LineSupport>& supports = united_.evidence.supports;
    std::stable_sort(supports.begin(), supports.end(),
                     [&](const LineSupport& a, const LineSupport& b) {
                       if (MakeKey(a) != MakeKey(b)) return MakeKey(a) < MakeKey(b);
                       return a.px.Length() > b.px.Length();
                     });
    const auto same = [](const LineSupport& a, const LineSupport& b) {
      return MakeKey(a) == MakeKey(b);
    };
    supports.erase(std::unique(supports.begin(), supports.end(), same), supports.end());
  }

  const std::vector<SourceLine> sources_;
  const double alignment_m_;
  LinesOfMap united_;
  int64_t next_id_ = 0;
  std::map<std::tuple<int, int64_t, int>, PieceKey> pieces_;  // by map, line and piece
};

}  // namespace

LinesOfMap UniteLines(const LinesOfMap& first, const LinesOfMap& second, double alignment_m) {
  UnitedAxes axes;
  axes.AddFirst(first.lines);
  LinesOfMap renamed = second;
  axes.AddSecond(&renamed.lines);
  std::vector<SourceLine> sources = CollectSourceLines(first, 0);
  std::vector<SourceLine> others = CollectSourceLines(renamed, 1);
  std::move(others.begin(), others.end(), std::back_inserter(sources));
  return UnionOfLines(std::move(sources), alignment_m).Of(first, renamed, axes);
}

namespace {

using Eigen::Vector3d;

constexpr double kOneAxis_rad = 3 * std::numbers::pi / 180;
constexpr double kSameName_rad = std::numbers::pi / 180;
constexpr double kOneAxis_m = 0.02;       // across, or as much of the radius as follows
constexpr double kOneRadiusShare = 0.25;  // by which radii, and axes, of one pipe may differ
constexpr double kGap_m = 0.3;            // along a pipe, between what both saw of it

Vector3d GetDirection(const MapPipe& pipe) {
  return (pipe.end_world - pipe.start_world).normalized();
}

bool IsOnePipe(const MapPipe& a, const MapPipe& b) {
  const Vector3d direction = GetDirection(a);
  if (LineAngle_rad(direction, GetDirection(b)) > kOneAxis_rad) return false;
  const double radius_m = std::max(a.radius_m, b.radius_m);
  if (std::abs(a.radius_m - b.radius_m) > kOneRadiusShare * radius_m) return false;
  const Vector3d way = 0.5 * (b.start_world + b.end_world) - 0.5 * (a.start_world + a.end_world);
  const double along_m = way.dot(direction);
  const double lengths_m =
      (a.end_world - a.start_world).norm() + (b.end_world - b.start_world).norm();
  return (way - along_m * direction).norm() <= std::max(kOneAxis_m, kOneRadiusShare * radius_m) &&
         std::abs(along_m) <= 0.5 * lengths_m + kGap_m;
}

MapPipe United(const MapPipe& a, const MapPipe& b) {
  MapPipe best = b.sigma_m < a.sigma_m ? b : a;
  best.axis = a.axis;  // has its name already
  best.world = a.world;
  best.images = a.images + b.images;
  const Vector3d from = best.start_world, direction = GetDirection(best);
  double least_m = 0, most_m = 0;
  for (const Vector3d& p : {a.start_world, a.end_world, b.start_world, b.end_world}) {
    const double along_m = direction.dot(p - from);
    least_m = std::min(least_m, along_m);
    most_m = std::max(most_m, along_m);
  }
  best.start_world = from + least_m * direction;
  best.end_world = from + most_m * direction;
  return best;
}

void NameAxis(const std::vector<MapLine>& lines, MapPipe* pipe) {
  const auto is_along = [&](const MapLine& line) {
    return line.axis != LineAxis::kNone &&
           LineAngle_rad(line.end_world - line.start_world, GetDirection(*pipe)) < kSameName_rad;
  };
  const auto found = std::find_if(lines.begin(), lines.end(), is_along);
  const bool is_named = pipe->axis != LineAxis::kNone && found != lines.end();
  pipe->axis = is_named ? found->axis : LineAxis::kNone;
  pipe->world = is_named ? found->world : -1;
}

}  // namespace

std::vector<MapPipe> UnitePipes(std::vector<MapPipe> first, const std::vector<MapPipe>& second,
                                const std::vector<MapLine>& lines) {
  for (MapPipe pipe : second) {
    NameAxis(lines, &pipe);
    // What has grown may reach another piece of the same pipe.
    for (auto known = first.begin(); known != first.end();) {
      if (!IsOnePipe(*known, pipe)) {
        ++known;
        continue;
      }
      pipe = United(*known, pipe);
      first.erase(known);
      known = first.begin();
    }
    first.push_back(pipe);
  }
  for (size_t i = 0; i < first.size(); ++i) {
    first[i].id = static_cast<int64_t>(i);
    first[i].segment = 0;
  }
  return first;
}

}  // namespace slcmap::mapping
