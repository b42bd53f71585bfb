#include "apps/commands/output_bag.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <vector>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/output_folder.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

// What each kind of bag can be packed with.
const std::map<std::string, std::vector<std::string>>& KnownPackings() {
  static const std::map<std::string, std::vector<std::string>> known = {
      {"bag", {"none", "lz4", "bz2"}},
      {"db3", {"none", "zstd"}},
      {"mcap", {"none", "lz4", "zstd", "unchunked"}}};
  return known;
}

}  // namespace

BagPacking ParsePacking(const std::string& output, const std::string& text) {
  BagPacking packing{kFolder, ""};
  std::string ending;
  for (const auto& [form, compressions] : KnownPackings()) {
    if (output.ends_with("." + form)) ending = packing.form = form;
  }
  std::vector<std::string> words = SplitAtCommas(text);
  if (words.back().empty()) words.pop_back();
  for (const std::string& word : words) {
    const bool is_form = word == kFolder || KnownPackings().contains(word);
    (is_form ? packing.form : packing.compression) = word;
  }
  if (!ending.empty() && packing.form != ending) {
    throw ConfigError(fmt::format("--packing: found {} for {}, expected {} by its ending",
                                  packing.form, output, ending));
  }
  if (packing.form == kFolder && !packing.compression.empty()) {
    throw ConfigError(fmt::format(
        "--packing: found {} for the folder {}, expected it for a bag: give OUT the ending .bag, "
        ".db3 or .mcap, or --packing bag, db3 or mcap with it",
        packing.compression, output));
  }
  if (packing.compression.empty()) packing.compression = "none";
  if (packing.form == kFolder) return packing;
  const std::vector<std::string>& known = KnownPackings().at(packing.form);
  if (std::ranges::count(known, packing.compression) > 0) return packing;
  throw ConfigError(fmt::format("--packing: found {} for {}, expected one of {}",
                                packing.compression, packing.form, fmt::join(known, ", ")));
}

OutputBag::OutputBag(const std::string& path, const BagPacking& packing, const std::string& input)
    : path_(path),
      is_folder_(packing.form == "db3"),
      is_file_of_folder_(is_folder_ && path.ends_with(".db3")) {
  RefuseInputs(path, {input});
  const fs::path whole = FolderItself(path);
  aside_ = whole.string() + ".unfinished";
  name_ = (is_file_of_folder_ ? whole.stem() : whole.filename()).string();
  RefuseFilesOfOthers(input);
  std::error_code error;
  const bool wants_file = !is_folder_ || is_file_of_folder_;
  const std::string found = NoFileAt(path);
  const bool is_new = !fs::exists(path, error) || fs::file_size(path, error) == 0;
  if (wants_file && found.empty() && is_new) return;
  if (!wants_file && !fs::exists(path, error)) return;
  if (!wants_file && fs::is_directory(path, error) && fs::is_empty(path, error)) return;
  throw ConfigError(fmt::format(
      "output {}: found {}, expected {}", path, found.empty() ? "a file" : found,
      wants_file ? "nothing there: remove it, or name another" : "nothing, or an empty folder"));
}

OutputBag::~OutputBag() {
  std::error_code error;
  if (is_begun_) fs::remove_all(aside_, error);
}

std::string OutputBag::Begin() {
  std::error_code error;
  fs::remove_all(aside_, error);  // of one that was killed
  MakeFolder(aside_);
  is_begun_ = true;
  return aside_ + "/" + name_;
}

void OutputBag::Commit() const {
  std::error_code error;
  fs::path from = fs::path(aside_) / name_;
  if (is_file_of_folder_) from /= name_ + "_0.db3";
  if (is_folder_ && !is_file_of_folder_) fs::remove(path_, error);  // where it is empty
  fs::rename(from, LinkTarget(path_), error);
  if (error) throw OutputError(fmt::format("{}: cannot be written: {}", path_, error.message()));
}

// Where it is made there may be what a conversion that was killed has left, and nothing else.
void OutputBag::RefuseFilesOfOthers(const std::string& input) const {
  std::error_code error;
  const fs::path aside = fs::weakly_canonical(aside_, error);
  const fs::path from_aside = fs::weakly_canonical(input, error).lexically_relative(aside);
  bool is_ours = from_aside.empty() || *from_aside.begin() == "..";
  for (const auto& entry : fs::directory_iterator(aside_, error)) {
    is_ours = is_ours && entry.path().filename().string().starts_with(name_);
  }
  if (is_ours) return;
  throw ConfigError(
      fmt::format("output {}: found files in {}, where it is made, expected none: move them away",
                  path_, aside_));
}

}  // namespace slcmap::commands
