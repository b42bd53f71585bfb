// PLY files, binary little endian or ASCII.
//
// What other programs can read decides the form: positions are float (PCL reads doubles as zeros
// without a word), vertices have no list properties, nothing but the named elements is written.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace slcmap::inline data {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

// A scalar property: a value for every row of its element.
struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  std::vector<double> values;
};

// An element such as "vertex" or "edge". All properties have equally many values.
struct PlyElement {
  std::string name;
  std::vector<PlyProperty> properties;

  std::size_t size() const { return properties.empty() ? 0 : properties.front().values.size(); }
  // Adds an empty property and returns it; the reference lasts until the next is added.
  PlyProperty& Add(const std::string& property, PlyType type);
  // Makes room for so many rows of the properties that it has.
  void Reserve(std::size_t rows);
  // Appends a value to each property, in their order.
  void AppendRow(std::initializer_list<double> row);
  // The property of that name; throws DataError naming `path` when there is none.
  const PlyProperty& Get(const std::string& property, const std::string& path) const;
  // Its values; throws DataError naming `path` and the row of one that is not from `least` to
  // `most`.
  const std::vector<double>& Bounded(const std::string& property, double least, double most,
                                     const std::string& path) const;
  // Throws DataError naming `path` and the row of a value that an earlier row has too.
  void CheckUnique(const std::string& property, const std::string& path) const;
};

struct PlyFile {
  std::vector<std::string> comments;
  std::vector<PlyElement> elements;
  // Written as an element "face" with a list property "vertex_indices", unless empty; read from
  // there or from "vertex_index". Nothing says that the vertices exist.
  std::vector<std::vector<int32_t>> faces;

  // The element of that name; throws DataError naming `path` when there is none.
  const PlyElement& Get(const std::string& element, const std::string& path) const;
};

// How values are written. Both hold the same: ASCII has as many digits as tell a float from its
// neighbours.
enum class PlyForm { kBinary, kAscii };

// Throws OutputError when the file cannot be written, or a value does not fit its integer type.
void WritePly(const std::string& path, const PlyFile& file, PlyForm form = PlyForm::kBinary);

// The columns x, y and z. Throws DataError naming `path` and the row when one is missing or not
// finite.
std::vector<Eigen::Vector3d> Positions(const PlyElement& vertices, const std::string& path);

// A straight edge between two points, metres in the world frame.
struct PlySegment {
  Eigen::Vector3d start_world, end_world;
};

// Writes segments as an edge-PLY: two vertices an edge. No segments make a valid file too. Throws
// OutputError.
void WriteLinesPly(const std::string& path, const std::vector<PlySegment>& segments);

// The edges of an edge-PLY, from its vertices and "vertex1" and "vertex2". Throws DataError naming
// `path`, and the row of an edge that refers to no vertex.
std::vector<PlySegment> Segments(const PlyFile& file, const std::string& path);

// Reads an edge-PLY. Throws DataError.
std::vector<PlySegment> ReadLinesPly(const std::string& path);

// Throws DataError, naming file and element, when the file is missing, cut short or not a PLY file
// of scalar properties. List properties other than faces are skipped.
PlyFile ReadPly(const std::string& path);

}  // namespace slcmap::data
