#include "mapping/control/control.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <ranges>
#include <set>
#include <unordered_map>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/source/recorded_source.h"
#include "mapping/control/control_placement.h"
#include "mapping/control/tag_finder.h"
#include "mapping/control/triangulation.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;
using PlacedPoints = std::map<std::string, PlacedPoint>;

constexpr double kMapSigma_m = 0.003;  // how a map of a building is bent, beside what images say
constexpr size_t kLeastTied = 3;
constexpr double kMostStretched = 0.03;  // of a distance that pulls: beyond, it is another one

Vector3d MeanPoint(const Control& control) {
  Vector3d sum = Vector3d::Zero();
  for (const ControlPoint& point : control.points) sum += point.p_m;
  return sum / static_cast<double>(control.points.size());
}

double SigmaInMap(const PlacedPoint& point) { return std::hypot(point.sigma_m, kMapSigma_m); }

// Those points that the images place.
std::vector<ControlMatch> MatchPoints(const Control& control, const PlacedPoints& placed) {
  std::vector<ControlMatch> matches;
  for (const ControlPoint& point : control.points) {
    const auto found = placed.find(point.name);
    if (found == placed.end()) continue;
    const Vector3d of_map = Vector3d::Constant(SigmaInMap(found->second));
    matches.push_back({point.name, found->second.p_world, point.p_m,
                       (point.sigma_m.cwiseAbs2() + of_map.cwiseAbs2()).cwiseSqrt()});
  }
  return matches;
}

void RequireSeen(const Control& control, const std::vector<ControlMatch>& matches) {
  if (matches.size() >= 2) return;
  std::map<std::string, std::string> seen;
  for (const Sighting& sighting : control.sightings) {
    seen.emplace(sighting.name, fmt::format("{} at {}", sighting.name, sighting.stamp_ns));
  }
  throw DataError(fmt::format(
      "{}: found {} of {} control points placed by two images or more (seen at all: {}), expected "
      "two at least: walk by them nearer and slower, or mark them in images with --marks; are "
      "names those of the tags, such as tag36h11:5?",
      control.path, matches.size(), control.points.size(),
      seen.empty() ? "none" : fmt::format("{}", fmt::join(std::views::values(seen), ", "))));
}

void RequireImagesOfMarks(const Control& control,
                          const std::unordered_map<int64_t, RigidTransform>& poses) {
  for (const Sighting& sighting : control.sightings) {
    if (poses.contains(sighting.stamp_ns)) continue;
    throw DataError(fmt::format(
        "marks: point '{}': found the stamp {}, at which the map has no image, expected one of its "
        "trajectory",
        sighting.name, sighting.stamp_ns));
  }
}

std::vector<ControlResidual> MakeResiduals(const Control& control, const PlacedPoints& placed,
                                           const std::vector<ControlMatch>& matches,
                                           const ControlPlacement& placement) {
  std::vector<ControlResidual> residuals;
  size_t match = 0;
  for (const ControlPoint& point : control.points) {
    ControlResidual& residual = residuals.emplace_back();
    residual.name = point.name;
    residual.given_m = point.p_m;
    residual.sigma_m = point.sigma_m;
    const auto found = placed.find(point.name);
    if (found == placed.end()) continue;
    residual.views = found->second.views;
    residual.status = placement.fits[match] ? ControlStatus::kUsed : ControlStatus::kOutlier;
    residual.off_m = placement.place * found->second.p_world - point.p_m;
    residual.over_sigma =
        residual.off_m.cwiseQuotient(matches[match].sigma_m).cwiseAbs().maxCoeff();
    ++match;
  }
  return residuals;
}

double ComputeRms(const std::vector<ControlResidual>& residuals) {
  double sum = 0, count = 0;
  for (const ControlResidual& residual : residuals) {
    if (residual.status != ControlStatus::kUsed) continue;
    sum += residual.off_m.squaredNorm();
    ++count;
  }
  return std::sqrt(sum / std::max(1.0, count));
}

template <typename Poses>
std::set<int64_t> StampsAt(const Poses& poses) {
  std::set<int64_t> stamps_ns;
  for (const auto& pose : poses) stamps_ns.insert(pose.stamp_ns);
  return stamps_ns;
}

