#include "mapping/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kStagesTable{Option{"lines", &StageOptions::lines, false, true},
                                   Option{"building", &StageOptions::building, false, true}};

}  // namespace

void StageOptions::Read(YamlSection section) { kStagesTable.Read(section, this); }

namespace {

// Calls visit(key, struct) for each section of the file, for options that are const or not.
template <typename Options, typename Visit>
void ForEachSection(Options& options, const Visit& visit) {
  visit("stages", options.stages);
  visit("cloud", options.cloud);
  visit("occupancy", options.occupancy);
  visit("adjustment", options.adjustment);
  visit("given_poses", options.given_poses);
  visit("lines", options.lines);
  visit("run_lines", options.run_lines);
  visit("dense", options.dense);
  visit("pipes", options.pipes);
  visit("planes", options.planes);
  visit("junctions", options.junctions);
  visit("building", options.building);
}

}  // namespace

MappingOptions MappingOptions::FromYaml(const std::string& path, ConfigOrigin origin) {
  return ReadConfigFile(path, origin, [](YamlSection& root) {
    MappingOptions options;
    YamlSection section = root.Section("mapping");
    ForEachSection(options, [&](const char* key, auto& part) { part.Read(section.Section(key)); });
    section.Retire({"level_marks"});
    section.Finish();
    options.Check();
    return options;
  });
}

std::string MappingOptions::ToYaml() const {
  MappingOptions options = *this;
  return YamlSection::Dump([&](YamlSection* root) {
    YamlSection section = root->Section("mapping");
    ForEachSection(options, [&](const char* key, auto& part) { part.Read(section.Section(key)); });
  });
}

void MappingOptions::Check() const {
  ForEachSection(*this, [](const char*, const auto& part) { part.Check(); });
}

}  // namespace slcmap::mapping
