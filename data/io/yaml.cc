#include "data/io/yaml.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <vector>

#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Letters to add, leave out, replace or swap with the next ("optimal string alignment").
std::size_t Edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> edits(a.size() + 1,
                                              std::vector<std::size_t>(b.size() + 1, 0));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        edits[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = edits[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      edits[i][j] = std::min({edits[i - 1][j] + 1, edits[i][j - 1] + 1, replaced});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) edits[i][j] = std::min(edits[i][j], edits[i - 2][j - 2] + 1);
    }
  }
  return edits[a.size()][b.size()];
}

}  // namespace

std::string DidYouMean(const std::string& found, const std::vector<std::string>& names) {
  constexpr std::size_t kMaxLength = 64;  // no name is as long
  if (found.size() > kMaxLength) return "";
  const std::string* nearest = nullptr;
  std::size_t fewest = 0;
  for (const std::string& name : names) {
    const std::size_t edits = Edits(Lower(found), Lower(name));
    if (3 * edits > std::max(found.size(), name.size())) continue;
    if (!nearest || edits < fewest) {
      nearest = &name;
      fewest = edits;
    }
  }
  return nearest ? "; did you mean '" + *nearest + "'?" : "";
}

namespace {

// What a value of a type is called in messages.
std::string TypeName(bool) { return "true or false"; }
std::string TypeName(int) { return "a whole number"; }
std::string TypeName(double) { return "a finite number"; }
std::string TypeName(const std::string&) { return "a text"; }
template <typename T>
std::string TypeName(const std::vector<T>&) {
  return "a list, each entry " + TypeName(T());
}

bool IsFinite(double value) { return std::isfinite(value); }
template <typename T>
bool IsFinite(const T&) {
  return true;
}
template <typename T>
bool IsFinite(const std::vector<T>& values) {
  for (const T& value : values) {
    if (!IsFinite(value)) return false;
  }
  return true;
}

// As YAML shows a value.
template <typename T>
std::string Text(const T& value) {
  return fmt::format("{}", value);
}
template <typename T>
std::string Text(const std::vector<T>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}
std::string Text(const std::vector<std::vector<double>>& values) {
  std::string text;
  for (const auto& value : values) text += (text.empty() ? "" : ", ") + Text(value);
  return "[" + text + "]";
}

template <typename T>
bool Decode(const YAML::Node& node, T* value) {
  try {
    return YAML::convert<T>::decode(node, *value);
  } catch (const YAML::Exception&) {  // an entry of a list
    return false;
  }
}

// What was found, on one line and not too long.
std::string Shown(const YAML::Node& node) {
  if (node.IsNull()) return "nothing";
  std::string text = YAML::Dump(node);
  for (char& c : text) {
    if (c == '\n') c = ' ';
  }
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return "'" + text + "'";
}

std::string OneLine(const YAML::Exception& error) {
  std::string text = error.msg;
  if (!error.mark.is_null()) text = "row " + std::to_string(error.mark.line + 1) + ": " + text;
  return text;
}

// "file.yaml: a.b" -> "file.yaml: a.b.key"; "file.yaml" -> "file.yaml: key".
std::string KeyPlace(const std::string& place, const std::string& key) {
  return place + (place.find(": ") == std::string::npos ? ": " : ".") + key;
}

}  // namespace

YamlSection YamlSection::FromFile(const std::string& path) {
  std::string text;
  try {
    text = WithoutByteOrderMark(ReadFile(path));
  } catch (const DataError& read_error) {
    throw ConfigError(read_error.what());
  }
  // OpenCV opens its files with "%YAML:1.0", which is not YAML.
  if (text.rfind("%YAML:", 0) == 0) text[0] = '#';
  try {
    return YamlSection(YAML::Load(text), path);
  } catch (const YAML::Exception& exception) {
    throw ConfigError(path + ": found no valid YAML: " + OneLine(exception));
  }
}

YamlSection::YamlSection(const YAML::Node& node, std::string place)
    : node_(std::make_shared<const YAML::Node>(node)), place_(std::move(place)) {
  if (node_->IsDefined() && !node_->IsNull() && !node_->IsMap()) {
    throw ConfigError(place_ + ": found " + Shown(node) + ", expected keys with values");
  }
}

std::string YamlSection::Dump(const std::function<void(YamlSection*)>& read) {
  YamlSection root(YAML::Node(), "options");
  root.dump_ = std::make_shared<std::string>();
  read(&root);
  return *root.dump_;
}

