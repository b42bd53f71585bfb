#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "data/core/error.h"
#include "data/io/trajectory.h"
#include "data/simulator/scene/scene_objects.h"
#include "data/simulator/scene/scene_parts.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kDarkBelow = 128;       // grey
constexpr double kCorner_deg = 40;    // what turns less is a curve
constexpr double kLeastFace_m = 0.3;  // of what is told as a wall
constexpr double kLeastDoor_m = 0.6, kMostDoor_m = 2.0, kSingleLeaf_m = 1.3;
constexpr double kMostThickness_m = 0.75;
constexpr double kClear_m = 0.7;  // between furniture and who walks by
constexpr double kSkirting_m = 0.08;

struct PlanOptions {
  std::string image, keep_clear;
  double pixel_m = 0.01, height = 2.9, door_height = 2.1, glazed_m = 0.13, daylight = 6;
  double lamps_m = 3, lamp_radiance = 16, furniture = 0.5;
  int seed = 1;
  std::vector<double> leaf_deg = {85, 0};
  std::vector<std::string> walls = {"white"};
  std::string floor = "carpet", ceiling = "ceiling";
};

// A straight side of what is dark, which is to its right; seen from the free side, `to` is left.
struct Side {
  Vector2d from, to;                        // metres
  int outline = 0, before = 0, behind = 0;  // the sides next to it
  double thickness_m = 0;                   // of the wall behind it
  bool is_in_door = false;                  // the end of a wall at a gap

  double length_m() const { return (to - from).norm(); }
  Vector2d along() const { return (to - from).normalized(); }
  Vector2d normal() const { return {-along().y(), along().x()}; }  // to where it is free
};

// A gap between the ends of two walls.
struct Gap {
  int first = 0, second = 0;  // sides
  Vector2d from, to;          // middles of the two ends
  double width_m = 0, thickness_m = 0;
};

[[noreturn]] void Refuse(const YamlSection& section, const std::string& key,
                         const std::string& what) {
  throw ConfigError(section.place() + "." + key + ": " + what);
}

std::filesystem::path Beside(const YamlSection& section, const std::string& name) {
  const std::string file = section.place().substr(0, section.place().rfind(": "));
  return std::filesystem::path(file).parent_path() / name;
}

PlanOptions ReadPlanOptions(YamlSection* section) {
  PlanOptions options;
  section->Read("image", &options.image);
  section->Read("keep_clear", &options.keep_clear);
  section->Read("walls", &options.walls);
  section->Read("leaf_deg", &options.leaf_deg);
  section->Read("floor", &options.floor);
  section->Read("ceiling", &options.ceiling);
  section->Read("seed", &options.seed);
  const auto number = [&](const char* key, double least, double most, double* value) {
    section->Read(key, value);
    if (*value >= least && *value <= most) return;
    Refuse(*section, key, fmt::format("found {}, expected {} to {}", *value, least, most));
  };
  number("pixel_m", 0.001, 0.2, &options.pixel_m);
  number("height", 2, 20, &options.height);
  number("door_height", 1.5, options.height, &options.door_height);
  number("glazed_m", 0, 1, &options.glazed_m);
  number("daylight", 0, 10000, &options.daylight);
  number("lamps_m", 1, 100, &options.lamps_m);
  number("lamp_radiance", 0.001, 10000, &options.lamp_radiance);
  number("furniture", 0, 1, &options.furniture);
  section->Finish();
  if (options.walls.empty()) Refuse(*section, "walls", "expected at least one material");
  if (options.leaf_deg.empty()) Refuse(*section, "leaf_deg", "expected at least one angle");
  return options;
}

