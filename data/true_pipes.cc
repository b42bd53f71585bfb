#include "data/true_pipes.h"

#include <spdlog/fmt/fmt.h>

#include "data/csv_table.h"
#include "data/file.h"

namespace slcmap {
namespace {

constexpr double kMost_m = 1e5, kMostId = 1e8;

CsvColumns PipeColumns() {
  CsvColumns columns = {{"pipe", CsvColumn::Kind::kInteger, 0, kMostId}};
  for (const char* name : {"ax_m", "ay_m", "az_m", "bx_m", "by_m", "bz_m"}) {
    columns.push_back({name, CsvColumn::Kind::kNumber, -kMost_m, kMost_m});
  }
  for (const char* name : {"radius_m", "seen_from_m", "seen_to_m"}) {
    columns.push_back({name, CsvColumn::Kind::kNumber, 0, kMost_m});
  }
  return columns;
}

std::string Row(const TruePipe& pipe, const SeenStretch& seen) {
  const Eigen::Vector3d &a = pipe.start_world, &b = pipe.end_world;
  return fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", pipe.id,
                     a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), pipe.radius_m, seen.from_m,
                     seen.to_m);
}

}  // namespace

double TruePipe::SeenLength_m() const {
  double length_m = 0;
  for (const SeenStretch& stretch : seen) length_m += stretch.to_m - stretch.from_m;
  return length_m;
}

void WriteTruePipes(const std::string& path, const std::vector<TruePipe>& pipes) {
  std::string text = CsvHeader(PipeColumns()) + "\n";
  for (const TruePipe& pipe : pipes) {
    if (pipe.seen.empty()) text += Row(pipe, {});
    for (const SeenStretch& stretch : pipe.seen) text += Row(pipe, stretch);
  }
  WriteFile(path, text);
}

std::vector<TruePipe> ReadTruePipes(const std::string& path) {
  const CsvTable table = CsvTable::Read(path, PipeColumns());
  std::vector<TruePipe> pipes;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const int64_t id = table.Integer(row, 0);
    if (pipes.empty() || pipes.back().id != id) {
      const auto point = [&](std::size_t column) -> Eigen::Vector3d {
        return {table.Number(row, column), table.Number(row, column + 1),
                table.Number(row, column + 2)};
      };
      pipes.push_back({id, point(1), point(4), table.Number(row, 7), {}});
    }
    const SeenStretch stretch{table.Number(row, 8), table.Number(row, 9)};
    if (stretch.to_m < stretch.from_m) table.Fail(row, 9, "at least seen_from_m");
    if (stretch.to_m > stretch.from_m) pipes.back().seen.push_back(stretch);
  }
  return pipes;
}

}  // namespace slcmap
