#include "export/section/hidden_lines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kAtEdge_m = 1e-4;  // what lies on the border of a screen is seen

double DepthAt(const Screen& screen, double x_m) {
  const double width_m = screen.box.sizes().x();
  const double share = width_m > 0 ? (x_m - screen.box.min().x()) / width_m : 0;
  return screen.left_m + share * (screen.right_m - screen.left_m);
}

// The part within a window.
std::optional<ViewedLine> Clipped(ViewedLine line, const Eigen::AlignedBox3d& window) {
  const Vector3d along = line.end - line.start;
  double from = 0, to = 1;
  for (int k = 0; k < 3; ++k) {
    const double low = window.min()[k] - line.start[k], high = window.max()[k] - line.start[k];
    if (along[k] == 0) {
      if (low > 0 || high < 0) return std::nullopt;
      continue;
    }
    from = std::max(from, std::min(low / along[k], high / along[k]));
    to = std::min(to, std::max(low / along[k], high / along[k]));
  }
  if (!(from < to)) return std::nullopt;
  line.end = line.start + to * along;
  line.start += from * along;
  return line;
}

// Where along a line, 0 to 1, a screen may begin or cease to hide it.
void AddChanges(const Screen& screen, const ViewedLine& line, std::vector<double>* changes) {
  const Vector3d along = line.end - line.start;
  for (int k = 0; k < 2; ++k) {
    if (along[k] == 0) continue;
    for (const double at : {screen.box.min()[k], screen.box.max()[k]}) {
      changes->push_back((at - line.start[k]) / along[k]);
    }
  }
  const double start_m = line.start.z() - line.before_m - DepthAt(screen, line.start.x());
  const double end_m = line.end.z() - line.before_m - DepthAt(screen, line.end.x());
  if (start_m != end_m) changes->push_back(start_m / (start_m - end_m));
}

bool MayHide(const Screen& screen, const ViewedLine& line) {
  Eigen::AlignedBox2d box(line.start.head<2>());
  box.extend(line.end.head<2>().eval());
  return screen.box.intersects(box) && std::min(screen.left_m, screen.right_m) <
                                           std::max(line.start.z(), line.end.z()) - line.before_m;
}

using SharesOfLine = std::vector<std::pair<double, double>>;

SharesOfLine SeenShares(const ViewedLine& line, const std::vector<Screen>& screens) {
  constexpr double kLeast = 1e-6;
  std::vector<double> changes = {0, 1};
  std::vector<Screen> before;
  for (const Screen& screen : screens) {
    if (!MayHide(screen, line)) continue;
    before.push_back(screen);
    AddChanges(screen, line, &changes);
  }
  std::erase_if(changes, [](double share) { return !(share >= 0 && share <= 1); });
  std::sort(changes.begin(), changes.end());
  SharesOfLine seen;
  for (size_t i = 0; i + 1 < changes.size(); ++i) {
    if (changes[i + 1] - changes[i] < kLeast) continue;
    const double middle = 0.5 * (changes[i] + changes[i + 1]);
    const Vector3d point = line.start + middle * (line.end - line.start);
    if (IsHidden(before, point, line.before_m)) continue;
    if (!seen.empty() && changes[i] - seen.back().second < kLeast) {
      seen.back().second = changes[i + 1];
    } else {
      seen.emplace_back(changes[i], changes[i + 1]);
    }
  }
  return seen;
}

// Level and upright pieces by their pen, direction and place across it, others as they are.
class Pieces {
 public:
  void Add(Pen pen, const Vector2d& start, const Vector2d& end) {
    constexpr double kLeast_m = 1e-3, kGrid_m = 1e-4;
    if ((end - start).norm() < kLeast_m) return;
    for (const int along : {0, 1}) {
      const int across = 1 - along;
      if (std::abs(end[across] - start[across]) > kGrid_m) continue;
      const int64_t row = std::llround(start[across] / kGrid_m);
      rows_[{pen, along, row}].push_back({start, end});
      if (start[along] > end[along])
        std::swap(rows_[{pen, along, row}].back()[0], rows_[{pen, along, row}].back()[1]);
      return;
    }
    paths_.push_back({pen, {start, end}});
  }

  std::vector<DrawnPath> Joined() && {
    for (auto& [key, row] : rows_) {
      const auto [pen, along, place] = key;
      std::sort(row.begin(), row.end(),
                [k = along](const Piece& a, const Piece& b) { return a[0][k] < b[0][k]; });
      Piece joined = row.front();
      for (const Piece& piece : row) {
        if (piece[0][along] > joined[1][along] + kAtEdge_m) {
          paths_.push_back({pen, {joined[0], joined[1]}});
          joined = piece;
        }
        if (piece[1][along] > joined[1][along]) joined[1] = piece[1];
      }
      paths_.push_back({pen, {joined[0], joined[1]}});
    }
    return std::move(paths_);
  }

 private:
  using Piece = std::array<Vector2d, 2>;
  std::map<std::tuple<Pen, int, int64_t>, std::vector<Piece>> rows_;
  std::vector<DrawnPath> paths_;
};

}  // namespace

bool IsHidden(const std::vector<Screen>& screens, const Vector3d& point, double before_m) {
  return std::any_of(screens.begin(), screens.end(), [&](const Screen& screen) {
    const Vector2d inside =
        (point.head<2>() - screen.box.min()).cwiseMin(screen.box.max() - point.head<2>());
    return inside.minCoeff() > kAtEdge_m && DepthAt(screen, point.x()) < point.z() - before_m;
  });
}

std::vector<DrawnPath> SeenParts(const std::vector<ViewedLine>& lines,
                                 const std::vector<Screen>& screens,
                                 const Eigen::AlignedBox3d& window) {
  Pieces pieces;
  for (const ViewedLine& whole : lines) {
    const std::optional<ViewedLine> line = Clipped(whole, window);
    if (!line) continue;
    const Vector3d along = line->end - line->start;
    for (const auto& [from, to] : SeenShares(*line, screens)) {
      pieces.Add(line->pen, (line->start + from * along).head<2>(),
                 (line->start + to * along).head<2>());
    }
  }
  return std::move(pieces).Joined();
}

}  // namespace slcmap
