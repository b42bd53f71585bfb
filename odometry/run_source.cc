#include "odometry/run_source.h"

#include <spdlog/fmt/fmt.h>

#include "data/error.h"
#include "data/file.h"
#include "data/text_row.h"
#include "odometry/run_json.h"

namespace slcmap {
namespace {

constexpr char kRawRig[] = "raw_rig.json";
constexpr char kOptions[] = "options.yaml";
constexpr char kImages[] = "images.csv";
constexpr char kImageHeader[] = "stamp_ns,left,right";

}  // namespace

std::vector<std::string> RunSourceFiles() { return {kRawRig, kOptions, kImages}; }

void WriteRunSource(const std::string& folder, const RunSource& source) {
  WriteRig(folder + "/" + kRawRig, source.raw_rig);
  WriteFile(folder + "/" + kOptions, source.options);
  std::string rows = std::string(kImageHeader) + "\n";
  for (const RecordedImages& images : source.images) {
    rows += fmt::format("{},{},{}\n", images.stamp_ns, images.left_path, images.right_path);
  }
  WriteFile(folder + "/" + kImages, rows);
}

void ReadRunSource(const std::string& folder, RunSource* source) {
  source->raw_rig = ReadRig(folder + "/" + kRawRig);
  source->options = ReadFile(folder + "/" + kOptions);
  const std::string path = folder + "/" + kImages;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    if (row == 1) return;  // the names of the columns
    const auto stamp_ns = ParseScaledInteger(fields[0], 0);
    if (!stamp_ns || fields.size() < 2 || fields.size() > 3) {
      throw DataError(fmt::format("{}: row {}: found '{}', expected {}", path, row,
                                  fmt::join(fields, ","), kImageHeader));
    }
    source->images.push_back(
        {*stamp_ns, std::string(fields[1]), fields.size() > 2 ? std::string(fields[2]) : ""});
  });
}

}  // namespace slcmap
