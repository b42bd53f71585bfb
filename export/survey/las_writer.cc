#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/version.h"
#include "export/scene/formats.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {
namespace {

enum class LasVersion {
  k12,  // points of format 2; at most 2^32 - 1 of them
  k14,  // points of format 7
};

constexpr double kUnit_m = 1e-4;
constexpr std::size_t kBlockBytes = 1 << 18;
constexpr uint8_t kUnclassified = 1, kSynthetic12 = 0x20, kSynthetic14 = 0x01;
constexpr uint16_t kWktBit = 0x10;  // of the global encoding

constexpr bool Is14(LasVersion version) { return version == LasVersion::k14; }
constexpr uint16_t HeaderBytes(LasVersion version) { return Is14(version) ? 375 : 227; }
constexpr uint16_t kExtraBytes = 4 * sizeof(float);
constexpr uint16_t PointBytes(LasVersion version) {
  return static_cast<uint16_t>((Is14(version) ? 36 : 26) + kExtraBytes);
}

// A text in a field of a fixed size, zeros after it.
void AppendField(std::string_view text, std::size_t size, std::string* bytes) {
  const std::string_view kept = text.substr(0, size);
  bytes->append(kept);
  bytes->append(size - kept.size(), '\0');
}

// A variable length record.
std::string Record(std::string_view user, uint16_t id, std::string_view description,
                   std::string_view content) {
  std::string bytes;
  AppendBytes(uint16_t{0}, &bytes);
  AppendField(user, 16, &bytes);
  AppendBytes(id, &bytes);
  AppendBytes(static_cast<uint16_t>(content.size()), &bytes);
  AppendField(description, 32, &bytes);
  bytes.append(content);
  return bytes;
}

std::string ExtraBytesRecord() {
  constexpr uint8_t kFloat = 9;
  constexpr std::array<std::array<const char*, 2>, 4> kFields = {{{"NormalX", "of the surface"},
                                                                  {"NormalY", "of the surface"},
                                                                  {"NormalZ", "of the surface"},
                                                                  {"sigma", "metres"}}};
  constexpr std::size_t kNumbers =
      5 * 3 * sizeof(double);  // no data, least, most, scale, offset: none used
  std::string content;
  for (const auto& [name, description] : kFields) {
    AppendBytes(uint16_t{0}, &content);
    AppendBytes(kFloat, &content);
    AppendBytes(uint8_t{0}, &content);
    AppendField(name, 32, &content);
    content.append(4 + kNumbers, '\0');
    AppendField(description, 32, &content);
  }
  return Record("LASF_Spec", 4, "Extra Bytes", content);
}

// GeoTIFF 1.0: a projected CRS by its number, metres.
std::string GeoKeysRecord(int epsg, int epsg_of_heights) {
  constexpr uint16_t kModelType = 1024, kProjectedCrs = 3072, kLinearUnits = 3076,
                     kVerticalCrs = 4096, kVerticalUnits = 4099, kProjected = 1, kMetre = 9001;
  std::string content;
  std::vector<std::pair<uint16_t, uint16_t>> keys = {{kModelType, kProjected},
                                                     {kProjectedCrs, static_cast<uint16_t>(epsg)},
                                                     {kLinearUnits, kMetre}};
  if (epsg_of_heights > 0) keys.emplace_back(kVerticalCrs, static_cast<uint16_t>(epsg_of_heights));
  keys.emplace_back(kVerticalUnits, kMetre);
  for (const size_t number : {size_t{1}, size_t{1}, size_t{0}, keys.size()}) {
    AppendBytes(static_cast<uint16_t>(number), &content);
  }
  for (const auto& [key, value] : keys) {
    for (const uint16_t number : {key, uint16_t{0}, uint16_t{1}, value}) {
      AppendBytes(number, &content);
    }
  }
  return Record("LASF_Projection", 34735, "GeoTiff GeoKeyDirectoryTag", content);
}

// What a file says of where its points lie.
struct LasPlace {
  // Of a 1.2 file; 0: none, or one that GeoTIFF's keys cannot name.
  int epsg = 0, epsg_of_heights = 0;
  std::string wkt = {};  // of a 1.4 file, which takes no other: the CRS as OGC WKT
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  // coordinates are stored less this
};

// A file that is written point by point, as the ASPRS describes it: LAS Specification 1.2 (2008)
// and 1.4-R15 (2019); a block of points is in memory. Coordinates are stored in tenths of a
// millimetre, so they may be 214 km from the offset. A point has its grey as intensity and as
// colour, the number of its source (PointSource) as point source id, class 1 and, where it was
// derived, the flag "synthetic"; as extra bytes (floats) `NormalX`, `NormalY`, `NormalZ` and
// `sigma`, the standard deviation in metres.
class LasFile {
 public:
  LasFile(const std::string& path, LasVersion version, const LasPlace& place)
      : path_(path), version_(version), place_(place), file_(path) {
    file_.Add(Header() + Records());
  }

