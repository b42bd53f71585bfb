// Where one map lies in the world of another, by what both saw, and the options of aligning and
// merging maps.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "mapping/align/map_agreement.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

// A rough place of the second map's origin in the first one's world, and how it is turned.
struct RoughStart {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;
};

// How far from a rough start the alignment is looked for.
inline constexpr double kStartReach_m = 2, kStartReachUp_m = 1, kStartReachYaw_rad = 0.35;

struct AlignmentOptions {
  std::optional<RoughStart> start;  // none: anywhere
};

// Two maps of which it is not known how they belong together.
class AlignmentError : public DataError {
 public:
  explicit AlignmentError(const std::string& message, std::vector<RigidTransform> places = {})
      : DataError(message), places_(std::move(places)) {}
  // Of the second in the first, where it fits about as well here and there.
  const std::vector<RigidTransform>& places() const { return places_; }

 private:
  std::vector<RigidTransform> places_;
};

struct MapAlignment {
  RigidTransform T_first_second;  // z stays up
  // What both have, within 8 cm and 4 cm across.
  double surfaces_m2 = 0, lines_m = 0;
  double contradiction = 0;  // share of surfaces in the free space of the other
  // Of what tells it from the next best place, how much speaks for that, as a share; 0: no other.
  double rival_share = 0;
  FitInformation information = {};
};

// The second in the first by their places on Earth; nothing where one has none, or they are of two
// systems.
std::optional<RigidTransform> BetweenPlaces(const std::optional<Georeference>& first,
                                            const std::optional<Georeference>& second);

// Deterministic. Throws AlignmentError, saying what was found and what was expected, where the maps
// do not share enough, contradict each other, or fit together in several ways about as well, and
// StoppedError once progress says so.
MapAlignment AlignMaps(const MapResult& first, const MapResult& second,
                       const AlignmentOptions& options, const Progress& progress = {});
MapAlignment AlignMaps(const ComparedMap& first, const ComparedMap& second,
                       const AlignmentOptions& options, const Progress& progress = {});

}  // namespace slcmap::mapping
