// Plans, sections and elevations as SVG and PDF files, and grids of what is occupied, for robots.
#pragma once

#include "export/plan/sheet.h"
#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

// A sheet as an SVG file in millimetres, with a group a pen and text as text; browsers print it in
// its size.
std::string MakeSvg(const Sheet& sheet);

// Writes plan/NAME.svg for each sheet of plans, sections and elevations.
class SvgPlanWriter : public MapWriter {
 public:
  explicit SvgPlanWriter(const PlanOptions& options) : options_(options) {}
  std::string Format() const override { return "svg"; }
  std::vector<std::string> Names() const override { return {"plan"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  PlanOptions options_;
};

// Plans as a PDF file.

// Writes plan.pdf with a page for each sheet, in its size, by cairo, and plan/NAME.pdf for each
// section and elevation.
class PdfPlanWriter : public MapWriter {
 public:
  explicit PdfPlanWriter(const PlanOptions& options) : options_(options) {}
  std::string Format() const override { return "pdf"; }
  std::vector<std::string> Names() const override { return {"plan.pdf", "plan"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  PlanOptions options_;
};

// Writes grid/storey_N.pgm and storey_N.yaml for each storey, as ROS' map_server reads them: a cell
// is occupied (0) where a voxel of the occupancy map is within a band of heights over the storey's
// floor, else free (254) where one is, else unknown (205). Row 0 is at the top, the largest y. Of a
// map without storeys one, `grid/no_storey`, over its lowest voxel. Throws DataError for a map that
// is too large.
class GridWriter : public MapWriter {
 public:
  explicit GridWriter(const GridOptions& options = {}) : options_(options) {}
  std::string Format() const override { return "grid"; }
  std::vector<std::string> Names() const override { return {"grid"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  GridOptions options_;
};

}  // namespace slcmap::exporting
