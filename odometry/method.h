// The methods of odometry: which landmarks and sensors it uses.
#pragma once

#include <string>

namespace slcmap {

// Landmarks and sensors in use; see README.md, "Methods".
enum class Method { kPointsMono, kPoints, kPointsLines, kStructural, kSlc };

// Throws ConfigError naming the methods there are.
Method MethodFromName(const std::string& name);
// The method of a run whose poses somebody else has estimated.
inline constexpr const char* kGivenPoses = "poses";

// The same as a DataError that names the place where the name was found; kGivenPoses is one.
void CheckMethodName(const std::string& place, const std::string& name);
std::string MethodName(Method method);
bool UsesLines(Method method);
bool UsesStructure(Method method);  // lines along the building's axes

}  // namespace slcmap
