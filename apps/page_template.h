// Where the program finds the page that it puts maps into.
#pragma once

#include <string>

namespace slcmap {

// The page's template: the file share/slcmap/page/page.html beside the program's folder, where both
// the build and the installation put it. Throws DataError, saying how to get it, where the program
// was built without it.
std::string ReadPageTemplate();

}  // namespace slcmap
