// GeoPackage 1.2: an SQLite database with tables of features.
#include <spdlog/fmt/fmt.h>

#include <array>
#include <memory>

#include "data/bag/sqlite.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "export/scene/formats.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kLocalSrs = 100000;  // of a frame that has no number: beyond those of EPSG

// The tables that all GeoPackages have, and the systems that the standard wants in them.
constexpr const char* kGeoPackageTables = R"(
CREATE TABLE gpkg_spatial_ref_sys(srs_name TEXT NOT NULL,srs_id INTEGER NOT NULL PRIMARY KEY,
  organization TEXT NOT NULL,organization_coordsys_id INTEGER NOT NULL,definition TEXT NOT NULL,
  description TEXT);
CREATE TABLE gpkg_contents(table_name TEXT NOT NULL PRIMARY KEY,data_type TEXT NOT NULL,
  identifier TEXT UNIQUE,description TEXT DEFAULT '',last_change DATETIME NOT NULL,min_x DOUBLE,
  min_y DOUBLE,max_x DOUBLE,max_y DOUBLE,srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY(srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns(table_name TEXT NOT NULL,column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL,srs_id INTEGER NOT NULL,z TINYINT NOT NULL,m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY(table_name,column_name),
  CONSTRAINT uk_gc_table_name UNIQUE(table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY(table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY(srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_extensions(table_name TEXT,column_name TEXT,extension_name TEXT NOT NULL,
  definition TEXT NOT NULL,scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE(table_name,column_name,extension_name));
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined cartesian SRS',-1,'NONE',-1,'undefined',NULL),
  ('Undefined geographic SRS',0,'NONE',0,'undefined',NULL),
  ('WGS 84',4326,'EPSG',4326,'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,'
   ||'298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],'
   ||'AUTHORITY["EPSG","4326"]]',NULL);
)";

// The index of a layer's extents, and the triggers by which those who edit it keep that; {0}: the
// layer.
constexpr const char* kIndexTable =
    "CREATE VIRTUAL TABLE rtree_{0}_geom USING rtree(id,minx,maxx,miny,maxy)";
constexpr const char* kIndexTriggers = R"(
INSERT INTO gpkg_extensions VALUES('{0}','geom','gpkg_rtree_index',
  'http://www.geopackage.org/spec120/#extension_rtree','write-only');
CREATE TRIGGER rtree_{0}_geom_insert AFTER INSERT ON {0}
  WHEN (new.geom NOT NULL AND NOT ST_IsEmpty(NEW.geom)) BEGIN {1} END;
CREATE TRIGGER rtree_{0}_geom_update1 AFTER UPDATE OF geom ON {0}
  WHEN OLD.fid=NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom)) BEGIN {1} END;
CREATE TRIGGER rtree_{0}_geom_update2 AFTER UPDATE OF geom ON {0}
  WHEN OLD.fid=NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
  BEGIN DELETE FROM rtree_{0}_geom WHERE id=OLD.fid; END;
CREATE TRIGGER rtree_{0}_geom_update3 AFTER UPDATE ON {0}
  WHEN OLD.fid!=NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
  BEGIN DELETE FROM rtree_{0}_geom WHERE id=OLD.fid; {1} END;
CREATE TRIGGER rtree_{0}_geom_update4 AFTER UPDATE ON {0}
  WHEN OLD.fid!=NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
  BEGIN DELETE FROM rtree_{0}_geom WHERE id IN (OLD.fid,NEW.fid); END;
CREATE TRIGGER rtree_{0}_geom_delete AFTER DELETE ON {0}
  WHEN old.geom NOT NULL BEGIN DELETE FROM rtree_{0}_geom WHERE id=OLD.fid; END;
)";
constexpr const char* kIndexOne =
    "INSERT OR REPLACE INTO rtree_{0}_geom VALUES(NEW.fid,ST_MinX(NEW.geom),ST_MaxX(NEW.geom),"
    "ST_MinY(NEW.geom),ST_MaxY(NEW.geom));";

// Well-known binary, lowest byte first.
class Wkb {
 public:
  enum Type : uint32_t { kLine = 2, kPolygon = 3, kMultiPolygon = 6, kLineInSpace = 1002 };

  void Begin(Type type, std::size_t parts) {
    AppendBytes(uint8_t{1}, &bytes_);
    AppendBytes(static_cast<uint32_t>(type), &bytes_);
    AddCount(parts);
  }
  void AddPoint(const Eigen::Ref<const Eigen::VectorXd>& p) {
    for (const double value : p) AppendBytes(value, &bytes_);
  }
  void AddRing(const PlanPoints& ring) {
    AddCount(ring.size() + 1);
    for (const Vector2d& p : ring) AddPoint(p);
    AddPoint(ring.front());
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void AddCount(std::size_t count) { AppendBytes(static_cast<uint32_t>(count), &bytes_); }

  std::string bytes_;
};

std::string MakeWkb(const StoreyFeature& feature, FeatureGeometry geometry) {
  Wkb wkb;
  if (geometry == FeatureGeometry::kAreas) {
    wkb.Begin(Wkb::kMultiPolygon, feature.areas.size());
    for (const Polygon& area : feature.areas) {
      wkb.Begin(Wkb::kPolygon, 1 + area.holes.size());
      wkb.AddRing(area.outline);
      for (const PlanPoints& hole : area.holes) wkb.AddRing(hole);
    }
    return wkb.bytes();
  }
  const bool in_space = geometry == FeatureGeometry::kLineInSpace;
  wkb.Begin(in_space ? Wkb::kLineInSpace : Wkb::kLine, feature.line.size());
  for (const Vector3d& p : feature.line) wkb.AddPoint(p.head(in_space ? 3 : 2));
  return wkb.bytes();
}

// A geometry as GeoPackage has it: with its extent before it.
std::string MakeGeometry(const StoreyFeature& feature, FeatureGeometry geometry, int srs) {
  constexpr uint8_t kVersion1 = 0, kLowestFirstWithExtent = 0b11;
  const Eigen::AlignedBox2d extent = ComputeExtent(feature);
  std::string bytes = "GP";
  AppendBytes(kVersion1, &bytes);
  AppendBytes(kLowestFirstWithExtent, &bytes);
  AppendBytes(srs, &bytes);
  for (int axis = 0; axis < 2; ++axis) {
    AppendBytes(extent.min()[axis], &bytes);
    AppendBytes(extent.max()[axis], &bytes);
  }
  return bytes + MakeWkb(feature, geometry);
}

const char* SqlType(ColumnType type) {
  return std::array{"BOOLEAN", "INTEGER", "DOUBLE", "TEXT"}[static_cast<std::size_t>(type)];
}

const char* GeometryName(FeatureGeometry geometry) {
  return geometry == FeatureGeometry::kAreas ? "MULTIPOLYGON" : "LINESTRING";
}

class GeoPackage {
 public:
  GeoPackage(const std::string& path, const Georeference& place) : path_(path) {
    sqlite3* db = nullptr;
    const int status = sqlite3_open(path.c_str(), &db);
    db_.reset(db);
    Require(status);
    // 'GPKG' and 1.2; a file that fails is thrown away, so no journal is needed.
    Execute(
        "PRAGMA application_id=1196444487;PRAGMA user_version=10200;PRAGMA journal_mode=OFF;"
        "PRAGMA synchronous=OFF;BEGIN");
    Execute(kGeoPackageTables);
    AddCrs(place);
  }

  void AddLayer(const FeatureLayer& layer) {
    Execute(CreateStatement(layer));
    Execute(fmt::format(kIndexTable, layer.name));
    Eigen::AlignedBox2d extent;
    {
      const SqliteHandle<sqlite3_stmt> insert = Prepare(InsertStatement(layer)),
                                       index =
                                           Prepare(fmt::format("INSERT INTO rtree_{}_geom VALUES("
                                                               "last_insert_rowid(),?,?,?,?)",
                                                               layer.name));
      layer.visit([&](const StoreyFeature& feature) {
        AddFeature(layer, feature, insert.get());
        const Eigen::AlignedBox2d own = ComputeExtent(feature);
        AddExtent(own, index.get());
        extent.extend(own);
      });
    }
    // After the rows: SQLite alone has no functions of geometries.
    Execute(fmt::format(kIndexTriggers, layer.name, fmt::format(kIndexOne, layer.name)));
    Register(layer, extent);
  }

  void Close() {
    Execute("COMMIT");
    const int status = sqlite3_close(db_.release());
    if (status != SQLITE_OK) Fail(sqlite3_errstr(status));
  }

 private:
  [[noreturn]] void Fail(const char* what) const {
    throw OutputError(fmt::format("{}: cannot be written: {}", path_, what));
  }
  void Require(int status) const {
    if (status != SQLITE_OK) Fail(sqlite3_errmsg(db_.get()));
  }
  void Execute(const std::string& query) {
    Require(sqlite3_exec(db_.get(), query.c_str(), nullptr, nullptr, nullptr));
  }
  SqliteHandle<sqlite3_stmt> Prepare(const std::string& query) {
    sqlite3_stmt* statement = nullptr;
    Require(sqlite3_prepare_v2(db_.get(), query.c_str(), -1, &statement, nullptr));
    return SqliteHandle<sqlite3_stmt>(statement);
  }

  void AddCrs(const Georeference& place) {
    const int epsg = EpsgCode(place.crs);
    srs_ = epsg > 0 ? epsg : kLocalSrs;
    const std::unique_ptr<char, decltype(&sqlite3_free)> query(
        sqlite3_mprintf("INSERT OR IGNORE INTO gpkg_spatial_ref_sys VALUES(%Q,%d,%Q,%d,%Q,NULL)",
                        place.crs.empty() ? "building" : place.crs.c_str(), srs_,
                        epsg > 0 ? "EPSG" : "NONE", srs_, CrsWkt(place, false).c_str()),
        &sqlite3_free);
    Execute(query.get());
  }

  static std::string CreateStatement(const FeatureLayer& layer) {
    std::string columns;
    for (const auto& [name, type] : layer.columns) {
      columns += fmt::format(",{} {}", name, SqlType(type));
    }
    return fmt::format(
        "CREATE TABLE {}(fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,geom {},storey INTEGER{})",
        layer.name, GeometryName(layer.geometry), columns);
  }

  static std::string InsertStatement(const FeatureLayer& layer) {
    std::string names, places;
    for (const auto& column : layer.columns) {
      names += fmt::format(",{}", column.name);
      places += ",?";
    }
    return fmt::format("INSERT INTO {}(geom,storey{}) VALUES(?,?{})", layer.name, names, places);
  }

  void AddFeature(const FeatureLayer& layer, const StoreyFeature& feature, sqlite3_stmt* insert) {
    const std::string geometry = MakeGeometry(feature, layer.geometry, srs_);
    Require(sqlite3_bind_blob64(insert, 1, geometry.data(), geometry.size(), SQLITE_TRANSIENT));
    Bind(feature.storey ? Attribute(*feature.storey) : Attribute(), 2, insert);
    for (std::size_t i = 0; i < feature.attributes.size(); ++i) {
      Bind(feature.attributes[i], static_cast<int>(i) + 3, insert);
    }
    sqlite3_step(insert);
    Require(sqlite3_reset(insert));
  }

  void AddExtent(const Eigen::AlignedBox2d& box, sqlite3_stmt* insert) const {
    for (int axis = 0; axis < 2; ++axis) {
      Bind(box.min()[axis], 2 * axis + 1, insert);
      Bind(box.max()[axis], 2 * axis + 2, insert);
    }
    sqlite3_step(insert);
    Require(sqlite3_reset(insert));
  }

  void Bind(const Attribute& attribute, int at, sqlite3_stmt* insert) const {
    int status = SQLITE_OK;
    if (const auto* truth = std::get_if<bool>(&attribute)) {
      status = sqlite3_bind_int(insert, at, *truth ? 1 : 0);
    } else if (const auto* number = std::get_if<int64_t>(&attribute)) {
      status = sqlite3_bind_int64(insert, at, *number);
    } else if (const auto* real = std::get_if<double>(&attribute)) {
      status = sqlite3_bind_double(insert, at, *real);
    } else if (const auto* text = std::get_if<std::string>(&attribute)) {
      status = sqlite3_bind_text(insert, at, text->c_str(), -1, SQLITE_TRANSIENT);
    } else {
      status = sqlite3_bind_null(insert, at);
    }
    Require(status);
  }

  // Readers find a layer by these two.
  void Register(const FeatureLayer& layer, const Eigen::AlignedBox2d& extent) {
    const auto number = [&](double value) {
      return extent.isEmpty() ? std::string("NULL") : fmt::format("{}", value);
    };
    // No stamp of now: the same map gives the same bytes.
    Execute(fmt::format(
        "INSERT INTO gpkg_contents VALUES('{0}','features','{0}','','1970-01-01T00:00:00.000Z',"
        "{1},{2},{3},{4},{5})",
        layer.name, number(extent.min().x()), number(extent.min().y()), number(extent.max().x()),
        number(extent.max().y()), srs_));
    Execute(fmt::format("INSERT INTO gpkg_geometry_columns VALUES('{}','geom','{}',{},{},0)",
                        layer.name, GeometryName(layer.geometry), srs_,
                        layer.geometry == FeatureGeometry::kLineInSpace ? 1 : 0));
  }

  std::string path_;
  SqliteHandle<sqlite3> db_;
  int srs_ = kLocalSrs;
};

}  // namespace

std::vector<std::string> WriteGeoPackage(const std::string& folder, const MapResult& map,
                                         const Progress&) {
  const std::string path = folder + "/plan.gpkg";
  GeoPackage file(path, FindPlace(map.source));
  for (const FeatureLayer& layer : MakeFeatureLayers(map)) file.AddLayer(layer);
  file.Close();
  return {path};
}

}  // namespace slcmap::exporting
