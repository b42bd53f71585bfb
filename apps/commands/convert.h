// Bags as the output of a command: how they are packed, and that they are there whole or not at
// all.
#pragma once

#include <functional>
#include <string>

#include "data/bag/bag.h"

namespace slcmap::inline commands {

inline constexpr const char* kFolder = "folder";  // what is no bag, as a form

// By the output's name, and what --packing says otherwise. Throws ConfigError.
BagPacking ParsePacking(const std::string& output, const std::string& packing);

// Has a bag made beside its path, and puts it there when it is whole. What else `make` needs has
// the path that it gets with more behind it, and goes with the end. Throws ConfigError where
// something is there that would be lost, or `input` would.
void MakeOutputBag(const std::string& path, const BagPacking& packing, const std::string& input,
                   const std::function<void(const std::string& at)>& make);

}  // namespace slcmap::commands
