#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "apps/compare/comparison.h"
#include "apps/compare/page_plots.h"
#include "data/io/file.h"

namespace slcmap::inline evaluation {
namespace {

// What bars are drawn of, where it was measured.
constexpr std::array<const char*, 5> kPlotted = {"ape_final_m", "edge_thickness_mm",
                                                 "edge_thickness_beyond_mm",
                                                 "line_precision_5cm_percent", "cpu_ms_a_pair"};

constexpr char kStyle[] = R"(
:root { color-scheme: light dark; --ink: #1d2530; --soft: #5c6773; --page: #f6f7f8; --card: #fff;
  --rule: #d9dee3; --paper: #fff; --best: #e3f1e8; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e8ec; --soft: #9aa5b1; --page: #14181d;
  --card: #1d232a; --rule: #333c46; --paper: #f4f4f2; --best: #1f3d2d; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.2rem 4rem; max-width: 1180px; background: var(--page);
  color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; margin: 0; } h2 { font-size: 1.35rem; margin: 2.6rem 0 .3rem; }
h3 { font-size: 1rem; margin: 1.6rem 0 .5rem; } p { margin: .3rem 0; }
.soft, .soft li { color: var(--soft); } code { font-size: .9em; overflow-wrap: anywhere; }
.cards { display: grid; gap: 14px; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); }
.wide { grid-template-columns: repeat(auto-fill, minmax(min(480px, 100%), 1fr)); }
figure { margin: 0; background: var(--card); border: 1px solid var(--rule); border-radius: 8px;
  padding: 10px 12px; }
figcaption { font-weight: 600; font-size: .92rem; margin-bottom: 4px; }
figcaption span { font-weight: 400; color: var(--soft); }
svg { width: 100%; height: auto; display: block; } figcaption a { float: right; font-weight: 400; }
.paper svg { background: var(--paper); border-radius: 4px; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 4px 12px; text-align: right; border-bottom: 1px solid var(--rule);
  white-space: nowrap; font-size: .9rem; vertical-align: bottom; }
th { white-space: normal; max-width: 8rem; line-height: 1.25; }
th:first-child, td:first-child { text-align: left; } th { font-weight: 600; }
th small, td small {
  color: var(--soft); font-weight: 400; } td.best { background: var(--best); font-weight: 600; }
.key i { display: inline-block; width: 11px; height: 11px; border-radius: 2px; margin: 0 5px 0 14px; }
ul { margin: .3rem 0; padding-left: 1.2rem; }
)";

// A plot as a file of its own, in light colours, as an address that holds it.
std::string EncodeAsUrl(std::string plot) {
  const std::string style =
      std::string("<style>:root { --ink: #1d2530; --soft: #5c6773; --rule: #d9dee3; } ") +
      kPlotStyle + "</style><rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>";
  plot.insert(plot.find('>') + 1, style);
  plot.insert(plot.find(' '), " xmlns=\"http://www.w3.org/2000/svg\"");
  std::string address = "data:image/svg+xml,";
  for (const char c : plot) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '.';
    address += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<uint8_t>(c));
  }
  return address;
}

// The name of a file for a caption, without its markup: "paths-from-above".
std::string MakeFileName(const std::string& caption) {
  std::string name;
  for (const char c : caption.substr(0, caption.find('<'))) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c));
    if (is_plain) name += c;
    if (!is_plain && !name.empty() && name.back() != '-') name += '-';
  }
  return name.empty() || name.back() != '-' ? name : name.substr(0, name.size() - 1);
}

std::string Figure(const std::string& caption, const std::string& plot, const char* kind = "") {
  if (plot.empty()) return "";
  return fmt::format(
      "<figure class=\"{}\"><figcaption><a download=\"{}.svg\" href=\"{}\">save SVG</a>{}"
      "</figcaption>{}</figure>\n",
      kind, MakeFileName(caption), EncodeAsUrl(plot), caption, plot);
}

std::string Key(const SequenceResult& sequence) {
  std::string html = "<p class=\"key\">";
  for (size_t i = 0; i < sequence.methods.size(); ++i) {
    html += fmt::format("<i style=\"background:{}\"></i>{}", MethodColour(sequence, i),
                        EscapeMarkup(sequence.methods[i].name));
  }
  if (sequence.true_poses) html += "<i style=\"background:#bbb\"></i>truth";
  return html + "</p>\n";
}

std::string Bars(const SequenceResult& sequence) {
  std::string html;
  for (const char* key : kPlotted) {
    const FigureInfo& figure = FindFigure(key);
    if (sequence.Of(figure).empty()) continue;
    const auto floor = sequence.with_true_poses.find(key);
    const std::string caption = fmt::format("{} <span>[{}], {} is better</span>", figure.label,
                                            figure.unit, figure.less_is_better ? "less" : "more");
    html += Figure(caption,
                   BarPlot(sequence, figure,
                           floor == sequence.with_true_poses.end() ? nullptr : &floor->second));
  }
  return html.empty() ? "" : "<div class=\"cards\">" + html + "</div>\n";
}

// In words, what the spread bears of the figures that bars show.
std::string Orders(const SequenceResult& sequence) {
  std::string html;
  for (const char* key : kPlotted) {
    const FigureInfo& figure = FindFigure(key);
    const std::vector<Ranked> methods = sequence.Of(figure);
    if (methods.size() < 2) continue;
    html += fmt::format("<li><b>{}</b>: {}.</li>\n", figure.label,
                        EscapeMarkup(OrderInWords(methods, figure.less_is_better)));
  }
  return html.empty() ? "" : "<h3>Which order the spread bears</h3><ul>" + html + "</ul>\n";
}