  // In the coordinates of the place. Throws DataError for one that is too far from the offset.
  void Add(const SurveyPoint& point) {
    const bool is_derived = point.source == PointSource::kFilled;
    const auto shade = static_cast<uint16_t>(257 * point.grey);
    AppendCoordinates(point.p);
    AppendBytes(shade, &block_);
    if (Is14(version_)) {
      AppendBytes(uint8_t{0x11}, &block_);  // the first return of one, in four bits each
      AppendBytes(is_derived ? kSynthetic14 : uint8_t{0}, &block_);
      AppendBytes(kUnclassified, &block_);
      AppendBytes(uint8_t{0}, &block_);   // of the user
      AppendBytes(uint16_t{0}, &block_);  // angle
    } else {
      AppendBytes(uint8_t{0x09}, &block_);  // the same in three bits each
      AppendBytes(static_cast<uint8_t>(kUnclassified | (is_derived ? kSynthetic12 : 0)), &block_);
      AppendBytes(uint16_t{0}, &block_);  // angle, and of the user
    }
    AppendBytes(static_cast<uint16_t>(point.source), &block_);
    if (Is14(version_)) AppendBytes(0.0, &block_);  // time: a point has been seen at several
    for (int colour = 0; colour < 3; ++colour) AppendBytes(shade, &block_);
    for (const double part : point.normal) AppendBytes(static_cast<float>(part), &block_);
    AppendBytes(static_cast<float>(point.sigma_m), &block_);
    ++count_;
    if (block_.size() >= kBlockBytes) Flush();
  }

  // To be called at the end: the header says how many points there are, and where.
  void Close() {
    Flush();
    file_.Overwrite(0, Header());
    file_.Close();
  }

 private:
  std::string Records() const {
    std::string records = ExtraBytesRecord();
    const bool has_keys = place_.epsg > 0 && place_.epsg <= std::numeric_limits<uint16_t>::max();
    if (!Is14(version_) && has_keys) records += GeoKeysRecord(place_.epsg, place_.epsg_of_heights);
    if (Is14(version_) && !place_.wkt.empty()) {
      records += Record("LASF_Projection", 2112, "OGC WKT", place_.wkt + '\0');
    }
    return records;
  }