// Of keyframes and, where a tag may pass between them, of images so far apart.
std::vector<int64_t> SelectStamps(const std::set<int64_t>& keyframes_ns,
                                  const std::set<int64_t>& images_ns) {
  constexpr int64_t kApart_ns = 100'000'000;
  std::set<int64_t> selected = keyframes_ns;
  int64_t last_ns = 0;
  for (const int64_t stamp_ns : images_ns) {
    if (stamp_ns - last_ns < kApart_ns) continue;
    selected.insert(stamp_ns);
    last_ns = stamp_ns;
  }
  return {selected.begin(), selected.end()};
}

std::vector<DistanceResidual> MeasureDistances(const Control& control, const PlacedPoints& placed) {
  std::vector<DistanceResidual> distances;
  for (const KnownDistance& known : control.distances) {
    for (const std::string& name : {known.from, known.to}) {
      if (placed.contains(name)) continue;
      throw DataError(fmt::format(
          "--distance: point '{}': found no place of it in the map, expected two images or more "
          "that show it: is it the name of a tag, or of marks?",
          name));
    }
    const PlacedPoint &from = placed.at(known.from), &to = placed.at(known.to);
    distances.push_back({known.from, known.to, known.metres, (to.p_world - from.p_world).norm(),
                         std::hypot(SigmaInMap(from), SigmaInMap(to), known.sigma_m)});
  }
  return distances;
}

}  // namespace

std::vector<ControlRecording> ListControlRecordings(const MapResult& map,
                                                    const std::string& moved_to) {
  std::vector<ControlRecording> recordings;
  if (map.source.merged.empty()) {
    recordings.push_back(
        {moved_to.empty() ? map.source.sequence : moved_to, map.source.opened, 0, {}});
  } else if (!moved_to.empty()) {
    throw ConfigError(
        "--sequence: found a map that was merged of several recordings, expected one of a single "
        "one");
  }
  for (const MergedRun& run : map.source.merged) {
    recordings.push_back({run.sequence, run.opened, run.stamps_moved_ns, {}});
  }
  const std::vector<int64_t> stamps_ns =
      SelectStamps(StampsAt(map.keyframes), StampsAt(map.trajectory));
  for (size_t i = 0; i < recordings.size(); ++i) {
    for (const int64_t stamp_ns : stamps_ns) {
      const auto& span = map.source.merged.empty() ? std::nullopt : map.source.merged[i].poses_ns;
      if (span && (stamp_ns < span->from_ns || stamp_ns > span->to_ns)) continue;
      recordings[i].stamps_ns.push_back(stamp_ns);
    }
  }
  return recordings;
}

ControlRecording ControlRecordingOfRun(const OdometryRun& run, const std::string& moved_to) {
  if (!run.source) {
    throw DataError("run: found nothing about where its images are, expected a run of a recording");
  }
  ControlRecording recording{
      moved_to.empty() ? run.source->sequence : moved_to, run.source->opened, 0, {}};
  recording.stamps_ns = SelectStamps(StampsAt(run.keyframes), StampsAt(run.states));
  return recording;
}

Rig AddTags(const ControlRecording& recording, const Progress& progress, Control* control) {
  std::error_code error;
  if (recording.path.empty() || !std::filesystem::exists(recording.path, error)) {
    throw DataError(fmt::format(
        "control points: found no recording {}, expected the one that the map was made of "
        "(--sequence names where it moved to)",
        recording.path.empty() ? "named by the map" : recording.path));
  }
  SequenceOptions opened = recording.opened;
  opened.needs_imu = false;
  const std::unique_ptr<SequenceSource> source = OpenAgain(recording.path, opened, "");
  const auto is_missing = [&](int64_t stamp_ns) {
    return !FindPair(*source, stamp_ns - recording.stamps_moved_ns);
  };
  if (!recording.stamps_ns.empty() && std::ranges::all_of(recording.stamps_ns, is_missing)) {
    throw DataError(
        fmt::format("{}: found none of the map's images, expected the recording that "
                    "the map was made of",
                    recording.path));
  }
  const std::vector<Sighting> tags = FindTags(
      *source, recording.stamps_ns, recording.stamps_moved_ns, ListNames(*control), progress);
  control->sightings.insert(control->sightings.end(), tags.begin(), tags.end());
  return source->info().rig;
}

