// Programs of npm that read exports back: tests/readers says how they are installed.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/testing/reader_program.h"

namespace slcmap::testing {

// Whether a package of tests/readers/package.json, and node to run it, are installed.
inline bool HasNodeReader(const std::string& package) {
  const std::filesystem::path readers = SLCMAP_SOURCE_DIR "/tests/readers";
  return std::filesystem::exists(readers / "node_modules" / package / "package.json") &&
         HasProgram("node");
}

inline std::string NodeReaderMissing(const std::string& package) {
  return package + " is not installed: npm ci --prefix tests/readers";
}

// What a command writes to its outputs; its exit code.
struct ReaderOutput {
  std::string text;
  int status = -1;
};

inline ReaderOutput RunReader(const std::string& command) {
  ReaderOutput output;
  output.text = OutputOf(command, &output.status);
  return output;
}

// Runs a script of tests/readers on a file.
inline ReaderOutput RunNodeReader(const std::string& script, const std::string& file) {
  return RunReader("node " SLCMAP_SOURCE_DIR "/tests/readers/" + script + " '" + file + "'");
}

// The rows "product TYPE GUID TRIANGLES VOLUME LOW HIGH" of read_ifc.mjs.
struct IfcProduct {
  std::string type, guid;
  double triangles = 0, volume_m3 = 0;
  Eigen::Vector3d low, high;
};

inline std::vector<IfcProduct> IfcProducts(const std::string& text, const std::string& type) {
  std::vector<IfcProduct> products;
  std::istringstream rows(text);
  for (std::string row; std::getline(rows, row);) {
    std::istringstream values(row);
    IfcProduct p;
    std::string word;
    values >> word >> p.type >> p.guid >> p.triangles >> p.volume_m3 >> p.low.x() >> p.low.y() >>
        p.low.z() >> p.high.x() >> p.high.y() >> p.high.z();
    if (values && word == "product" && p.type == type) products.push_back(p);
  }
  return products;
}

}  // namespace slcmap::testing
