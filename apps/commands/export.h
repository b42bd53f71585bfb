// The command-line options of export, which the commands export and run share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "data/core/progress.h"
#include "export/export.h"
#include "export/web/page_writer.h"
#include "mapping/map/map.h"

namespace slcmap::inline commands {

// Adds --format, --max-vertices and those of single formats; `options` must outlive the parsing.
void AddExportOptions(CLI::App& command, ExportOptions* options);

// The page of a map as a file.

// The name of a map for people: its folder's, or where that is "map", as in results of `run`, that
// of the folder above.
std::string TitleOfMap(const std::string& folder);

// Throws ConfigError where a page must not be written: something stands there, and it is no page of
// a map that slcmap wrote. Symbolic links stand for what they lead to.
void CheckPagePlace(const std::string& path);

// Removes a page of a map, and nothing else.
void RemovePage(const std::string& path);

// Writes the page of a map, all of it or, where that fails, nothing: what was there before stays.
// The template is that of ReadPageTemplate(). Throws OutputError, what CheckPagePlace() throws, and
// StoppedError when progress says so.
void WritePage(const MapResult& map, const std::string& page_template, const std::string& title,
               const std::vector<PageImage>& images, const std::string& path,
               const Progress& progress);

// The template of a page, by default of that which maps are put into; it is installed with the
// program. Throws DataError, saying how to get it, where the program was built without it.
std::string ReadPageTemplate(const std::string& name = "page/page.html");

// The template of the page of tilesets, for ExportOptions; "" where there is none.
std::string FindTilesPage();

}  // namespace slcmap::commands
