#include "export/ifc/ifc_guid.h"

#include <algorithm>
#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/string_generator.hpp>

namespace slcmap {
namespace {

constexpr char kDigits[] = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$";
constexpr char kNamespace[] = "2f6a1c0e-5b7d-4d39-9a53-6c1d3b0f7e42";  // all names of slcmap

// `count` digits of a number.
std::string Digits(uint32_t number, int count) {
  std::string digits;
  for (int i = 0; i < count; ++i, number /= 64) digits.push_back(kDigits[number % 64]);
  std::reverse(digits.begin(), digits.end());
  return digits;
}

}  // namespace

std::string IfcGuid(std::string_view name) {
  const boost::uuids::name_generator_sha1 generate(boost::uuids::string_generator()(kNamespace));
  const boost::uuids::uuid id = generate(name.data(), name.size());
  // The first byte has two digits, each three that follow have four.
  std::string guid = Digits(id.data[0], 2);
  for (std::size_t i = 1; i < id.size(); i += 3) {
    const uint32_t number = static_cast<uint32_t>(id.data[i]) << 16 |
                            static_cast<uint32_t>(id.data[i + 1]) << 8 | id.data[i + 2];
    guid += Digits(number, 4);
  }
  return guid;
}

}  // namespace slcmap
