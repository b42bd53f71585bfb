#include "mapping/lines/patterns.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

#include "data/core/math.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kLeastSpacing_m = 0.04, kMostSpacing_m = 0.7;  // bricks to slabs
constexpr double kOffPatternPlane_m = 0.03;
constexpr int kLeastLines = 6;         // tell a distance
constexpr double kChance = 1e-3;       // that lines which lie anywhere pass for a pattern
constexpr double kSameLine_m = 0.004;  // between the places of one line
constexpr double kWidth = 0.05;        // of a place, in distances: how finely they are told apart
constexpr double kSame_rad = 0.05;     // between directions that are one

// Lines of one direction of the building, as the map has them: what it calls them by.
auto GetDirection(const MapLine& line) {
  return std::tuple(line.segment, line.axis, line.axis == LineAxis::kVertical ? -1 : line.world);
}

using LinesByDirection = std::map<decltype(GetDirection(MapLine())), std::vector<MapLine*>>;

LinesByDirection SortByDirection(std::vector<MapLine>* lines) {
  LinesByDirection sorted;
  for (MapLine& line : *lines) {
    if (line.axis == LineAxis::kNone || line.kind == LineKind::kPipe || IsJunction(line)) continue;
    sorted[GetDirection(line)].push_back(&line);
  }
  return sorted;
}

Eigen::Vector3d ComputeMeanDirection(const std::vector<MapLine*>& lines) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const MapLine* line : lines) {
    const Eigen::Vector3d along = line->end_world - line->start_world;
    sum += along.dot(sum) < 0 ? Eigen::Vector3d(-along) : along;
  }
  return sum.normalized();
}

// Normals of planes along a direction: with each of the others in it, or square to it.
std::vector<Eigen::Vector3d> CollectNormals(const Eigen::Vector3d& direction_world,
                                            const std::vector<Eigen::Vector3d>& others_world) {
  std::vector<Eigen::Vector3d> normals;
  const auto add = [&](const Eigen::Vector3d& normal_world) {
    const bool is_there = std::ranges::any_of(normals, [&](const Eigen::Vector3d& n) {
      return LineAngle_rad(n, normal_world) < kSame_rad;
    });
    if (!is_there) normals.push_back(normal_world);
  };
  for (const Eigen::Vector3d& other_world : others_world) {
    if (LineAngle_rad(direction_world, other_world) < kSame_rad) continue;
    const Eigen::Vector3d normal_world = direction_world.cross(other_world).normalized();
    add(normal_world);
    add(direction_world.cross(normal_world));
  }
  return normals;
}

// A piece of a line in a plane: how far across the pattern it is.
struct PlacedLine {
  MapLine* line = nullptr;
  double off_m = 0;  // along the normal
  double across_m = 0;
};

// A plane that lines of one direction lie in.
struct PlaneOfLines {
  Eigen::Vector3d direction_world, across_world;
  std::vector<PlacedLine> lines;  // by across_m
};

// The plane that most of the lines are in, taken out of them; none where too few share one. Sorted
// by off_m.
std::optional<std::vector<PlacedLine>> TakeFullestPlane(std::vector<PlacedLine>* lines) {
  size_t best = 0, from = 0, most = 0;
  for (size_t to = 0; to < lines->size(); ++to) {
    while ((*lines)[to].off_m - (*lines)[from].off_m > 2 * kOffPatternPlane_m) ++from;
    if (to - from + 1 <= most) continue;
    most = to - from + 1;
    best = from;
  }
  if (most < kLeastLines) return std::nullopt;
  const auto first = lines->begin() + static_cast<std::ptrdiff_t>(best);
  const auto last = first + static_cast<std::ptrdiff_t>(most);
  std::vector<PlacedLine> taken(first, last);
  lines->erase(first, last);
  return taken;
}

