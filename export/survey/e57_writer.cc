#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <iterator>
#include <string_view>

#include "data/io/file.h"
#include "data/version.h"
#include "export/scene/formats.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {
namespace {

constexpr std::size_t kPageBytes = 1020, kChecksumBytes = 4, kHeaderBytes = 48;

// CRC-32C (Castagnoli), reflected.
constexpr std::array<uint32_t, 256> MakeCrcTable() {
  std::array<uint32_t, 256> table{};
  for (uint32_t i = 0; i < 256; ++i) {
    uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = value >> 1 ^ (value & 1 ? 0x82f63b78u : 0u);
    table[i] = value;
  }
  return table;
}
constexpr std::array<uint32_t, 256> kCrcTable = MakeCrcTable();

uint32_t Crc32c(std::string_view bytes) {
  uint32_t crc = ~0u;
  for (const char c : bytes) crc = crc >> 8 ^ kCrcTable[(crc ^ static_cast<uint8_t>(c)) & 0xff];
  return ~crc;
}

// Bytes in pages of 1020, each with a checksum. Places in the file are told as "physical", with the
// checksums before them.
class E57Pages {
 public:
  explicit E57Pages(const std::string& path) : file_(path) {}

  void Add(std::string_view bytes) {
    size_ += bytes.size();
    while (!bytes.empty()) {
      const std::size_t part = std::min(bytes.size(), kPageBytes - page_.size());
      page_.append(bytes.substr(0, part));
      bytes.remove_prefix(part);
      if (page_.size() < kPageBytes) return;
      file_.Add(WithChecksum(page_));
      if (first_.empty()) first_ = page_;
      page_.clear();
    }
  }
  uint64_t size() const { return size_; }  // without checksums
  static uint64_t Physical(uint64_t place) { return place + place / kPageBytes * kChecksumBytes; }

  // Writes what is left, and `header` over the first bytes.
  void Close(std::string_view header) {
    if (!page_.empty()) Add(std::string(kPageBytes - page_.size(), '\0'));
    first_.replace(0, header.size(), header);
    file_.Overwrite(0, WithChecksum(first_));
    file_.Close();
  }

