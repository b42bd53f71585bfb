#include "export/ifc/step_file.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstdint>

#include "data/error.h"

namespace slcmap {
namespace {

constexpr char kStamp[] = "1970-01-01T00:00:00";
constexpr uint32_t kReplacement = 0xfffd;

// The character that begins at *at, which is moved on; what is no UTF-8 becomes the replacement
// character.
uint32_t NextCharacter(std::string_view utf8, std::size_t* at) {
  const auto lead = static_cast<uint8_t>(utf8[(*at)++]);
  if (lead < 0x80) return lead;
  const int following = lead >= 0xf0 ? 3 : lead >= 0xe0 ? 2 : lead >= 0xc0 ? 1 : 0;
  if (following == 0 || *at + static_cast<std::size_t>(following) > utf8.size()) {
    return kReplacement;
  }
  uint32_t character = lead & (0x3fu >> following);
  for (int i = 0; i < following; ++i) {
    const auto byte = static_cast<uint8_t>(utf8[*at]);
    if ((byte & 0xc0) != 0x80) return kReplacement;
    character = (character << 6) | (byte & 0x3f);
    ++*at;
  }
  return character;
}

std::string Joined(std::string_view type, const std::vector<std::string>& attributes) {
  return fmt::format("{}({})", type, fmt::join(attributes, ","));
}

}  // namespace

std::string StepReal(double value, int decimals) {
  if (!std::isfinite(value)) {
    throw DataError(fmt::format("ifc: found the number {}, expected a finite one", value));
  }
  std::string text = fmt::format("{:.{}f}", value, decimals);
  text.erase(text.find_last_not_of('0') + 1);
  return text == "-0." ? "0." : text;
}

std::string StepText(std::string_view utf8) {
  std::string text = "'";
  for (std::size_t at = 0; at < utf8.size();) {
    const uint32_t character = NextCharacter(utf8, &at);
    if (character == '\'' || character == '\\') {
      text.append(2, static_cast<char>(character));
    } else if (character >= 0x20 && character < 0x7f) {
      text.push_back(static_cast<char>(character));
    } else if (character < 0x10000) {
      text += fmt::format("\\X2\\{:04X}\\X0\\", character);
    } else {
      text += fmt::format("\\X4\\{:08X}\\X0\\", character);
    }
  }
  return text + "'";
}

std::string StepBool(bool value) { return value ? ".T." : ".F."; }

std::string StepList(const std::vector<std::string>& values) {
  return fmt::format("({})", fmt::join(values, ","));
}

std::string StepFile::Add(std::string_view type, const std::vector<std::string>& attributes) {
  std::string reference = fmt::format("#{}", ++count_);
  data_ += fmt::format("{}={};\n", reference, Joined(type, attributes));
  return reference;
}

std::string StepFile::Share(std::string_view type, const std::vector<std::string>& attributes) {
  std::string& reference = shared_[Joined(type, attributes)];
  if (reference.empty()) reference = Add(type, attributes);
  return reference;
}

std::string StepFile::Text(std::string_view name, std::string_view schema, std::string_view view,
                           std::string_view writer) const {
  return fmt::format(
      "ISO-10303-21;\nHEADER;\n"
      "FILE_DESCRIPTION(({}),'2;1');\n"
      "FILE_NAME({},'{}',(''),(''),{},{},'');\n"
      "FILE_SCHEMA(({}));\nENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
      StepText(view), StepText(name), kStamp, StepText(writer), StepText(writer), StepText(schema),
      data_);
}

}  // namespace slcmap
