// Where figures and plots of an evaluation may be written.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

// Throws ConfigError naming the option where `path`, of a file or a folder, is one of the inputs,
// or is or lies in the folder of a run, a map, an export or a recording: nothing of these is
// overwritten, nor anything added to them. An empty path is none.
void RefuseAsResult(const std::string& option, const std::string& path,
                    const std::vector<std::string>& inputs);

}  // namespace slcmap
