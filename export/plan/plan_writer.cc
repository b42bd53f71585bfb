#include <cairo/cairo-pdf.h>
#include <cairo/cairo.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <memory>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/plan/sheet.h"
#include "export/scene/formats.h"

namespace slcmap::inline exporting {
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
        size.x(), size.y(), EscapeMarkup(FormatTitle(sheet_)));
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

std::string MakeSvg(const Sheet& sheet) { return SvgSheet(sheet).Text(); }

std::vector<std::string> WriteSvgPlans(const PlanOptions& options, const std::string& folder,
                                       const MapResult& map, const Progress&) {
  std::vector<std::string> paths;
  MakeFolder(folder + "/plan");
  std::vector<Sheet> sheets = MakeSheets(map, options);
  Append(MakeSectionSheets(map, options), &sheets);
  for (const Sheet& sheet : sheets) {
    paths.push_back(fmt::format("{}/plan/{}.svg", folder, sheet.name));
    WriteFile(paths.back(), MakeSvg(sheet));
  }
  return paths;
}

namespace {

constexpr double kPointsOfMm = 72 / 25.4;

cairo_status_t AppendBytes(void* bytes, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

// Draws in millimetres; cairo's y points down.
class Page {
 public:
  Page(cairo_t* cairo, double height_mm) : cairo_(cairo), height_mm_(height_mm) {}

  void Draw(const Drawing& drawing) const {
    cairo_set_fill_rule(cairo_, CAIRO_FILL_RULE_EVEN_ODD);
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
    for (const DrawnArea& area : drawing.areas) Draw(area);
    for (const DrawnPath& path : drawing.paths) Draw(path);
    for (const DrawnText& text : drawing.texts) Draw(text);
  }

 private:
  void Trace(const PlanPoints& points) const {
    for (const Vector2d& p : points) cairo_line_to(cairo_, p.x(), height_mm_ - p.y());
  }

  void Draw(const DrawnArea& area) const {
    const double grey = kFillStyles[static_cast<size_t>(area.fill)].grey;
    cairo_set_source_rgb(cairo_, grey, grey, grey);
    Trace(area.polygon.outline);
    cairo_close_path(cairo_);
    for (const PlanPoints& hole : area.polygon.holes) {
      cairo_new_sub_path(cairo_);
      Trace(hole);
      cairo_close_path(cairo_);
    }
    cairo_fill(cairo_);
  }

  void Draw(const DrawnPath& path) const {
    const PenStyle& style = kPenStyles[static_cast<size_t>(path.pen)];
    const double dashes[] = {style.dash_mm, style.gap_mm};
    const bool is_dashed = style.dash_mm > 0;
    cairo_set_source_rgb(cairo_, 0, 0, 0);
    cairo_set_line_width(cairo_, style.width_mm);
    cairo_set_line_cap(cairo_, is_dashed ? CAIRO_LINE_CAP_BUTT : CAIRO_LINE_CAP_ROUND);
    cairo_set_dash(cairo_, dashes, is_dashed ? 2 : 0, 0);
    Trace(path.points);
    cairo_stroke(cairo_);
  }

  void Draw(const DrawnText& text) const {
    cairo_save(cairo_);
    cairo_select_font_face(cairo_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo_, text.height / kCapitalOfFont);
    cairo_translate(cairo_, text.position.x(), height_mm_ - text.position.y());
    cairo_rotate(cairo_, -text.angle_rad);
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_, text.text.c_str(), &extents);
    cairo_move_to(cairo_, text.align == Align::kLeft ? 0 : -0.5 * extents.x_advance, 0);
    cairo_set_source_rgb(cairo_, 0, 0, 0);
    cairo_show_text(cairo_, text.text.c_str());
    cairo_restore(cairo_);
  }

  cairo_t* cairo_;
  double height_mm_;
};

void DrawPage(cairo_surface_t* surface, const Sheet& sheet) {
  cairo_pdf_surface_set_size(surface, sheet.size_mm.x() * kPointsOfMm,
                             sheet.size_mm.y() * kPointsOfMm);
  const Context cairo(cairo_create(surface), cairo_destroy);
  cairo_scale(cairo.get(), kPointsOfMm, kPointsOfMm);
  Page(cairo.get(), sheet.size_mm.y()).Draw(sheet.drawing);
  cairo_show_page(cairo.get());
}

std::string MakePdf(const std::string& path, const std::vector<Sheet>& sheets) {
  std::string bytes;
  const Vector2d size = sheets.front().size_mm * kPointsOfMm;
  const Surface surface(
      cairo_pdf_surface_create_for_stream(AppendBytes, &bytes, size.x(), size.y()),
      cairo_surface_destroy);
  // Without it cairo writes the time, and the same map would not give the same bytes.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, nullptr);
  const std::string title =
      sheets.size() == 1 ? FormatTitle(sheets.front()) : sheets.front().project + ", floor plans";
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
  for (const Sheet& sheet : sheets) DrawPage(surface.get(), sheet);
  cairo_surface_finish(surface.get());
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status == CAIRO_STATUS_SUCCESS) return bytes;
  throw OutputError(fmt::format("{}: cannot be written: {}", path, cairo_status_to_string(status)));
}

}  // namespace

std::vector<std::string> WritePdfPlans(const PlanOptions& options, const std::string& folder,
                                       const MapResult& map, const Progress&) {
  const std::string path = folder + "/plan.pdf";
  WriteFile(path, MakePdf(path, MakeSheets(map, options)));
  std::vector<std::string> paths = {path};
  for (const Sheet& sheet : MakeSectionSheets(map, options)) {
    if (paths.size() == 1) MakeFolder(folder + "/plan");
    paths.push_back(fmt::format("{}/plan/{}.pdf", folder, sheet.name));
    WriteFile(paths.back(), MakePdf(paths.back(), {sheet}));
  }
  return paths;
}

}  // namespace slcmap::exporting