std::string Cell(const SequenceResult& sequence, const MethodResult& method,
                 const FigureInfo& figure) {
  const Spread spread = ComputeSpread(method.Values(figure.key));
  if (spread.count == 0) return "<td>-</td>";
  const std::vector<Ranked> all = sequence.Of(figure);
  const auto best = FindBestMethod(all, figure.less_is_better);
  std::string html = best && all[*best].name == method.name ? "<td class=\"best\">" : "<td>";
  html += fmt::format("{:.{}f}", spread.mean, figure.digits);
  if (spread.count > 1) {
    html += fmt::format(" <small>&plusmn; {:.{}f}</small>", spread.deviation, figure.digits);
  }
  return html + "</td>";
}

std::string Table(const SequenceResult& sequence, const char* group) {
  const std::vector<FigureInfo> figures = SelectFigures(sequence, group);
  if (figures.empty()) return "";
  std::string html = std::string("<h3>") + group + "</h3><div class=\"table\"><table><tr><th></th>";
  for (const FigureInfo& figure : figures) {
    html += fmt::format("<th title=\"{}\">{} <small>{}</small></th>", EscapeMarkup(figure.meaning),
                        figure.label, figure.unit);
  }
  html += "</tr>\n";
  for (const MethodResult& method : sequence.methods) {
    html += "<tr><td>" + EscapeMarkup(method.name) + "</td>";
    for (const FigureInfo& figure : figures) html += Cell(sequence, method, figure);
    html += "</tr>\n";
  }
  const bool has_floor = std::any_of(figures.begin(), figures.end(), [&](const FigureInfo& f) {
    return sequence.with_true_poses.contains(f.key);
  });
  if (has_floor) {
    html += "<tr><td><small>with true poses</small></td>";
    for (const FigureInfo& figure : figures) {
      const auto value = sequence.with_true_poses.find(figure.key);
      html += value == sequence.with_true_poses.end()
                  ? "<td></td>"
                  : fmt::format("<td><small>{:.{}f}</small></td>", value->second, figure.digits);
    }
    html += "</tr>\n";
  }
  html += "</table></div>\n<ul class=\"soft\">";
  for (const FigureInfo& figure : figures) {
    html += fmt::format("<li><b>{}</b>{}: {}; {} is better</li>\n", figure.label,
                        figure.unit[0] ? fmt::format(" [{}]", figure.unit) : "",
                        EscapeMarkup(figure.meaning), figure.less_is_better ? "less" : "more");
  }
  return html + "</ul>\n";
}

std::string Notes(const SequenceResult& sequence, int repeats) {
  std::string html = "<ul class=\"soft\">";
  for (const MethodResult& method : sequence.methods) {
    for (const std::string& remark : method.remarks) {
      html += "<li><b>" + EscapeMarkup(method.name) + "</b>: " + EscapeMarkup(remark) + "</li>\n";
    }
  }
  for (const std::string& note : NotesOn(sequence, repeats)) {
    html += "<li>" + EscapeMarkup(note) + "</li>\n";
  }
  return html + "</ul>\n";
}

std::string LineMaps(const SequenceResult& sequence) {
  std::string html;
  for (const MethodResult& method : sequence.methods) {
    if (method.lines.empty()) continue;
    html += Figure(
        fmt::format("{} <span>{} lines</span>", EscapeMarkup(method.name), method.lines.size()),
        LineMapPlot(sequence, method), "paper");
  }
  if (html.empty()) return "";
  return std::string("<h3>Line maps from above") +
         (sequence.true_edges ? ", over the true edges (grey)" : "") +
         ": red and green along the building's axes, blue upright, amber along none" +
         "</h3><div class=\"cards wide\">" + html + "</div>\n";
}

std::string Section(const SequenceResult& sequence, int repeats) {
  std::string html = fmt::format(
      "<h2>{}</h2>\n<p class=\"soft\">{:.1f} m, {:.0f} s; true poses {}, true edges {}</p>\n",
      EscapeMarkup(sequence.name), sequence.length_m, sequence.duration_s,
      sequence.true_poses ? "known" : "not known", sequence.true_edges ? "known" : "not known");
  html += Notes(sequence, repeats) + Key(sequence) + Bars(sequence);
  if (repeats > 1) html += Orders(sequence);
  html += "<h3>Paths</h3><div class=\"cards wide\">" +
          Figure("Paths from above <span>rings: starts</span>", PathPlot(sequence), "paper") +
          Figure("Distance from the truth over time", ErrorPlot(sequence)) + "</div>\n";
  html += LineMaps(sequence);
  for (const char* group : kFigureGroups) html += Table(sequence, group);
  const std::string stages = StagePlot(sequence);
  if (stages.empty()) return html;
  return html + "<h3>Where the time goes</h3><div class=\"cards wide\">" +
         Figure("Wall time a pair of images by stage <span>stages run side by side</span>",
                stages) +
         "</div>\n";
}

}  // namespace

std::string ComparisonPage(const Comparison& comparison) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>slcmap: comparison</title>\n<style>{}</style></head><body>\n"
      "<h1>Comparison of methods</h1>\n<p class=\"soft\">slcmap {}, {}, "
      "{}<br><code>{}</code></p>\n",
      std::string(kStyle) + kPlotStyle, EscapeMarkup(comparison.version),
      EscapeMarkup(comparison.date), EscapeMarkup(comparison.machine),
      EscapeMarkup(comparison.command));
  for (const SequenceResult& sequence : comparison.sequences) {
    html += Section(sequence, comparison.repeats);
  }
  return html + "</body></html>\n";
}

}  // namespace slcmap::evaluation
