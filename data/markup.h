// Text as it stands in XML and HTML, in content and in quoted attributes.
#pragma once

#include <string>

namespace slcmap {

std::string EscapeMarkup(const std::string& text);

}  // namespace slcmap
