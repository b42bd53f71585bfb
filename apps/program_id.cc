#include "apps/program_id.h"

#include "data/checksum.h"
#include "data/file.h"
#include "data/version.h"

namespace slcmap {

std::string ProgramId() { return kVersion + (" " + Checksum(ReadFile("/proc/self/exe"))); }

}  // namespace slcmap
