// Reads one entry of a scene's list of objects and builds it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "data/io/yaml.h"
#include "data/simulator/scene/scene_builder.h"

namespace slcmap::inline data {

using MaterialNames = std::map<std::string, uint32_t>;  // to indices of the builder's materials

// Keys of every object: kind, at (metres), yaw_deg, tilt_deg (about x, then y), wing, and repeat
// with step (metres) for a row of them, each with the next seed. Throws ConfigError.
void ReadObject(YamlSection section, const MaterialNames& materials, int wings,
                SceneBuilder* builder);

}  // namespace slcmap::data