std::vector<PlaneOfLines> FindPlanes(const std::vector<MapLine*>& lines,
                                     const Eigen::Vector3d& direction_world,
                                     const Eigen::Vector3d& normal_world) {
  const Eigen::Vector3d across_world = normal_world.cross(direction_world);
  std::vector<PlacedLine> placed;
  for (MapLine* line : lines) {
    const Eigen::Vector3d middle = 0.5 * (line->start_world + line->end_world);
    placed.push_back({line, normal_world.dot(middle), across_world.dot(middle)});
  }
  std::ranges::stable_sort(placed, {}, &PlacedLine::off_m);
  std::vector<PlaneOfLines> planes;
  while (auto in_plane = TakeFullestPlane(&placed)) {
    std::ranges::stable_sort(*in_plane, {}, &PlacedLine::across_m);
    planes.push_back({direction_world, across_world, std::move(*in_plane)});
  }
  return planes;
}

// Places across the lines, each once: pieces of a line, and lines that go on with another.
std::vector<double> CollectPlaces(const std::vector<PlacedLine>& sorted) {
  std::vector<double> places_m;
  for (const PlacedLine& line : sorted) {
    if (places_m.empty() || line.across_m - places_m.back() > kSameLine_m) {
      places_m.push_back(line.across_m);
    }
  }
  return places_m;
}

// The sum of the places' phases at a frequency: as long as their number where all are at multiples
// of its inverse.
std::complex<double> SumPhases(const std::vector<double>& places_m, double frequency_per_m) {
  std::complex<double> sum = 0;
  for (const double place_m : places_m) {
    sum += std::polar(1.0, 2 * std::numbers::pi * frequency_per_m * place_m);
  }
  return sum;
}

// The largest power of the places' phases (Rayleigh's test: the squared sum over their number is
// exponentially distributed where they lie anywhere), at the lowest frequency that has nearly as
// much: the multiples of a pattern's frequency have about as much as itself.
std::optional<double> FindSpacing_m(const std::vector<double>& places_m) {
  constexpr double kNearly = 0.75, kStepsAPeak = 20;
  const double range_m = places_m.back() - places_m.front();
  const double step = 1 / (kStepsAPeak * std::max(range_m, kMostSpacing_m));
  std::vector<double> powers;
  for (double f = 1 / kMostSpacing_m; f < 1 / kLeastSpacing_m; f += step) {
    powers.push_back(std::norm(SumPhases(places_m, f)) / static_cast<double>(places_m.size()));
  }
  const auto highest = std::ranges::max_element(powers);
  if (*highest < std::log(static_cast<double>(powers.size()) / kChance)) return std::nullopt;
  auto first = std::ranges::find_if(powers, [&](double p) { return p > kNearly * *highest; });
  while (std::next(first) != powers.end() && *std::next(first) > *first) ++first;
  return 1 / (1 / kMostSpacing_m + step * static_cast<double>(first - powers.begin()));
}

// How places repeat: a distance, and where between two of its multiples they are, as both edges of
// a joint are and as depth has moved them. Estimated from the places themselves.
class Lattice {
 public:
  Lattice(double spacing_m, std::vector<double> places_m)
      : spacing_m_(spacing_m), places_m_(std::move(places_m)) {
    const std::complex<double> sum = SumPhases(places_m_, 1 / spacing_m);
    phase_m_ = std::arg(sum) / (2 * std::numbers::pi) * spacing_m;
    // Mardia, Jupp, Directional Statistics (2000), 2.3.4.
    const double mean = std::abs(sum) / static_cast<double>(places_m_.size());
    scatter_m_ = spacing_m / (2 * std::numbers::pi) * std::sqrt(-2 * std::log(mean));
  }

  double spacing_m() const { return spacing_m_; }
  double scatter_m() const { return scatter_m_; }

  // From the middle of the places to one of them.
  double OffNearest_m(double place_m) const {
    return std::remainder(place_m - phase_m_, spacing_m_);
  }

  // How much likelier a place is than if lines lay anywhere, as the other places say.
  double LikelihoodRatio(double place_m) const {
    const double width_m = kWidth * spacing_m_;
    double density = 0;
    for (const double other_m : places_m_) {
      if (std::abs(other_m - place_m) <= kSameLine_m) continue;  // itself
      const double off = std::remainder(place_m - other_m, spacing_m_) / width_m;
      density += std::exp(-0.5 * off * off);
    }
    return density / (kWidth * std::sqrt(2 * std::numbers::pi)) /
           static_cast<double>(places_m_.size());
  }

