// What a mistyped name was probably meant to be.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

// "; did you mean 'slc'?" for the name that takes the fewest letters to add, leave out, replace or
// swap with the next, upper or lower case; "" where that is more than a third of them.
std::string DidYouMean(const std::string& found, const std::vector<std::string>& names);

}  // namespace slcmap
