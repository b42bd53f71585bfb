// Reads option structs from YAML that only overrides their defaults; an unknown key is an error.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "data/error.h"

namespace YAML {
class Node;
}

namespace slcmap {

// One mapping of a YAML file. Each key is asked for once; Finish() throws ConfigError, naming file
// and key, when the mapping holds a key that nobody asked for.
//
//   YamlSection root = YamlSection::FromFile("rig.yaml");
//   YamlSection points = root.Section("points");
//   points.Read("max_count", &options.max_count);
//   points.Finish();  root.Finish();
class YamlSection {
 public:
  static YamlSection FromFile(const std::string& path);    // throws ConfigError
  YamlSection(const YAML::Node& node, std::string place);  // place: "file.yaml: key.key"

  // The YAML text of everything that `read` asks a section for: with an empty section, the values
  // that the options have.
  static std::string Dump(const std::function<void(YamlSection*)>& read);

  // The mapping under `key`; an empty one where the key is absent.
  YamlSection Section(const std::string& key);

  // The mappings listed under `key`; none where the key is absent. Throws ConfigError if the value
  // is no list of mappings.
  std::vector<YamlSection> List(const std::string& key);
  // The mapping's keys, in the order of the file; all count as asked for.
  std::vector<std::string> Keys();

  bool Has(const std::string& key) const;
  // Takes a key that is no option any more: files of earlier versions may have it.
  void Skip(const std::string& key) { known_.insert(key); }
  // The same with a warning, for one version, of an option that people may have set.
  void Retire(const std::string& key);

  // Overwrites *value when the key is present; throws ConfigError naming file, key, what was found
  // and the type that was expected. T is bool, int, double, std::string, std::vector of these or
  // std::vector<std::vector<double>>.
  template <typename T>
  void Read(const std::string& key, T* value);

  void Finish() const;
  const std::string& place() const { return place_; }

 private:
  std::shared_ptr<const YAML::Node> node_;  // the parser is a large header
  std::string place_;
  std::set<std::string> known_;
  std::shared_ptr<std::string> dump_;  // that is being made, if one is
  int depth_ = 0;
};

}  // namespace slcmap