// 255 where walls are.
cv::Mat ReadWallMask(const YamlSection& section, const std::string& name) {
  constexpr int64_t kMostPixels = 200'000'000;
  const std::string path = Beside(section, name);
  const cv::Mat grey = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (grey.empty()) Refuse(section, "image", path + ": expected an image that can be read");
  if (static_cast<int64_t>(grey.total()) > kMostPixels) {
    Refuse(
        section, "image",
        fmt::format("{}: found {} pixels, expected at most {}", path, grey.total(), kMostPixels));
  }
  cv::Mat mask = grey < kDarkBelow;
  if (cv::countNonZero(mask) == 0) Refuse(section, "image", path + ": found no dark pixel");
  return mask;
}

class PlanBuilder {
 public:
  PlanBuilder(const YamlSection& section, const PlanOptions& options,
              const MaterialNames& materials, SceneBuilder* builder)
      : section_(section),
        options_(options),
        materials_(materials),
        builder_(builder),
        mask_(ReadWallMask(section, options.image)),
        random_(static_cast<uint32_t>(options.seed)) {
    if (!options.keep_clear.empty()) {
      for (const StampedPose& pose : ReadTrajectory(Beside(section, options.keep_clear))) {
        walk_.push_back(pose.T_world_imu.translation.head<2>());
      }
    }
  }

  void Build() {
    CollectSides();
    FindGaps();
    for (size_t i = 0; i < sides_.size(); ++i) AddSide(static_cast<int>(i));
    AddJoinedFaces();
    for (size_t i = 0; i < gaps_.size(); ++i)
      AddDoor(gaps_[i], options_.leaf_deg[i % options_.leaf_deg.size()]);
    AddFloorAndCeiling();
    AddLamps();
    Furnish();
  }

 private:
  bool IsWall(const Vector2d& place) const {
    const int x = static_cast<int>(std::floor(place.x() / options_.pixel_m));
    const int y = mask_.rows - 1 - static_cast<int>(std::floor(place.y() / options_.pixel_m));
    return x >= 0 && y >= 0 && x < mask_.cols && y < mask_.rows && mask_.at<uint8_t>(y, x) > 0;
  }

  uint32_t Material(const std::string& key, const std::string& name) const {
    const auto found = materials_.find(name);
    if (found == materials_.end()) Refuse(section_, key, "found no material '" + name + "'");
    return found->second;
  }

  void CollectSides() {
    int outline = 0;
    for (const std::vector<Vector2d>& corners : TraceOutlines(mask_, options_.pixel_m)) {
      const int first = static_cast<int>(sides_.size()), n = static_cast<int>(corners.size());
      for (int i = 0; i < n; ++i) {
        Side side;
        side.from = options_.pixel_m * corners[i];
        side.to = options_.pixel_m * corners[(i + 1) % n];
        side.outline = outline;
        side.before = first + (i + n - 1) % n;
        side.behind = first + (i + 1) % n;
        if (side.length_m() > 0) side.thickness_m = MeasureThickness(side);
        sides_.push_back(side);
      }
      ++outline;
    }
  }

  // The least of some places: another wall may join it from behind at one of them.
  double MeasureThickness(const Side& side) const {
    double least_m = kMostThickness_m;
    for (const double share : {0.25, 0.5, 0.75}) {
      const Vector2d place = side.from + share * (side.to - side.from);
      double depth_m = 0;
      const auto is_deeper = [&] {
        return IsWall(place - (depth_m + 0.5 * options_.pixel_m) * side.normal());
      };
      while (depth_m < least_m && is_deeper()) depth_m += options_.pixel_m;
      least_m = std::min(least_m, depth_m);
    }
    return std::max(least_m, options_.pixel_m);
  }

  bool IsEnd(const Side& side) const {
    const Side &before = sides_[side.before], &behind = sides_[side.behind];
    return side.length_m() >= 0.05 && side.length_m() <= 0.5 &&
           before.normal().dot(side.along()) < -0.9 && behind.normal().dot(side.along()) > 0.9;
  }

  bool IsFree(const Vector2d& from, const Vector2d& to) const {
    const int steps = static_cast<int>((to - from).norm() / options_.pixel_m);
    for (int i = 2; i + 2 < steps; ++i) {
      if (IsWall(from + i * (to - from) / steps)) return false;
    }
    return true;
  }

