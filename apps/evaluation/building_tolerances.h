// What surveyors hold a building, or a map of one, against.
#pragma once

#include <string>

namespace slcmap {

// DIN 18202 (finished walls), by interpolation between the lengths that it lists: the gap under a
// straightedge of a length (3, 5, 10, 20, 25 mm at 0.1, 1, 4, 10, 15 m).
double AllowedGap_m(double length_m);
// The deviation of an angle at the end of a leg (6, 8, 12, 16, 20 mm up to 1, 3, 6, 15, 30 m).
double AllowedAngle_m(double leg_m);
// The deviation of a clear width (16, 20, 24, 30 mm up to 3, 6, 15, 30 m).
double AllowedWidth_m(double width_m);

// What a bend of less than cannot be blamed on a map: over a length, real walls may have it.
inline double BuildingFloor_m(double length_m) { return AllowedGap_m(length_m); }

// The level of accuracy of the USIBD whose band holds an error (95 %): "LOA10" above 50 mm, LOA20
// to 50, LOA30 to 15, LOA40 to 5, LOA50 to 1 mm.
std::string LevelOfAccuracy(double error_95_m);

}  // namespace slcmap
