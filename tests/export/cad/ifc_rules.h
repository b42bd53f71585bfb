// What an IFC4 file must keep to, as far as slcmap writes it: a second opinion on the writer, made
// from the standard.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace slcmap::testing {

struct StepEntity {
  std::string type;
  std::vector<std::string> attributes;
};

using StepEntities = std::map<std::string, StepEntity>;  // by reference, as "#12"

// The entities of a STEP file that has one a line; what is no entity is left out.
StepEntities ParseStep(const std::string& text);

// The references in an attribute.
std::vector<std::string> ReferencesIn(const std::string& attribute);

// What is wrong, a row each: attributes (their number, mandatory and derived ones), identities,
// references, representations (one product each, in the context of their name), elements that no
// part of the building contains.
std::vector<std::string> FindIfcFaults(const std::string& text);

}  // namespace slcmap::testing
