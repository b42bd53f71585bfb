// A storey made of the drawing of a real floor: what is dark is wall.
#pragma once

#include "data/io/yaml.h"
#include "data/simulator/scene/scene_builder.h"
#include "data/simulator/scene/scene_object_reader.h"

namespace slcmap::inline data {

// Reads the section `plan` of a scene and builds it; nothing where it is empty:
//
//   plan:
//     image: floor.png            beside the scene's file; at most 200 million pixels
//     pixel_m: 0.01               origin at the bottom left corner, x right, y up
//     height: 2.9                 metres, of walls
//     walls: [white, brick]       materials, in turn, of walls that do not touch
//     floor: carpet
//     ceiling: ceiling
//     door_height: 2.1            gaps in walls of 0.6 to 2 m get a lintel and frame, ...
//     leaf_deg: [85, 0]           ... and leaves that stand open so far, in turn; 0 is closed
//     glazed_m: 0.13              walls up to so thick are glazed above their parapets; 0: none
//     daylight: 6                 radiance of the panes
//     lamps_m: 3                  from ceiling lamp to ceiling lamp
//     lamp_radiance: 16
//     furniture: 0.5              share of the length of walls that something stands before
//     keep_clear: walk.tum        of furniture and closed leaves: within 0.7 m of these poses
//     seed: 1
//
// Throws ConfigError naming file and key.
void BuildPlan(YamlSection section, const MaterialNames& materials, SceneBuilder* builder);

}  // namespace slcmap::data