  void FindGaps() {
    for (size_t i = 0; i < sides_.size(); ++i) {
      for (size_t j = i + 1; j < sides_.size(); ++j) {
        Side &a = sides_[i], &b = sides_[j];
        if (a.is_in_door || b.is_in_door || !IsEnd(a) || !IsEnd(b)) continue;
        if (a.normal().dot(b.normal()) > -0.99) continue;
        const Vector2d from = 0.5 * (a.from + a.to), to = 0.5 * (b.from + b.to);
        const double width_m = (to - from).dot(a.normal());
        const double aside_m = std::abs((to - from).dot(a.along()));
        if (width_m < kLeastDoor_m || width_m > kMostDoor_m || aside_m > 0.06) continue;
        if (!IsFree(from, to)) continue;
        a.is_in_door = b.is_in_door = true;
        gaps_.push_back({static_cast<int>(i), static_cast<int>(j), from,
                         from + width_m * a.normal(), width_m,
                         std::min(a.length_m(), b.length_m())});
      }
    }
  }

  WallSpec MakeWall(const Side& side) const {
    WallSpec spec;
    spec.points = {side.from, side.to};  // its front is to the left of its way
    spec.height = options_.height;
    spec.thickness = side.thickness_m;
    spec.skirting_height = side.length_m() > kLeastFace_m ? kSkirting_m : 0;
    spec.material = Material("walls", options_.walls[side.outline % options_.walls.size()]);
    spec.skirting = Material("skirting", "white");
    spec.frame = Material("frame", "metal");
    spec.leaf = Material("leaf", "wood");
    spec.metal = Material("metal", "metal");
    spec.glass = Material("glass", "glass");
    spec.daylight = Material("daylight", "lamp");
    return spec;
  }

  bool IsGlazed(const Side& side) const {
    return side.thickness_m <= options_.glazed_m && side.length_m() > 0.8;
  }

  void AddSide(int index) {
    const Side& side = sides_[index];
    if (side.length_m() < 0.002) return;
    WallSpec spec = MakeWall(side);
    spec.is_told = !IsJoined(index);
    spec.is_solid = true;
    if (IsGlazed(side)) {
      const double margin = 0.1;
      spec.thickness = std::max(spec.thickness, 0.05);
      spec.openings = {{0, margin, side.length_m() - 2 * margin, options_.height - 0.9, 0.6, 0,
                        options_.daylight, false}};
    }
    AddWall(spec, Eigen::Isometry3d::Identity(), 0, builder_);
    // The edge of the corner at its end.
    const double turn = side.along().dot(sides_[side.behind].along());
    if (turn < std::cos(kCorner_deg * std::numbers::pi / 180)) {
      builder_->SetPlacement(0, Eigen::Isometry3d::Identity());
      builder_->AddEdge({side.to.x(), side.to.y(), 0}, {side.to.x(), side.to.y(), options_.height});
    }
  }

  // The sides of the two walls at a gap that go on across it, as pairs.
  std::vector<std::pair<int, int>> SidesAcross(const Gap& gap) const {
    const Side &a = sides_[gap.first], &b = sides_[gap.second];
    const Vector2d way = (gap.to - gap.from).normalized();
    std::vector<std::pair<int, int>> pairs;
    for (const auto& [i, j] : {std::pair(a.before, b.behind), std::pair(a.behind, b.before)}) {
      const Side &p = sides_[i], &q = sides_[j];
      // Sides of posts are short, and drawn by few pixels.
      const Side& longer = p.length_m() >= q.length_m() ? p : q;
      const bool are_long = std::min(p.length_m(), q.length_m()) >= kLeastFace_m;
      const Vector2d across =
          longer.length_m() >= kLeastFace_m ? longer.normal() : Vector2d(-way.y(), way.x());
      if (p.normal().dot(q.normal()) > (are_long ? 0.99 : 0.9) &&
          std::abs((q.from - p.from).dot(across)) < 0.03) {
        pairs.emplace_back(i, j);
      }
    }
    return pairs;
  }