double FindGridScale(const Control& control) {
  if (control.crs.empty() || control.points.empty()) return 1;
  const Vector3d p_m = MeanPoint(control);
  std::optional<Eigen::Vector2d> degrees;
  if (std::abs(p_m.x()) <= 180 && std::abs(p_m.y()) <= 90) degrees.emplace(p_m.y(), p_m.x());
  const CoordinateSystem system(control.crs, degrees);
  if (const auto place = system.At(p_m)) return place->scale;
  const bool is_swapped = system.At({p_m.y(), p_m.x(), p_m.z()}).has_value();
  throw DataError(
      fmt::format("{}: point '{}': found easting {:.1f} and northing {:.1f}, which {} ({}) is not "
                  "for, expected "
                  "a place in its area: {}",
                  control.path, control.points.front().name, control.points.front().p_m.x(),
                  control.points.front().p_m.y(), control.crs, system.title(),
                  is_swapped ? "swap the columns, with which they are"
                             : "name the system that they are in with --crs"));
}

void PlaceOnControl(const Control& control, const Rig& raw, MapResult* map) {
  const auto poses = PosesByStamp(*map);
  RequireImagesOfMarks(control, poses);
  const PlacedPoints placed = Triangulate(control.sightings, {raw, map->rectified_rig}, poses);
  ControlFit fit;
  fit.distances = MeasureDistances(control, placed);
  if (!control.points.empty()) {
    const double scale = FindGridScale(control);
    const std::vector<ControlMatch> matches = MatchPoints(control, placed);
    RequireSeen(control, matches);
    ControlPlacement placement = PlaceOnPoints(control.path, matches, scale);
    placement.place.crs = control.crs;
    fit.points = MakeResiduals(control, placed, matches, placement);
    fit.rms_m = ComputeRms(fit.points);
    fit.map_scale = placement.map_scale;
    fit.map_scale_sigma = placement.map_scale_sigma;
    map->source.georeference = placement.place;
  }
  map->control = std::move(fit);
}

namespace {

// Where a keyframe's images show a point, on the planes z = 1.
using SightsByStamp = std::map<int64_t, std::array<std::optional<Eigen::Vector2d>, 2>>;

SightsByStamp CollectSights(const Control& control, const std::string& name,
                            const SightingCameras& cameras) {
  SightsByStamp sights;
  for (const Sighting& sighting : control.sightings) {
    if (sighting.name != name) continue;
    sights[sighting.stamp_ns][static_cast<size_t>(sighting.camera)] = cameras.OnPlane(sighting);
  }
  return sights;
}

void AddLandmark(int64_t id, const Vector3d& p_world, const SightsByStamp& sights,
                 OdometryRun* run) {
  Landmark landmark{.id = id, .p_world = p_world, .sigma_m = kMapSigma_m};
  const Rig& rig = run->rectified_rig;
  for (Keyframe& keyframe : run->keyframes) {
    const auto seen = sights.find(keyframe.stamp_ns);
    if (seen == sights.end() || !seen->second[0]) continue;
    KeyframeObservation observation{id, PixelFromPlane(rig.cameras[0], *seen->second[0]), {}};
    if (seen->second[1]) {
      observation.right_px = PixelFromPlane(rig.cameras[1], *seen->second[1]);
    }
    keyframe.observations.push_back(observation);
    ++landmark.observations;
  }
  run->landmarks.push_back(landmark);
}

// In the run's world, where the placement has what was given.
ControlTie MakeTie(int64_t id, const ControlPoint& point, const Georeference& place) {
  Vector3d p = point.p_m - place.origin_m;
  p.head<2>() /= place.scale;
  const double across_m = point.sigma_m.head<2>().maxCoeff();
  return {id,
          Eigen::AngleAxisd(-place.turn_rad, Vector3d::UnitZ()) * p,
          {across_m, across_m, point.sigma_m.z()}};
}

// The landmarks of points that are tied, which the run gets as they are asked for.
class TiedLandmarks {
 public:
  TiedLandmarks(const Control& control, const SightingCameras& cameras, const PlacedPoints& placed,
                OdometryRun* run)
      : control_(control), cameras_(cameras), placed_(placed), run_(run) {
    for (const Landmark& landmark : run->landmarks) last_ = std::max(last_, landmark.id);
  }