YamlSection YamlSection::Section(const std::string& key) {
  known_.insert(key);
  const std::string place = KeyPlace(place_, key);
  if (dump_) {
    *dump_ += std::string(2 * depth_, ' ') + key + ":\n";
    YamlSection section(YAML::Node(), place);
    section.dump_ = dump_;
    section.depth_ = depth_ + 1;
    return section;
  }
  YamlSection section(Has(key) ? (*node_)[key] : YAML::Node(), place);
  section.retired_ = retired_;
  return section;
}

std::vector<YamlSection> YamlSection::List(const std::string& key) {
  known_.insert(key);
  std::vector<YamlSection> sections;
  if (!Has(key)) return sections;
  const YAML::Node list = (*node_)[key];
  const std::string place = KeyPlace(place_, key);
  if (!list.IsSequence()) {
    throw ConfigError(place + ": found " + Shown(list) + ", expected a list");
  }
  for (size_t i = 0; i < list.size(); ++i) {
    sections.emplace_back(list[i], place + "[" + std::to_string(i) + "]");
  }
  return sections;
}

std::vector<std::string> YamlSection::Keys() {
  std::vector<std::string> keys;
  for (const auto& entry : *node_) keys.push_back(entry.first.Scalar());
  known_.insert(keys.begin(), keys.end());
  return keys;
}

bool YamlSection::Has(const std::string& key) const {
  return node_->IsMap() && (*node_)[key].IsDefined();  // the const operator[] adds no key
}

void YamlSection::Retire(std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    Skip(key);
    if (Has(key)) retired_->push_back(KeyPlace(place_, key));
  }
}

template <typename T>
void YamlSection::Read(const std::string& key, T* value) {
  known_.insert(key);
  if (dump_) *dump_ += fmt::format("{}{}: {}\n", std::string(2 * depth_, ' '), key, Text(*value));
  if (!Has(key)) return;
  const YAML::Node found = (*node_)[key];
  T read{};
  if (!Decode(found, &read) || !IsFinite(read)) {
    throw ConfigError(KeyPlace(place_, key) + ": found " + Shown(found) + ", expected " +
                      TypeName(read));
  }
  *value = read;
}

void YamlSection::Finish() const {
  std::set<std::string> seen;
  for (const auto& entry : *node_) {
    const std::string key = entry.first.Scalar();
    const std::string place = KeyPlace(place_, key);
    if (!seen.insert(key).second) throw ConfigError(place + ": found twice, expected once");
    if (known_.count(key) != 0) continue;
    const std::vector<std::string> names(known_.begin(), known_.end());
    throw ConfigError(fmt::format("{}: unknown key{}; expected one of: {}", place,
                                  DidYouMean(key, names), fmt::join(names, ", ")));
  }
}

template void YamlSection::Read(const std::string&, bool*);
template void YamlSection::Read(const std::string&, int*);
template void YamlSection::Read(const std::string&, double*);
template void YamlSection::Read(const std::string&, std::string*);
template void YamlSection::Read(const std::string&, std::vector<bool>*);
template void YamlSection::Read(const std::string&, std::vector<int>*);
template void YamlSection::Read(const std::string&, std::vector<double>*);
template void YamlSection::Read(const std::string&, std::vector<std::string>*);
template void YamlSection::Read(const std::string&, std::vector<std::vector<double>>*);

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

void WarnOfRetiredKeys(const std::string& path, const std::vector<std::string>& places) {
  if (places.empty()) return;
  constexpr std::size_t kMostNamed = 4;
  const std::size_t named = std::min(places.size(), kMostNamed);
  std::vector<std::string> keys;  // without the file, which the places name too
  for (std::size_t i = 0; i < named; ++i) keys.push_back(places[i].substr(path.size() + 2));
  const std::string more =
      places.size() > named ? fmt::format(" and {} more", places.size() - named) : "";
  spdlog::warn(
      "{}: found {}{}, which are no options any more and do nothing; remove them: the next version "
      "refuses them",
      path, fmt::join(keys, ", "), more);
}

ConfigError NamingFile(const std::string& path, const ConfigError& error) {
  const std::string what = error.what();
  return what.compare(0, path.size(), path) == 0 ? error : ConfigError(path + ": " + what);
}

}  // namespace slcmap::data
