// Moves a simulated building as far from plumb, straight and parallel as builders do.
//
// A smooth displacement of space (waves of 6 to 18 m in each coordinate, by up to 20 mm along x and
// y each and 10 mm along z, so 3 cm in all) bends walls, floors and everything on them: walls that
// meet still meet, and what hangs on a wall stays on it. Besides, each fitting (everything but
// walls, slabs and stairs; doors and windows too, with their frames) is turned about the middle of
// its foot by up to 0.5 degrees about the vertical, and leans by up to 0.2; long ones by less, so
// that neither moves a part of them by more than 10 mm, or of thin ones, as posters, by more than
// 2.5. These are the deviations that DIN 18202 lets pass,
// and all of them are multiplied by the options' amount.
#pragma once

#include <string>

#include "data/simulator/scene/scene.h"

namespace slcmap::inline data {

// Gives the scene its patches, moves its edges (bent ones become chains of pieces of half a metre
// at most) and tells what it did in scene->inexact. Quads and lamps stay: light is that of the
// exact building. Deterministic. Throws ConfigError where patches become too many.
void MakeInexact(const InexactOptions& options, Scene* scene);

// Amount, seed and the largest displacement (YAML). Throws OutputError.
void WriteInexact(const std::string& path, const InexactTruth& truth);

}  // namespace slcmap::data