  bool IsJoined(int side) const {
    return std::any_of(gaps_.begin(), gaps_.end(), [&](const Gap& gap) {
      const auto pairs = SidesAcross(gap);
      return std::any_of(pairs.begin(), pairs.end(), [&](const auto& pair) {
        return pair.first == side || pair.second == side;
      });
    });
  }

  // A post's sides tell little of the heading.
  const Side& FindLongest(const std::vector<int>& group, int root) const {
    const Side* longest = &sides_[static_cast<size_t>(root)];
    for (size_t i = 0; i < sides_.size(); ++i) {
      if (group[i] == root && sides_[i].length_m() > longest->length_m()) longest = &sides_[i];
    }
    return *longest;
  }

  // Faces of walls that go on across doors are told as one.
  void AddJoinedFaces() {
    std::vector<int> group(sides_.size());
    for (size_t i = 0; i < group.size(); ++i) group[i] = static_cast<int>(i);
    std::vector<std::pair<int, int>> doors;  // group's side, gap
    for (size_t g = 0; g < gaps_.size(); ++g) {
      for (const auto& [i, j] : SidesAcross(gaps_[g])) {
        const int from = group[j], to = group[i];
        std::replace(group.begin(), group.end(), from, to);
        doors.emplace_back(i, static_cast<int>(g));
      }
    }
    std::vector<int> ids(gaps_.size());
    for (int& id : ids) id = builder_->NewOpening();
    builder_->SetPlacement(0, Eigen::Isometry3d::Identity());
    for (size_t root = 0; root < sides_.size(); ++root) {
      if (group[root] != static_cast<int>(root) || !IsJoined(static_cast<int>(root))) continue;
      Side base = FindLongest(group, static_cast<int>(root));
      if (base.length_m() < kLeastFace_m) {
        const auto door = std::ranges::find_if(
            doors, [&](const auto& of) { return group[of.first] == static_cast<int>(root); });
        const Gap& gap = gaps_[door->second];
        const Vector2d way = (gap.to - gap.from).normalized();
        base.to = base.from + base.length_m() * (way.dot(base.along()) < 0 ? -1 : 1) * way;
      }
      const Vector2d along = base.along();
      double from = 0, to = base.length_m();
      for (size_t i = 0; i < sides_.size(); ++i) {
        if (group[i] != static_cast<int>(root)) continue;
        from = std::min(from, along.dot(sides_[i].from - base.from));
        to = std::max(to, along.dot(sides_[i].to - base.from));
      }
      SceneWallFace face;
      const Vector2d foot = base.from + from * along, end = base.from + to * along;
      face.foot_world = {foot.x(), foot.y(), 0};
      face.end_world = {end.x(), end.y(), 0};
      face.normal = {base.normal().x(), base.normal().y(), 0};
      face.height_m = options_.height;
      face.thickness_m = base.thickness_m;
      face.is_solid = true;
      for (const auto& [side, g] : doors) {
        if (group[side] != static_cast<int>(root)) continue;
        const double a = along.dot(gaps_[g].from - foot), b = along.dot(gaps_[g].to - foot);
        const double leaf_deg = options_.leaf_deg[g % options_.leaf_deg.size()];
        face.openings.push_back({ids[g], true, leaf_deg >= 20 || IsWalkedThrough(gaps_[g]), false,
                                 std::min(a, b), std::max(a, b), 0, options_.door_height});
      }
      builder_->AddWallFace(face);
    }
  }

  bool IsWalkedThrough(const Gap& gap) const {
    const Vector2d middle = 0.5 * (gap.from + gap.to);
    return DistanceToWalk(middle) < 0.5 * gap.width_m + 0.3;
  }

  double DistanceToWalk(const Vector2d& place) const {
    double least_m = 1e9;
    for (const Vector2d& step : walk_) least_m = std::min(least_m, (step - place).norm());
    return least_m;
  }

