// Which build of the program this is.
#pragma once

#include <string>

namespace slcmap {

// What tells this program from another build of it, of the same version too. Throws DataError.
std::string ProgramId();

}  // namespace slcmap