 private:
  double spacing_m_;
  std::vector<double> places_m_;
  double phase_m_, scatter_m_;
};

void Include(double value_m, Interval* interval) {
  interval->from_m = std::min(interval->from_m, value_m);
  interval->to_m = std::max(interval->to_m, value_m);
}

// How likely a line is a mark, with what its place tells: an edge may be anywhere.
void WeighPlace(double likelihood_ratio, MapLine* line) {
  const double p = line->edge_probability;
  line->SetProbability(p / (p + (1 - p) * likelihood_ratio));
}

// Lines at the places of a lattice, told to be marks the rather; the pattern that those make which
// then are. None of too few.
std::optional<MapPattern> MakePattern(const Lattice& lattice, const PlaneOfLines& plane) {
  std::vector<PlacedLine> members;
  for (const PlacedLine& placed : plane.lines) {
    const double likelihood_ratio = lattice.LikelihoodRatio(placed.across_m);
    if (likelihood_ratio < 1) continue;
    WeighPlace(likelihood_ratio, placed.line);
    if (placed.line->kind == LineKind::kMark) members.push_back(placed);
  }
  if (CollectPlaces(members).size() < kLeastLines) return std::nullopt;
  MapPattern pattern;
  pattern.segment = members.front().line->segment;
  pattern.direction_world = plane.direction_world;
  pattern.across_world = plane.across_world;
  pattern.spacing_m = lattice.spacing_m();
  pattern.scatter_m = lattice.scatter_m();
  // On the line of the pattern that is nearest to the middle of the first of them.
  const MapLine& first = *members.front().line;
  pattern.origin_world = 0.5 * (first.start_world + first.end_world) -
                         lattice.OffNearest_m(members.front().across_m) * plane.across_world;
  for (const PlacedLine& member : members) {
    for (const Eigen::Vector3d& end : {member.line->start_world, member.line->end_world}) {
      Include((end - pattern.origin_world).dot(plane.direction_world), &pattern.along_m);
      Include((end - pattern.origin_world).dot(plane.across_world), &pattern.across_m);
    }
    pattern.line_ids.push_back(member.line->id);
  }
  std::ranges::sort(pattern.line_ids);
  const auto repeated = std::ranges::unique(pattern.line_ids);
  pattern.line_ids.erase(repeated.begin(), repeated.end());
  return pattern;
}

std::optional<MapPattern> FindPattern(const PlaneOfLines& plane) {
  const std::vector<double> places_m = CollectPlaces(plane.lines);
  if (places_m.size() < kLeastLines) return std::nullopt;
  const auto spacing_m = FindSpacing_m(places_m);
  return spacing_m ? MakePattern(Lattice(*spacing_m, places_m), plane) : std::nullopt;
}

}  // namespace

std::vector<MapPattern> FindPatterns(std::vector<MapLine>* lines) {
  const LinesByDirection sorted = SortByDirection(lines);
  std::vector<Eigen::Vector3d> directions_world = {Eigen::Vector3d::UnitZ()};
  for (const auto& [key, of_direction] : sorted) {
    directions_world.push_back(ComputeMeanDirection(of_direction));
  }
  std::vector<MapPattern> patterns;
  int at = 0;
  for (const auto& [key, of_direction] : sorted) {
    const Eigen::Vector3d& direction_world = directions_world[++at];
    for (const Eigen::Vector3d& normal_world : CollectNormals(direction_world, directions_world)) {
      for (const PlaneOfLines& plane : FindPlanes(of_direction, direction_world, normal_world)) {
        if (auto pattern = FindPattern(plane)) patterns.push_back(std::move(*pattern));
      }
    }
  }
  for (size_t i = 0; i < patterns.size(); ++i) patterns[i].id = static_cast<int64_t>(i);
  return patterns;
}

}  // namespace slcmap::mapping