  std::string Header() const {
    const bool is_14 = Is14(version_);
    const std::string records = Records();
    const uint32_t record_count = records.size() > ExtraBytesRecord().size() ? 2 : 1;
    std::string bytes = "LASF";
    AppendBytes(uint16_t{0}, &bytes);  // file source
    AppendBytes(is_14 ? kWktBit : uint16_t{0}, &bytes);
    bytes.append(16, '\0');  // project
    AppendBytes(uint8_t{1}, &bytes);
    AppendBytes(is_14 ? uint8_t{4} : uint8_t{2}, &bytes);
    AppendField("stereo cameras and IMU", 32, &bytes);
    AppendField(std::string("slcmap ") + kVersion, 32, &bytes);
    bytes.append(4, '\0');  // day and year: the same map gives the same bytes
    AppendBytes(HeaderBytes(version_), &bytes);
    AppendBytes(static_cast<uint32_t>(HeaderBytes(version_) + records.size()), &bytes);
    AppendBytes(record_count, &bytes);
    AppendBytes(is_14 ? uint8_t{7} : uint8_t{2}, &bytes);
    AppendBytes(PointBytes(version_), &bytes);
    // All points are the first return of one.
    const uint32_t legacy_count = is_14 ? 0 : static_cast<uint32_t>(count_);
    AppendBytes(legacy_count, &bytes);
    AppendBytes(legacy_count, &bytes);
    bytes.append(4 * sizeof(uint32_t), '\0');
    for (int axis = 0; axis < 3; ++axis) AppendBytes(kUnit_m, &bytes);
    for (const double offset_m : place_.offset_m) AppendBytes(offset_m, &bytes);
    for (int axis = 0; axis < 3; ++axis) {
      AppendBytes(box_.isEmpty() ? 0 : box_.max()[axis], &bytes);
      AppendBytes(box_.isEmpty() ? 0 : box_.min()[axis], &bytes);
    }
    if (!is_14) return bytes;
    bytes.append(8 + 8 + 4, '\0');  // no waves, no records behind the points
    AppendBytes(count_, &bytes);
    AppendBytes(count_, &bytes);
    bytes.append(14 * sizeof(uint64_t), '\0');
    return bytes;
  }

  void AppendCoordinates(const Eigen::Vector3d& p) {
    constexpr double kMost = std::numeric_limits<int32_t>::max();
    const Eigen::Vector3d units = ((p - place_.offset_m) / kUnit_m).array().round();
    if (!(units.cwiseAbs().maxCoeff() <= kMost)) {
      throw DataError(
          fmt::format("{}: found a point at {:.1f} {:.1f} {:.1f} m, expected at most {:.0f} m from "
                      "{:.1f} {:.1f} "
                      "{:.1f}: leave las out by --format",
                      path_, p.x(), p.y(), p.z(), kMost * kUnit_m, place_.offset_m.x(),
                      place_.offset_m.y(), place_.offset_m.z()));
    }
    for (const double unit : units) AppendBytes(static_cast<int32_t>(unit), &block_);
    box_.extend(place_.offset_m + kUnit_m * units);
  }

  void Flush() {
    file_.Add(block_);
    block_.clear();
  }

  std::string path_;
  LasVersion version_;
  LasPlace place_;
  FileWriter file_;
  std::string block_;
  uint64_t count_ = 0;
  Eigen::AlignedBox3d box_;  // of coordinates as they are stored
};

LasVersion ChooseVersion(const std::string& version, std::size_t points) {
  const bool fits = points <= std::numeric_limits<uint32_t>::max();
  if (!fits) spdlog::info("las: {} points are more than LAS 1.2 can count, written as 1.4", points);
  return fits && version == "1.2" ? LasVersion::k12 : LasVersion::k14;
}

}  // namespace

std::vector<std::string> WriteLas(const std::string& version, const std::string& folder,
                                  const MapResult& map, const Progress& progress) {
  std::size_t all = 0, done = 0;
  for (const PointSource source : kPointSources) all += CountPoints(map, source);
  const Georeference place = FindPlace(map.source);
  const std::string path = folder + "/cloud.las";
  LasFile file(path, ChooseVersion(version, all),
               {EpsgCode(place.crs), EpsgCodeOfHeights(place.crs), CrsWkt(place),
                place.origin_m.array().round()});  // as people read them
  for (const PointSource source : kPointSources) {
    for (std::size_t i = 0; i < CountPoints(map, source); ++i, ++done) {
      if (done % kPointsToReport == 0) {
        progress.ReportOrStop(static_cast<double>(done) / static_cast<double>(all));
      }
      SurveyPoint point = PointAt(map, source, i);
      point.p = place * point.p;
      point.normal = TurnedNormal(place, point.normal);
      file.Add(point);
    }
  }
  file.Close();
  return {path};
}

}  // namespace slcmap::exporting
