// What is written and drawn around the plans and sections of a map.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "export/plan/drawing.h"
#include "export/plan/plan_options.h"
#include "export/plan/sheet_size.h"
#include "mapping/map.h"

namespace slcmap {

struct SheetWords {
  std::string title;   // "Storey 0"
  std::string kind;    // "Floor plan"
  std::string number;  // of the sheet, after that of the drawing: "S0"
  // Where a section is; without, the arrow to the north is drawn.
  std::vector<std::string> place = {};
};

class TitleBlock {
 public:
  TitleBlock(const MapResult& map, const PlanOptions& options);

  const std::string& project() const { return project_; }  // "" where it is not known

  // Frames, texts, legend, scale bar and arrow: everything but the plan itself, in millimetres.
  Drawing Draw(const SheetFormat& format, const SheetWords& words, const Drawing& legend) const;

 private:
  std::vector<std::string> Notes(const SheetFormat& format, const SheetWords& words) const;

  std::string project_, date_, number_, map_id_, offset_;
  bool is_complete_, is_far_, in_mm_;
  std::optional<double> north_deg_;
};

}  // namespace slcmap
