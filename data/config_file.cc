#include "data/config_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace slcmap {

YamlSection OpenConfigFile(const std::string& path) {
  YamlSection root = YamlSection::FromFile(path);
  for (const std::string& key : root.Keys()) {
    if (std::find(std::begin(kConfigKeys), std::end(kConfigKeys), key) != std::end(kConfigKeys)) {
      continue;
    }
    throw ConfigError(fmt::format("{}: {}: unknown key; expected one of: {}", path, key,
                                  fmt::join(kConfigKeys, ", ")));
  }
  root.Finish();  // refuses repeated keys
  return root;
}

ConfigError NamingFile(const std::string& path, const ConfigError& error) {
  const std::string what = error.what();
  return what.compare(0, path.size(), path) == 0 ? error : ConfigError(path + ": " + what);
}

}  // namespace slcmap
