#include "export/section/section_sheet.h"

#include "export/plan/legend.h"
#include "export/plan/title_block.h"
#include "export/section/section_drawing.h"

namespace slcmap {

std::vector<Sheet> MakeSectionSheets(const MapResult& map, const PlanOptions& options) {
  const TitleBlock block(map, options);
  std::vector<Sheet> sheets;
  for (const SectionDrawing& section : MakeSections(map, options)) {
    const SheetFormat& format = section.format;
    const PlanTextSizes sizes(format.scale, options.millimetres);
    Drawing in_metres = section.shape;
    Append(section.marks, &in_metres.paths);
    Append(section.texts, &in_metres.texts);
    for (const Dimension& dimension : section.dimensions) {
      in_metres.Add(DrawDimension(dimension, sizes));
    }
    const double mm_of_metre = 1000.0 / format.scale;
    const SectionView& view = section.view;
    Sheet sheet = {
        view.name, view.title, block.project(), format.size_mm,
        Placed(in_metres, mm_of_metre, format.Middle_mm() - mm_of_metre * section.extent.center())};
    sheet.drawing.Add(block.Draw(format,
                                 {view.title,
                                  view.mark.empty() ? "Elevation" : "Section",
                                  view.name,
                                  {view.place, "heights over the lowest floor"}},
                                 SectionLegend()));
    sheets.push_back(std::move(sheet));
  }
  return sheets;
}

}  // namespace slcmap
