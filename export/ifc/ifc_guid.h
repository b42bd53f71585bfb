// Identifiers of IFC that say the same of the same content.
#pragma once

#include <string>
#include <string_view>

namespace slcmap {

// The 22 characters that IFC has for a UUID (first 0 to 3, all of 0-9A-Za-z_$): here for that of
// version 5 (RFC 4122) of a name.
std::string IfcGuid(std::string_view name);

}  // namespace slcmap
