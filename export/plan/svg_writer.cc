#include "export/plan/svg_writer.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "data/file.h"
#include "data/markup.h"
#include "export/section/section_sheet.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

std::string Grey(double grey) {
  const int value = static_cast<int>(std::lround(255 * grey));
  return fmt::format("#{0:02x}{0:02x}{0:02x}", value);
}

// SVG's y points down.
class SvgSheet {
 public:
  explicit SvgSheet(const Sheet& sheet) : sheet_(sheet) {}

  std::string Text() const {
    const Vector2d& size = sheet_.size_mm;
    std::string text = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"{0}mm\" "
        "height=\"{1}mm\" viewBox=\"0 0 {0} {1}\">\n<title>{2}</title>\n"
        "<style>@page {{ size: {0}mm {1}mm; margin: 0 }}</style>\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
        size.x(), size.y(), EscapeMarkup(TitleOf(sheet_)));
    for (size_t fill = 0; fill < kFillStyles.size(); ++fill) text += Areas(fill);
    for (size_t pen = 0; pen < kPenStyles.size(); ++pen) text += Paths(pen);
    return text + Texts() + "</svg>\n";
  }

 private:
  std::string Point(const Vector2d& p) const {
    return fmt::format("{:.4f} {:.4f}", p.x(), sheet_.size_mm.y() - p.y());
  }

  std::string Path(const PlanPoints& points, const char* end) const {
    std::string path;
    for (const Vector2d& point : points) {
      path += path.empty() ? "M" : "L";
      path += Point(point);
    }
    return path + end;
  }

  std::string Areas(size_t fill) const {
    std::string group = fmt::format("<g id=\"{}\" fill=\"{}\" fill-rule=\"evenodd\">\n",
                                    kFillStyles[fill].name, Grey(kFillStyles[fill].grey));
    for (const DrawnArea& area : sheet_.drawing.areas) {
      if (static_cast<size_t>(area.fill) != fill) continue;
      std::string path = Path(area.polygon.outline, "Z");
      for (const PlanPoints& hole : area.polygon.holes) path += Path(hole, "Z");
      group += fmt::format("<path d=\"{}\"/>\n", path);
    }
    return group + "</g>\n";
  }

  std::string Paths(size_t pen) const {
    const PenStyle& style = kPenStyles[pen];
    const std::string dashes =
        style.dash_mm > 0 ? fmt::format(" stroke-dasharray=\"{} {}\"", style.dash_mm, style.gap_mm)
                          : "";
    std::string group = fmt::format(
        "<g id=\"{}\" fill=\"none\" stroke=\"#000000\" stroke-width=\"{}\" "
        "stroke-linecap=\"{}\" stroke-linejoin=\"round\"{}>\n",
        style.name, style.width_mm, dashes.empty() ? "round" : "butt", dashes);
    for (const DrawnPath& path : sheet_.drawing.paths) {
      if (static_cast<size_t>(path.pen) != pen) continue;
      group += fmt::format("<path d=\"{}\"/>\n", Path(path.points, ""));
    }
    return group + "</g>\n";
  }

  std::string Texts() const {
    std::string group =
        "<g id=\"texts\" fill=\"#000000\" "
        "font-family=\"DejaVu Sans, Liberation Sans, Arial, sans-serif\">\n";
    for (const DrawnText& text : sheet_.drawing.texts) {
      const std::string turn =
          text.angle_rad == 0 ? "" : fmt::format(" rotate({:.4f})", -text.angle_rad * 180 / M_PI);
      group += fmt::format(
          "<text transform=\"translate({}){}\" font-size=\"{:.4f}\" text-anchor=\"{}\">{}</text>\n",
          Point(text.position), turn, text.height / kCapitalOfFont,
          text.align == Align::kLeft ? "start" : "middle", EscapeMarkup(text.text));
    }
    return group + "</g>\n";
  }

  const Sheet& sheet_;
};

}  // namespace

std::string SvgOf(const Sheet& sheet) { return SvgSheet(sheet).Text(); }

std::vector<std::string> SvgPlanWriter::Write(const std::string& folder, const MapResult& map,
                                              const Progress& progress) const {
  progress.ReportOrStop(0);
  std::vector<std::string> paths;
  MakeFolder(folder + "/plan");
  std::vector<Sheet> sheets = MakeSheets(map, options_);
  Append(MakeSectionSheets(map, options_), &sheets);
  for (const Sheet& sheet : sheets) {
    paths.push_back(fmt::format("{}/plan/{}.svg", folder, sheet.name));
    WriteFile(paths.back(), SvgOf(sheet));
  }
  progress.ReportOrStop(1);
  return paths;
}

}  // namespace slcmap