  // A lintel with a frame, and leaves.
  void AddDoor(const Gap& gap, double leaf_deg) {
    if (options_.height - options_.door_height < 0.02) return;
    Side side;
    side.outline = sides_[gap.first].outline;
    const Vector2d across(-(gap.to - gap.from).normalized().y(),
                          (gap.to - gap.from).normalized().x());
    side.from = gap.from + 0.5 * gap.thickness_m * across;
    side.to = gap.to + 0.5 * gap.thickness_m * across;
    side.thickness_m = gap.thickness_m;
    WallSpec spec = MakeWall(side);
    spec.has_back = true;
    spec.skirting_height = 0;
    spec.is_told = false;
    if (leaf_deg < 20 && IsWalkedThrough(gap)) leaf_deg = 88;
    spec.openings = {{0, 0, gap.width_m, options_.door_height, 0, leaf_deg, 0, true}};
    spec.has_leaf = gap.width_m <= kSingleLeaf_m;
    AddWall(spec, Eigen::Isometry3d::Identity(), 0, builder_);
  }

  Eigen::AlignedBox2d Bounds() const {
    Eigen::AlignedBox2d box;
    for (const Side& side : sides_) box.extend(side.from);
    return box;
  }

  void AddFloorAndCeiling() {
    const Eigen::AlignedBox2d box = Bounds();
    builder_->SetPlacement(0, Eigen::Isometry3d::Identity());
    builder_->AddBody("slab", false);
    const Vector3d a(box.min().x(), box.min().y(), 0), x(box.sizes().x(), 0, 0),
        y(0, box.sizes().y(), 0), up(0, 0, options_.height);
    builder_->AddQuad(a, x, y, Material("floor", options_.floor));
    builder_->AddQuad(a + y + up, x, -y, Material("ceiling", options_.ceiling));
  }

  // Where it is not free to the border of the picture.
  bool IsInside(const Vector2d& place) const {
    const int x = static_cast<int>(place.x() / options_.pixel_m);
    const int y = mask_.rows - 1 - static_cast<int>(place.y() / options_.pixel_m);
    return x >= 0 && y >= 0 && x < mask_.cols && y < mask_.rows && outside_.at<uint8_t>(y, x) == 0;
  }

  void AddLamps() {
    cv::Mat padded;
    cv::copyMakeBorder(mask_, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
    cv::floodFill(padded, {0, 0}, 100);
    outside_ = padded(cv::Rect(1, 1, mask_.cols, mask_.rows)) == 100;
    const Eigen::AlignedBox2d box = Bounds();
    for (double x = box.min().x() + 1.1; x < box.max().x(); x += options_.lamps_m) {
      for (double y = box.min().y() + 1.3; y < box.max().y(); y += options_.lamps_m) {
        if (!IsInside({x, y}) || !IsClear({x, y}, {0.7, 0.25}, Vector2d::UnitX())) continue;
        Place({x, y}, options_.height, 0);
        builder_->AddBody("lamp", true);
        AddCeilingLamp({1.2, 0.3}, options_.lamp_radiance, Material("lamp", "lamp"),
                       Material("lamp", "white"), builder_);
      }
    }
  }

  void Place(const Vector2d& at, double z, double yaw_rad) {
    Eigen::Isometry3d wing_object = Eigen::Isometry3d::Identity();
    wing_object.translation() << at, z;
    wing_object.rotate(Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()));
    builder_->SetPlacement(0, wing_object);
  }

  // Of walls, within half sizes along `along` and across it.
  bool IsClear(const Vector2d& middle, const Vector2d& half, const Vector2d& along) const {
    const Vector2d across(-along.y(), along.x());
    constexpr int kSteps = 8;
    for (int i = -kSteps; i <= kSteps; ++i) {
      for (int j = -kSteps; j <= kSteps; ++j) {
        if (IsWall(middle + i * half.x() / kSteps * along + j * half.y() / kSteps * across)) {
          return false;
        }
      }
    }
    return true;
  }