 private:
  // Unlike all other numbers, checksums have their highest byte first.
  static std::string WithChecksum(std::string page) {
    page.resize(kPageBytes, '\0');
    const uint32_t crc = Crc32c(page);
    for (const int shift : {24, 16, 8, 0}) page += static_cast<char>(crc >> shift & 0xff);
    return page;
  }

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

constexpr uint64_t kRecordsOfPacket = 2000;  // of at most 32 bytes: a packet has at most 65,536
constexpr std::size_t kSectionHeaderBytes = 32, kIndexBytes = 32;

struct E57Field {
  const char* name;
  std::size_t bytes;  // 4: a float, 1: an integer from 0 to 255
  bool of_surfaces;
};
constexpr std::array<E57Field, 11> kE57Fields = {{{"cartesianX", 4, false},
                                                  {"cartesianY", 4, false},
                                                  {"cartesianZ", 4, false},
                                                  {"slc:sigma", 4, false},
                                                  {"nor:normalX", 4, true},
                                                  {"nor:normalY", 4, true},
                                                  {"nor:normalZ", 4, true},
                                                  {"intensity", 1, true},
                                                  {"colorRed", 1, true},
                                                  {"colorGreen", 1, true},
                                                  {"colorBlue", 1, true}}};

std::vector<E57Field> ListFields(const E57Scan& scan) {
  std::vector<E57Field> fields;
  std::ranges::copy_if(kE57Fields, std::back_inserter(fields), [&](const E57Field& field) {
    return scan.has_surfaces || !field.of_surfaces;
  });
  return fields;
}

std::size_t PacketBytes(const std::vector<E57Field>& fields, uint64_t records) {
  std::size_t bytes = 6 + 2 * fields.size();
  for (const E57Field& field : fields) bytes += field.bytes * records;
  return (bytes + 3) / 4 * 4;
}

// Of all packets with points.
uint64_t DataBytes(const E57Scan& scan) {
  const std::vector<E57Field> fields = ListFields(scan);
  const uint64_t rest = scan.count % kRecordsOfPacket;
  return scan.count / kRecordsOfPacket * PacketBytes(fields, kRecordsOfPacket) +
         (rest == 0 ? 0 : PacketBytes(fields, rest));
}

std::string SectionHeader(const E57Scan& scan, uint64_t start) {
  constexpr uint8_t kCompressedVector = 1;
  const uint64_t data = start + kSectionHeaderBytes, index = data + DataBytes(scan);
  std::string bytes;
  AppendBytes(kCompressedVector, &bytes);
  bytes.append(7, '\0');
  AppendBytes(index + kIndexBytes - start, &bytes);
  AppendBytes(E57Pages::Physical(data), &bytes);
  AppendBytes(E57Pages::Physical(index), &bytes);
  return bytes;
}

// XML.

std::string Text(const char* name, const std::string& text) {
  return fmt::format("<{0} type=\"String\">{1}</{0}>\n", name, EscapeMarkup(text));
}
std::string Real(const std::string& name, double value) {
  return fmt::format("<{0} type=\"Float\">{1}</{0}>", name, value);
}
std::string Whole(const std::string& name, int64_t value) {
  return fmt::format("<{0} type=\"Integer\">{1}</{0}>", name, value);
}
std::string Structure(const char* name, const std::string& parts) {
  return fmt::format("<{0} type=\"Structure\">{1}</{0}>\n", name, parts);
}

std::string BoundsXml(const Eigen::AlignedBox3d& box) {
  std::string parts;
  for (int axis = 0; axis < 3; ++axis) {
    const char name = "xyz"[axis];
    parts += Real(fmt::format("{}Minimum", name), box.min()[axis]);
    parts += Real(fmt::format("{}Maximum", name), box.max()[axis]);
  }
  return Structure("cartesianBounds", parts);
}

std::string LimitsXml() {
  const auto limits = [](const char* field) {
    return Whole(fmt::format("{}Minimum", field), 0) + Whole(fmt::format("{}Maximum", field), 255);
  };
  return Structure("intensityLimits", limits("intensity")) +
         Structure("colorLimits", limits("colorRed") + limits("colorGreen") + limits("colorBlue"));
}

std::string PoseXml(const RigidTransform& T) {
  const Eigen::Quaterniond& q = T.rotation;
  const Eigen::Vector3d& t = T.translation;
  return Structure(
      "pose", Structure("rotation",
                        Real("w", q.w()) + Real("x", q.x()) + Real("y", q.y()) + Real("z", q.z())) +
                  Structure("translation", Real("x", t.x()) + Real("y", t.y()) + Real("z", t.z())));
}

std::string PointsXml(const E57Scan& scan, uint64_t section) {
  std::string prototype;
  for (const E57Field& field : ListFields(scan)) {
    prototype +=
        field.bytes == 1
            ? fmt::format("<{} type=\"Integer\" minimum=\"0\" maximum=\"255\"/>", field.name)
            : fmt::format("<{} type=\"Float\" precision=\"single\"/>", field.name);
  }
  return fmt::format(
      "<points type=\"CompressedVector\" fileOffset=\"{}\" recordCount=\"{}\">\n{}"
      "<codecs type=\"Vector\" allowHeterogeneousChildren=\"1\"/>\n</points>\n",
      E57Pages::Physical(section), scan.count, Structure("prototype", prototype));
}

// The same for the same text, in the form of a UUID.
std::string E57Guid(const std::string& text) {
  const boost::uuids::name_generator_sha1 generate(boost::uuids::ns::oid());
  return fmt::format("{{{}}}", boost::uuids::to_string(generate("slcmap " + text)));
}

// A file that is written point by point, as ASTM E2807 describes it: pages with checksums, sections
// of packets with the points, and XML that says what they are; a packet is in memory. Coordinates
// are floats in the frame of their scan. Normals follow the extension of libE57 (nor:normalX ...),
// the standard deviation in metres one of its own (slc:sigma).
class E57File {
 public:
  // `crs` is OGC WKT.
  E57File(const std::string& path, const std::string& guid, const std::string& crs)
      : pages_(path), guid_(guid), crs_(crs) {
    pages_.Add(std::string(kHeaderBytes, '\0'));
  }

  // From here on points are of this scan; as many as it says have to be added before the next.
  void Begin(const E57Scan& scan) {
    scan_ = scan;
    section_ = pages_.size();
    added_ = 0;
    streams_.assign(ListFields(scan).size(), "");
    box_.setEmpty();
    pages_.Add(SectionHeader(scan, section_));
  }

  void Add(const SurveyPoint& point) {
    const Eigen::Vector3f p = point.p.cast<float>();
    for (int axis = 0; axis < 3; ++axis)
      AppendBytes(p[axis], &streams_[static_cast<std::size_t>(axis)]);
    box_.extend(p.cast<double>());
    AppendBytes(static_cast<float>(point.sigma_m), &streams_[3]);
    if (scan_.has_surfaces) {
      const Eigen::Vector3f normal = point.normal.cast<float>();
      for (std::size_t i = 4; const float part : normal) AppendBytes(part, &streams_[i++]);
      for (std::size_t i = 7; i < streams_.size(); ++i) AppendBytes(point.grey, &streams_[i]);
    }
    ++added_;
    if (added_ % kRecordsOfPacket == 0 || added_ == scan_.count) WritePacket();
    if (added_ == scan_.count) {
      WriteIndex();
      AddScanXml();
    }
  }

