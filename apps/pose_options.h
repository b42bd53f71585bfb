// The command-line options of the form in which others write poses, which map, evaluate and compare
// share.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "data/pose_form.h"

namespace slcmap {

// `form` must outlive the parsing. Returns what was added.
std::vector<CLI::Option*> AddPoseOptions(CLI::App& command, PoseForm* form);

}  // namespace slcmap
