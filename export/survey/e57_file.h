// E57 files of points, as ASTM E2807 describes them: pages with checksums, sections of packets with
// the points, and XML that says what they are.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/rigid_transform.h"
#include "data/io/file.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {

// Bytes in pages of 1020, each with a checksum. Places in the file are told as "physical", with the
// checksums before them.
class E57Pages {
 public:
  explicit E57Pages(const std::string& path) : file_(path) {}

  void Add(std::string_view bytes);
  uint64_t size() const { return size_; }  // without checksums
  static uint64_t Physical(uint64_t place);

  // Writes what is left, and `header` over the first bytes.
  void Close(std::string_view header);

 private:
  static std::string WithChecksum(std::string page);

  FileWriter file_;
  std::string first_, page_;  // the first page is kept, as the header is known at the end
  uint64_t size_ = 0;
};

// A cloud of a file (Data3D).
struct E57Scan {
  std::string name, description, guid;
  uint64_t count = 0;         // of points, more than 0
  RigidTransform T_file;      // from the points' frame to that of the file
  bool has_surfaces = false;  // points have grey (as intensity and colour) and a normal
};

// A file that is written point by point; a packet of them is in memory. Coordinates are floats in
// the frame of their scan. Normals follow the extension of libE57 (nor:normalX ...), the standard
// deviation in metres one of its own (slc:sigma).
class E57File {
 public:
  // `crs` is OGC WKT. Throws OutputError where the file cannot be made, as
  // the functions below where it cannot be written.
  E57File(const std::string& path, const std::string& guid, const std::string& crs);

  // From here on points are of this scan; as many as it says have to be added before the next.
  void Begin(const E57Scan& scan);
  void Add(const SurveyPoint& point);

  void Close();

 private:
  void WritePacket();
  void WriteIndex();
  void AddScanXml();

  E57Pages pages_;
  std::string guid_, crs_, scans_xml_;
  E57Scan scan_;
  uint64_t section_ = 0, added_ = 0;  // where the scan's begins; points of it so far
  std::vector<std::string> streams_;  // of the packet, one a field
  Eigen::AlignedBox3d box_;
};

// The same for the same text, in the form of a UUID.
std::string E57Guid(const std::string& text);

}  // namespace slcmap::exporting
