#include "odometry/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

namespace {

// Calls visit(key, struct) for each section of the file, for options that are const or not.
template <typename Options, typename Visit>
void ForEachSection(Options& options, const Visit& visit) {
  visit("rectifier", options.rectifier);
  visit("points", options.points);
  visit("window", options.window);
  visit("keyframes", options.keyframes);
  visit("calibration", options.calibration);
  visit("failure", options.failure);
  visit("lines", options.lines);
  visit("slopes", options.slopes);
  visit("line_landmarks", options.line_landmarks);
  visit("building_deviation", options.building_deviation);
}

}  // namespace

OdometryOptions OdometryOptions::FromYaml(const std::string& path) {
  return ReadConfigFile(path, ConfigOrigin::kUser, [](YamlSection& root) {
    OdometryOptions options;
    std::string method = MethodName(options.method);
    root.Read("method", &method);
    options.method = MethodFromName(method);
    root.Retire({"initializer", "manhattan", "line_classifier", "points_on_lines"});
    ForEachSection(options,
                   [&](const char* key, auto& section) { section.Read(root.Section(key)); });
    options.Check();
    return options;
  });
}

std::string OdometryOptions::ToYaml() const {
  OdometryOptions options = *this;
  return YamlSection::Dump([&](YamlSection* root) {
    std::string name = MethodName(options.method);
    root->Read("method", &name);
    ForEachSection(options,
                   [&](const char* key, auto& section) { section.Read(root->Section(key)); });
  });
}

void OdometryOptions::Check() const {
  ForEachSection(*this, [](const char*, const auto& section) { section.Check(); });
}

}  // namespace slcmap::odometry
