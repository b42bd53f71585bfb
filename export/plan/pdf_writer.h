// Plans as a PDF file.
#pragma once

#include "export/map_writer.h"
#include "export/plan/plan_options.h"

namespace slcmap {

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

}  // namespace slcmap
