#include "apps/evaluation/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace slcmap::inline evaluation {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostOnALine = 6;

std::string ValueText(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_array()) {
    std::string text;
    for (const Json& item : value) text += (text.empty() ? "" : " ") + ValueText(item);
    return text;
  }
  if (!value.is_number_float()) return value.is_null() ? "-" : value.dump();
  const auto number = value.get<double>();
  return std::isnan(number) ? "-" : fmt::format("{:.5g}", number);
}

bool HoldsObjects(const Json& json) {
  return json.is_object() ||
         (json.is_array() && std::any_of(json.begin(), json.end(), HoldsObjects));
}

// Rows of the same figures, under their names.
std::string RowsText(const Json& rows) {
  std::string head, text;
  for (const Json& row : rows) {
    head.clear();
    const Json flat = row.flatten();  // figures within figures have names of several parts
    for (const auto& [name, value] : flat.items()) {
      const std::string title = name.substr(1);
      const size_t width = std::max(title.size(), size_t{8}) + 2;
      head += fmt::format("{:>{}}", title, width);
      text += fmt::format("{:>{}}", ValueText(value), width);
    }
    text += "\n";
  }
  return head + "\n" + text;
}

void AddFigures(const std::string& of, const Json& json, std::string* text) {
  for (const auto& [key, value] : json.items()) {
    const std::string name = of + key;
    const bool is_deep = value.is_object() && std::any_of(value.begin(), value.end(), HoldsObjects);
    if (is_deep || (value.is_object() && value.size() > kMostOnALine)) {
      AddFigures(name + " ", value, text);
    } else if (value.is_array() && HoldsObjects(value)) {
      *text += "\n" + name + "\n" + RowsText(value) + "\n";
    } else {
      *text += fmt::format("{:<26}", name);
      if (!value.is_object()) *text += " " + ValueText(value);
      if (value.is_object()) {
        for (const auto& [part, figure] : value.items()) {
          *text += fmt::format(" {} {} ", part, ValueText(figure));
        }
      }
      *text += "\n";
    }
  }
}

}  // namespace

std::string FiguresText(const Json& figures) {
  std::string text;
  AddFigures("", figures, &text);
  return text;
}

}  // namespace slcmap::evaluation
