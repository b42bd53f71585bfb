#include "odometry/run/run.h"

#include <utility>

#include "data/core/error.h"

namespace slcmap::inline odometry {
namespace {

constexpr std::pair<Method, const char*> kMethodNames[] = {{Method::kPointsMono, "points-mono"},
                                                           {Method::kPoints, "points"},
                                                           {Method::kPointsLines, "points-lines"},
                                                           {Method::kStructural, "structural"},
                                                           {Method::kSlc, "slc"}};

}  // namespace

Method MethodFromName(const std::string& name) {
  for (const auto& [method, method_name] : kMethodNames) {
    if (name == method_name) return method;
  }
  throw ConfigError("method: found '" + name +
                    "', expected points-mono, points, points-lines, structural or slc");
}

void CheckMethodName(const std::string& place, const std::string& name) {
  if (name == kExternalPoses) return;
  try {
    MethodFromName(name);
  } catch (const ConfigError& error) {
    throw DataError(place + ": " + error.what());
  }
}

std::string MethodName(Method method) {
  for (const auto& [named, name] : kMethodNames) {
    if (named == method) return name;
  }
  throw ConfigError("method: found one without a name");
}

bool UsesTwoCameras(Method method, const Rig& rig) {
  return method != Method::kPointsMono && HasTwoCameras(rig);
}

bool UsesRight(Method method, const Rig& rig) {
  return UsesTwoCameras(method, rig) && IsStereo(rig);
}

bool UsesLines(Method method) { return method != Method::kPointsMono && method != Method::kPoints; }

bool UsesStructure(Method method) {
  return method == Method::kStructural || method == Method::kSlc;
}

}  // namespace slcmap::odometry