  bool IsAtDoor(const Vector2d& place, double reach_m) const {
    return std::any_of(gaps_.begin(), gaps_.end(), [&](const Gap& gap) {
      return (0.5 * (gap.from + gap.to) - place).norm() < 0.5 * gap.width_m + reach_m;
    });
  }

  // Things at walls, with gaps between them, from 0.6 to 2.4 m wide.
  void Furnish() {
    for (const Side& side : sides_) {
      if (side.length_m() < 1.2 || IsGlazed(side)) continue;
      double at = UniformIn(0.1, 0.6, &random_);
      while (true) {
        const double width = UniformIn(0.6, 2.4, &random_);
        const double next = at + width + UniformIn(0.05, 0.5, &random_);
        if (at + width > side.length_m() - 0.1) break;
        if (UniformIn(0, 1, &random_) < options_.furniture) AddThing(side, at, width);
        at = next;
      }
    }
  }

  void AddThing(const Side& side, double at, double width) {
    const double depth = UniformIn(0.3, 0.6, &random_);
    const int choice = static_cast<int>(UniformIn(0, 5, &random_));
    const auto seed = static_cast<uint32_t>(random_());
    const Vector2d foot = side.from + (at + 0.5 * width) * side.along();
    const Vector2d middle = foot + (0.5 * depth + 0.04) * side.normal();
    if (!IsInside(middle) || IsAtDoor(middle, 0.5 * width + 0.3) ||
        DistanceToWalk(middle) < 0.5 * std::max(width, depth) + kClear_m ||
        !IsClear(middle, {0.5 * width, 0.5 * depth}, side.along())) {
      return;
    }
    // Its -y is where the wall faces.
    const double yaw_rad = std::atan2(side.normal().y(), side.normal().x()) + std::numbers::pi / 2;
    const auto place = [&](const char* kind, double off_m, double z) {
      Place(foot + off_m * side.normal(), z, yaw_rad);
      builder_->AddBody(kind, true);
    };
    const auto material = [&](const char* name) { return Material("furniture", name); };
    const std::vector<uint32_t> contents = {material("paper"), material("dark"), material("paint"),
                                            material("cork")};
    if (choice == 0) {
      place("cabinet", 0.02, 0);
      AddCabinet({width, depth, UniformIn(0.8, 2.0, &random_)},
                 std::max(1, static_cast<int>(width / 0.5)), material("paint"), material("metal"),
                 builder_);
    } else if (choice == 1) {
      place("shelf", 0.02, 0);
      AddShelf({width, depth, UniformIn(1.2, 2.2, &random_)}, 5, material("wood"), contents, seed,
               builder_);
    } else if (choice == 2) {
      place("table", 0.5 * depth + 0.03, 0);
      AddTable({width, depth, 0.74}, material("wood"), material("metal"), builder_);
      Place(middle, 0.74, yaw_rad);
      AddClutter({0.8 * width, 0.8 * depth}, 0.18, 5, false, contents, seed, builder_);
    } else if (choice == 3) {
      place("poster", 0.005, 1.1);
      AddPoster({std::min(width, 0.8), 0.9}, seed, builder_);
    } else {
      place("board", 0.005, 1.0);
      AddBoard({std::min(width, 1.6), 1.0}, material("cork"), material("metal"), seed, builder_);
    }
  }

  const YamlSection& section_;
  const PlanOptions& options_;
  const MaterialNames& materials_;
  SceneBuilder* builder_;
  cv::Mat mask_, outside_;
  std::mt19937 random_;
  std::vector<Vector2d> walk_;
  std::vector<Side> sides_;
  std::vector<Gap> gaps_;
};

}  // namespace

void BuildPlan(YamlSection section, const MaterialNames& materials, SceneBuilder* builder) {
  const PlanOptions options = ReadPlanOptions(&section);
  if (options.image.empty()) return;
  PlanBuilder(section, options, materials, builder).Build();
}

}  // namespace slcmap::data
