// What explains a plan on its sheet: title block, legend, arrow to the north, scale bar.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "export/plan/drawing.h"
#include "export/plan/sheet.h"
#include "export/scene/options.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// Samples of walls and openings with their names, in two columns, 110 mm by 23 mm. Millimetres from
// its lower left corner.
Drawing Legend();

// The same of what sections show.
Drawing SectionLegend();

// An arrow and what it points to, some 14 mm high, from its lower left corner: the compass' north,
// that many degrees clockwise from up, known `by` that, or where it is not known, up: along the
// building's walls, or along what `by` says.
Drawing NorthArrow(const std::optional<double>& north_deg, const std::string& by);

// Metres at a scale, some 50 mm long.
Drawing ScaleBar(int scale);

// What is written and drawn around the plans and sections of a map.

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

  std::string project_, date_, number_, map_id_, place_;
  bool is_complete_, in_mm_;
  std::optional<double> north_deg_;
  std::string north_by_;
};

}  // namespace slcmap::exporting