  int64_t Id(const std::string& name) {
    const auto [known, is_new] = ids_.try_emplace(name, last_ + 1);
    if (!is_new) return known->second;
    AddLandmark(++last_, placed_.at(name).p_world, CollectSights(control_, name, cameras_), run_);
    return last_;
  }

 private:
  const Control& control_;
  const SightingCameras& cameras_;
  const PlacedPoints& placed_;
  OdometryRun* run_;
  std::map<std::string, int64_t> ids_;
  int64_t last_ = 0;
};

// Cameras that are not as far apart as given make all too large or small, which no term that pulls
// poses could mend. Too small differences are those of places in the map.
void ScaleToControl(const Control& control, OdometryRun* run, PlacedPoints* placed) {
  constexpr double kTellingSigmas = 3;
  const auto scale = MeasureScale(control, *placed, FindGridScale(control));
  if (!scale) return;
  const double off = std::abs(scale->times - 1);
  if (off < kTellingSigmas * scale->sigma || off > kMostStretched) return;
  spdlog::warn(
      "by what was measured the run is {:.2f} % too {} ({:.2f} % 1 sigma): it is scaled, and the "
      "distance between its cameras with it; check their calibration",
      100 * off, scale->times < 1 ? "large" : "small", 100 * scale->sigma);
  ++run->warnings[kScaledToControl];
  ScaleRun(scale->times, run);
  for (PlacedPoint& point : std::views::values(*placed)) point.p_world *= scale->times;
}

std::vector<ControlTie> TiePoints(const Control& control, const PlacedPoints& placed,
                                  TiedLandmarks* landmarks) {
  const std::vector<ControlMatch> matches = MatchPoints(control, placed);
  if (matches.size() < kLeastTied) return {};
  const ControlPlacement placement = PlaceOnPoints(control.path, matches, FindGridScale(control));
  if (static_cast<size_t>(std::ranges::count(placement.fits, true)) < kLeastTied) return {};
  std::vector<ControlTie> ties;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!placement.fits[i]) continue;
    const auto point = std::ranges::find(control.points, matches[i].name, &ControlPoint::name);
    ties.push_back(MakeTie(landmarks->Id(point->name), *point, placement.place));
  }
  return ties;
}

std::vector<DistanceTie> TieDistances(const Control& control, const PlacedPoints& placed,
                                      TiedLandmarks* landmarks) {
  std::vector<DistanceTie> ties;
  for (const KnownDistance& known : control.distances) {
    const auto from = placed.find(known.from), to = placed.find(known.to);
    if (from == placed.end() || to == placed.end()) continue;
    const double mapped_m = (from->second.p_world - to->second.p_world).norm();
    if (std::abs(mapped_m / known.metres - 1) > kMostStretched) continue;
    ties.push_back(
        {landmarks->Id(known.from), landmarks->Id(known.to), known.metres, known.sigma_m});
  }
  return ties;
}

}  // namespace

ControlTies TieToControl(const Control& control, OdometryRun* run) {
  if (!run->source || run->method == kExternalPoses) return {};
  std::unordered_map<int64_t, RigidTransform> poses;
  for (const Keyframe& keyframe : run->keyframes) {
    poses.emplace(keyframe.stamp_ns, keyframe.T_world_imu);
  }
  const SightingCameras cameras{run->source->raw_rig, run->rectified_rig};
  PlacedPoints placed = Triangulate(control.sightings, cameras, poses);
  ScaleToControl(control, run, &placed);
  TiedLandmarks landmarks(control, cameras, placed, run);
  ControlTies ties;
  try {
    ties.points = TiePoints(control, placed, &landmarks);
  } catch (const DataError& error) {
    spdlog::debug("control points do not pull the poses: {}", error.what());
  }
  ties.distances = TieDistances(control, placed, &landmarks);
  return ties;
}

}  // namespace slcmap::mapping