  void Close() {
    const std::string xml =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\" "
        "xmlns:nor=\"http://www.libe57.org/E57_NOR_surface_normals.txt\" "
        "xmlns:slc=\"urn:x-slcmap:e57\">\n" +
        Text("formatName", "ASTM E57 3D Imaging Data File") + Text("guid", guid_) +
        Whole("versionMajor", 1) + Whole("versionMinor", 0) +
        Text("e57LibraryVersion", std::string("slcmap ") + kVersion) +
        Text("coordinateMetadata", crs_) +
        "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n" + scans_xml_ +
        "</data3D>\n<images2D type=\"Vector\" allowHeterogeneousChildren=\"1\"/>\n</e57Root>\n";
    const uint64_t start = pages_.size();
    pages_.Add(xml);
    const uint64_t pages = (pages_.size() + kPageBytes - 1) / kPageBytes;
    std::string header = "ASTM-E57";
    AppendBytes(uint32_t{1}, &header);
    AppendBytes(uint32_t{0}, &header);
    AppendBytes(pages * (kPageBytes + kChecksumBytes), &header);
    AppendBytes(E57Pages::Physical(start), &header);
    AppendBytes(static_cast<uint64_t>(xml.size()), &header);
    AppendBytes(static_cast<uint64_t>(kPageBytes + kChecksumBytes), &header);
    pages_.Close(header);
  }

 private:
  void WritePacket() {
    constexpr uint8_t kData = 1;
    const uint64_t records = streams_[0].size() / sizeof(float);
    const std::size_t size = PacketBytes(ListFields(scan_), records);
    std::string packet;
    AppendBytes(kData, &packet);
    AppendBytes(uint8_t{0}, &packet);
    AppendBytes(static_cast<uint16_t>(size - 1), &packet);
    AppendBytes(static_cast<uint16_t>(streams_.size()), &packet);
    for (const std::string& stream : streams_) {
      AppendBytes(static_cast<uint16_t>(stream.size()), &packet);
    }
    for (std::string& stream : streams_) {
      packet += stream;
      stream.clear();
    }
    packet.resize(size, '\0');
    pages_.Add(packet);
  }

  // Readers go through the packets: the index names the first one, as the standard wants at least.
  void WriteIndex() {
    std::string packet(2, '\0');  // of an index, without flags
    AppendBytes(static_cast<uint16_t>(kIndexBytes - 1), &packet);
    AppendBytes(uint16_t{1}, &packet);  // entries
    packet.resize(16, '\0');            // the lowest level
    AppendBytes(uint64_t{0}, &packet);  // the point, and where its packet is
    AppendBytes(E57Pages::Physical(section_ + kSectionHeaderBytes), &packet);
    pages_.Add(packet);
  }

  void AddScanXml() {
    scans_xml_ += "<vectorChild type=\"Structure\">\n" + Text("guid", scan_.guid) +
                  Text("name", scan_.name) + Text("description", scan_.description) +
                  BoundsXml(box_) + (scan_.has_surfaces ? LimitsXml() : "") +
                  PoseXml(scan_.T_file) + PointsXml(scan_, section_) + "</vectorChild>\n";
  }

  E57Pages pages_;
  std::string guid_, crs_, scans_xml_;
  E57Scan scan_;
  uint64_t section_ = 0, added_ = 0;  // where the scan's begins; points of it so far
  std::vector<std::string> streams_;  // of the packet, one a field
  Eigen::AlignedBox3d box_;
};

std::string Describe(PointSource source) {
  return std::array{"", "surfaces, measured by stereo",
                    "planes of the building where nothing was measured: derived",
                    "landmarks of the adjustment"}[static_cast<std::size_t>(source)];
}

// A pose holds no scale: that of a grid is in the points.
RigidTransform MakePose(const Georeference& place) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(place.turn_rad, Eigen::Vector3d::UnitZ())),
          place.origin_m};
}

void WriteScan(const MapResult& map, PointSource source, const Progress& progress, E57File* file) {
  const Georeference place = FindPlace(map.source);
  const std::size_t count = CountPoints(map, source);
  file->Begin({.name = GetName(source),
               .description = Describe(source),
               .guid = E57Guid(fmt::format("{} {}", map.id, GetName(source))),
               .count = count,
               .T_file = MakePose(place),
               .has_surfaces = source != PointSource::kLandmark});
  for (std::size_t i = 0; i < count; ++i) {
    if (i % kPointsToReport == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(count));
    }
    SurveyPoint point = PointAt(map, source, i);
    point.p.head<2>() *= place.scale;
    file->Add(point);
  }
}

}  // namespace

std::vector<std::string> WriteE57(const std::string& folder, const MapResult& map,
                                  const Progress& progress) {
  const std::string path = folder + "/cloud.e57";
  E57File file(path, E57Guid(map.id), CrsWkt(FindPlace(map.source)));
  double from = 0;
  for (const PointSource source : kPointSources) {
    const double to = from + 1.0 / kPointSources.size();
    if (CountPoints(map, source) > 0) WriteScan(map, source, progress.Part(from, to), &file);
    from = to;
  }
  file.Close();
  return {path};
}

}  // namespace slcmap::exporting
