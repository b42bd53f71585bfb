#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <functional>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/simulator/scene/scene_objects.h"
#include "data/simulator/scene/scene_parts.h"

namespace slcmap::inline data {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinLength_m = 0.001, kMaxLength_m = 1000;
constexpr double kMaxRadiance = 10000;  // in units in which a room's lamp has some 20

// One object's keys, with the checks that all kinds share.
class ObjectKeys {
 public:
  ObjectKeys(YamlSection* section, const MaterialNames& materials)
      : section_(*section), materials_(materials) {}

  void RequireRange(const std::string& key, double value, double low, double high) const {
    if (value >= low && value <= high) return;
    throw ConfigError(
        fmt::format("{}.{}: found {}, expected {} to {}", section_.place(), key, value, low, high));
  }

  [[noreturn]] void Fail(const std::string& key, const std::string& expected) const {
    throw ConfigError(section_.place() + "." + key + ": expected " + expected);
  }

  double Number(const std::string& key, double value, double low, double high) {
    section_.Read(key, &value);
    RequireRange(key, value, low, high);
    return value;
  }
  // The key must be there unless `fallback` is positive.
  double Length(const std::string& key, double fallback = 0) {
    return Number(key, fallback, kMinLength_m, kMaxLength_m);
  }
  int Count(const std::string& key, int value, int least = 1) {
    section_.Read(key, &value);
    if (value < least || value > 10000) Fail(key, std::to_string(least) + " to 10000");
    return value;
  }
  std::string Text(const std::string& key, std::string text) {
    section_.Read(key, &text);
    return text;
  }
  bool Flag(const std::string& key, bool value) {
    section_.Read(key, &value);
    return value;
  }
  template <int N>
  Eigen::Matrix<double, N, 1> Vector(const std::string& key,
                                     const Eigen::Matrix<double, N, 1>& fallback) {
    std::vector<double> values(fallback.data(), fallback.data() + N);
    section_.Read(key, &values);
    if (values.size() != N) Fail(key, std::to_string(N) + " numbers");
    for (const double value : values) RequireRange(key, value, -kMaxLength_m, kMaxLength_m);
    return Eigen::Map<Eigen::Matrix<double, N, 1>>(values.data());
  }
  // Lengths; the key must be there unless they are positive.
  template <int N>
  Eigen::Matrix<double, N, 1> Size(
      const Eigen::Matrix<double, N, 1>& fallback = Eigen::Matrix<double, N, 1>::Zero()) {
    const auto size = Vector<N>("size", fallback);
    for (const double side : size) RequireRange("size", side, kMinLength_m, kMaxLength_m);
    return size;
  }
  // At least `least` points.
  template <int N>
  std::vector<Eigen::Matrix<double, N, 1>> Points(size_t least = 2) {
    std::vector<std::vector<double>> rows;
    section_.Read("points", &rows);
    std::vector<Eigen::Matrix<double, N, 1>> points;
    for (const std::vector<double>& row : rows) {
      if (row.size() != N) Fail("points", "points of " + std::to_string(N) + " numbers");
      for (const double value : row) RequireRange("points", value, -kMaxLength_m, kMaxLength_m);
      points.push_back(Eigen::Map<const Eigen::Matrix<double, N, 1>>(row.data()));
    }
    if (points.size() < least) Fail("points", "at least " + std::to_string(least) + " points");
    return points;
  }
  std::vector<std::vector<double>> Rows(const std::string& key) {
    std::vector<std::vector<double>> rows;
    section_.Read(key, &rows);
    for (const std::vector<double>& row : rows) {
      for (const double value : row) RequireRange(key, value, -kMaxLength_m, kMaxLength_m);
    }
    return rows;
  }
  uint32_t Material(const std::string& key, std::string name) {
    section_.Read(key, &name);
    return Find(key, name);
  }
  std::vector<uint32_t> Materials(const std::string& key, std::vector<std::string> names) {
    section_.Read(key, &names);
    std::vector<uint32_t> found;
    for (const std::string& name : names) found.push_back(Find(key, name));
    if (found.empty()) Fail(key, "at least one material");
    return found;
  }

 private:
  uint32_t Find(const std::string& key, const std::string& name) const {
    const auto found = materials_.find(name);
    if (found != materials_.end()) return found->second;
    std::string names;
    for (const auto& [known, index] : materials_) names += (names.empty() ? "" : ", ") + known;
    throw ConfigError(section_.place() + "." + key + ": found '" + name +
                      "', expected a material: " + names);
  }

  YamlSection& section_;
  const MaterialNames& materials_;
};

// Reads its own keys and gives what builds one object of a row with a seed.
using BuildOne = std::function<void(uint32_t seed, SceneBuilder* builder)>;
using Kind = BuildOne (*)(ObjectKeys& keys);

BuildOne Box(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>();
  const uint32_t material = keys.Material("material", "plaster");
  return [=](uint32_t, SceneBuilder* builder) {
    const Vector3d half(0.5 * size.x(), 0.5 * size.y(), 0);
    builder->AddBox(-half, size - half, material);
  };
}

// A floor or, facing down, a ceiling; from its corner, without edges of its own.
BuildOne Slab(ObjectKeys& keys) {
  const Vector2d size = keys.Size<2>();
  const uint32_t material = keys.Material("material", "concrete");
  const bool down = keys.Flag("faces_down", false);
  return [=](uint32_t, SceneBuilder* builder) {
    const Vector3d x(size.x(), 0, 0), y(0, size.y(), 0);
    if (down) {
      builder->AddQuad(y, x, -y, material);
    } else {
      builder->AddQuad(Vector3d::Zero(), x, y, material);
    }
  };
}

BuildOne Crate(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>();
  const uint32_t wood = keys.Material("material", "wood");
  return [=](uint32_t, SceneBuilder* builder) { AddCrate(size, wood, builder); };
}

BuildOne Pallet(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>({1.2, 0.8, 0.144});
  const uint32_t wood = keys.Material("material", "wood");
  return [=](uint32_t, SceneBuilder* builder) { AddPallet(size, wood, builder); };
}

BuildOne Table(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>({1.6, 0.8, 0.74});
  const uint32_t top = keys.Material("material", "wood"), legs = keys.Material("legs", "metal");
  return [=](uint32_t, SceneBuilder* builder) { AddTable(size, top, legs, builder); };
}

BuildOne Chair(ObjectKeys& keys) {
  const uint32_t seat = keys.Material("material", "dark"), legs = keys.Material("legs", "metal");
  return [=](uint32_t, SceneBuilder* builder) { AddChair(seat, legs, builder); };
}

BuildOne Monitor(ObjectKeys& keys) {
  const uint32_t screen = keys.Material("screen", "glass"),
                 body = keys.Material("material", "dark");
  return [=](uint32_t, SceneBuilder* builder) { AddMonitor(screen, body, builder); };
}

BuildOne Machine(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>();
  const uint32_t body = keys.Material("material", "paint"), metal = keys.Material("metal", "metal");
  return
      [=](uint32_t seed, SceneBuilder* builder) { AddMachine(size, body, metal, seed, builder); };
}

BuildOne Drum(ObjectKeys& keys) {
  const double radius = keys.Length("radius", 0.29), height = keys.Length("height", 0.88);
  const uint32_t metal = keys.Material("material", "paint");
  return [=](uint32_t, SceneBuilder* builder) { AddDrum(radius, height, metal, builder); };
}

BuildOne Ladder(ObjectKeys& keys) {
  const double width = keys.Length("width", 0.42), length = keys.Length("length");
  const uint32_t metal = keys.Material("material", "metal");
  return [=](uint32_t, SceneBuilder* builder) { AddLadder(width, length, metal, builder); };
}

BuildOne Clutter(ObjectKeys& keys) {
  const Vector2d size = keys.Size<2>();
  const double side = keys.Length("max_side", 0.3);
  const int count = keys.Count("count", 8);
  const bool tilted = keys.Flag("tilted", false);
  const auto materials = keys.Materials("materials", {"wood", "metal", "paint", "dark", "paper"});
  return [=](uint32_t seed, SceneBuilder* builder) {
    AddClutter(size, side, count, tilted, materials, seed, builder);
  };
}

BuildOne Poster(ObjectKeys& keys) {
  const Vector2d size = keys.Size<2>({0.6, 0.84});
  return [=](uint32_t seed, SceneBuilder* builder) { AddPoster(size, seed, builder); };
}

BuildOne Tag(ObjectKeys& keys) {
  const std::string name = keys.Text("name", "tag36h11:0");
  const double size = keys.Length("size", 0.2);
  return [=](uint32_t, SceneBuilder* builder) { AddTag(name, size, builder); };
}

BuildOne Board(ObjectKeys& keys) {
  const Vector2d size = keys.Size<2>({1.2, 0.9});
  const uint32_t face = keys.Material("material", "cork"), frame = keys.Material("frame", "metal");
  return [=](uint32_t seed, SceneBuilder* builder) { AddBoard(size, face, frame, seed, builder); };
}

BuildOne Cabinet(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>({0.95, 0.45, 1.9});
  const int doors = keys.Count("doors", 2);
  const uint32_t body = keys.Material("material", "paint"), metal = keys.Material("metal", "metal");
  return [=](uint32_t, SceneBuilder* builder) { AddCabinet(size, doors, body, metal, builder); };
}

BuildOne Shelf(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>({0.9, 0.32, 2.0});
  const int boards = keys.Count("boards", 5);
  const uint32_t wood = keys.Material("material", "wood");
  const auto contents = keys.Materials("contents", {"paper", "dark", "paint", "cork", "white"});
  return [=](uint32_t seed, SceneBuilder* builder) {
    AddShelf(size, boards, wood, contents, seed, builder);
  };
}

BuildOne Radiator(ObjectKeys& keys) {
  const Vector3d size = keys.Size<3>({1.0, 0.12, 0.6});
  const uint32_t metal = keys.Material("material", "white");
  return [=](uint32_t, SceneBuilder* builder) { AddRadiator(size, metal, builder); };
}

BuildOne Extinguisher(ObjectKeys& keys) {
  const uint32_t body = keys.Material("material", "red"), metal = keys.Material("metal", "dark");
  return [=](uint32_t, SceneBuilder* builder) { AddExtinguisher(body, metal, builder); };
}

BuildOne Pipe(ObjectKeys& keys) {
  const auto points = keys.Points<3>();
  const double radius = keys.Length("radius", 0.08);
  const int sides = keys.Count("sides", 48, 8);
  const uint32_t material = keys.Material("material", "metal");
  return [=](uint32_t, SceneBuilder* builder) {
    AddPipeRun(points, radius, sides, material, builder);
  };
}

// Trims: round bars with their axis in the surface that they are on.
BuildOne HalfRound(ObjectKeys& keys) {
  const auto points = keys.Points<3>();
  const double radius = keys.Length("radius", 0.03);
  const uint32_t material = keys.Material("material", "wood");
  return [=](uint32_t, SceneBuilder* builder) {
    constexpr int kSides = 40;
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      builder->AddRoundBar(points[i], points[i + 1], radius, kSides, material);
    }
  };
}

BuildOne Cable(ObjectKeys& keys) {
  const auto points = keys.Points<3>();
  const double sag = keys.Number("sag", 0.4, 0, 100), radius = keys.Length("radius", 0.015);
  const uint32_t material = keys.Material("material", "dark");
  return [=](uint32_t, SceneBuilder* builder) {
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      AddCable(points[i], points[i + 1], sag, radius, material, builder);
    }
  };
}

// Square bars from point to point: beams, trusses.
BuildOne Beam(ObjectKeys& keys) {
  const auto points = keys.Points<3>();
  const double side = keys.Length("side", 0.2);
  const uint32_t material = keys.Material("material", "paint");
  return [=](uint32_t, SceneBuilder* builder) {
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      builder->AddBar(points[i], points[i + 1], side, material);
    }
  };
}

BuildOne Railing(ObjectKeys& keys) {
  const auto points = keys.Points<3>();
  const double height = keys.Length("height", 1.0);
  const uint32_t material = keys.Material("material", "metal");
  return [=](uint32_t, SceneBuilder* builder) { AddRailing(points, height, material, builder); };
}

BuildOne Stairs(ObjectKeys& keys) {
  const int steps = keys.Count("steps", 10);
  const double rise = keys.Length("rise", 0.17), run = keys.Length("run", 0.28);
  const double width = keys.Length("width", 1.2);
  const uint32_t step = keys.Material("material", "concrete"),
                 side = keys.Material("side", "plaster");
  return [=](uint32_t, SceneBuilder* builder) {
    AddStairs(steps, rise, run, width, step, side, builder);
  };
}

BuildOne Lamp(ObjectKeys& keys) {
  const Vector2d size = keys.Size<2>({1.2, 0.3});
  const double radiance = keys.Number("radiance", 12, 0.001, kMaxRadiance);
  const uint32_t lamp = keys.Material("material", "lamp"),
                 housing = keys.Material("housing", "white");
  return [=](uint32_t, SceneBuilder* builder) {
    AddCeilingLamp(size, radiance, lamp, housing, builder);
  };
}

// Rows [segment, along, width, height, last], for a door the angle it stands open, for a window its
// sill; a window may add the radiance of its daylight.
void ReadOpenings(ObjectKeys& keys, const std::string& key, bool doors, WallSpec* spec) {
  const int segments = static_cast<int>(spec->points.size()) - (spec->closed ? 0 : 1);
  for (const std::vector<double>& row : keys.Rows(key)) {
    const bool complete = row.size() == 5 || (!doors && row.size() == 6);
    if (!complete || row[0] < 0 || row[0] >= segments || row[0] != std::floor(row[0]) ||
        row[1] < 0 || row[2] <= 0.2 || row[3] <= 0.2 || row[4] < 0) {
      keys.Fail(key, doors ? "rows of segment, along, width, height, open_deg"
                           : "rows of segment, along, width, height, sill, radiance");
    }
    WallOpening opening;
    opening.segment = static_cast<int>(row[0]);
    opening.along = row[1];
    opening.width = row[2];
    opening.height = row[3];
    opening.is_door = doors;
    (doors ? opening.open_deg : opening.sill) = row[4];
    if (row.size() == 6) {
      keys.RequireRange(key, row[5], 0, kMaxRadiance);
      opening.radiance = row[5];
    }
    spec->openings.push_back(opening);
  }
}

WallSpec ReadWall(ObjectKeys& keys) {
  WallSpec spec;
  spec.closed = keys.Flag("closed", false);
  spec.points = keys.Points<2>(spec.closed ? 3 : 2);
  spec.height = keys.Length("height", spec.height);
  spec.thickness = keys.Length("thickness", spec.thickness);
  spec.has_back = keys.Flag("has_back", false);
  spec.skirting_height = keys.Number("skirting_height", 0, 0, kMaxLength_m);
  spec.clear_glass = keys.Flag("clear_glass", false);
  spec.material = keys.Material("material", "plaster");
  spec.skirting = keys.Material("skirting", "wood");
  spec.frame = keys.Material("frame", "white");
  spec.leaf = keys.Material("leaf", "wood");
  spec.metal = keys.Material("metal", "metal");
  spec.glass = keys.Material("glass", "glass");
  spec.daylight = keys.Material("daylight", "lamp");
  ReadOpenings(keys, "doors", true, &spec);
  ReadOpenings(keys, "windows", false, &spec);
  return spec;
}

const std::map<std::string, Kind>& Kinds() {
  static const std::map<std::string, Kind> kinds = {
      {"box", Box},           {"slab", Slab},
      {"crate", Crate},       {"pallet", Pallet},
      {"table", Table},       {"chair", Chair},
      {"monitor", Monitor},   {"machine", Machine},
      {"drum", Drum},         {"ladder", Ladder},
      {"clutter", Clutter},   {"poster", Poster},
      {"tag", Tag},           {"board", Board},
      {"cabinet", Cabinet},   {"shelf", Shelf},
      {"radiator", Radiator}, {"extinguisher", Extinguisher},
      {"pipe", Pipe},         {"half_round", HalfRound},
      {"cable", Cable},       {"beam", Beam},
      {"railing", Railing},   {"stairs", Stairs},
      {"lamp", Lamp}};
  return kinds;
}

Isometry3d ReadPlace(ObjectKeys& keys) {
  const Vector2d tilt_deg = keys.Vector<2>("tilt_deg", Vector2d::Zero());
  Isometry3d wing_object = Isometry3d::Identity();
  wing_object.translation() = keys.Vector<3>("at", Vector3d::Zero());
  wing_object.rotate(
      Eigen::AngleAxisd(keys.Number("yaw_deg", 0, -3600, 3600) * kDegree, Vector3d::UnitZ()) *
      Eigen::AngleAxisd(tilt_deg.x() * kDegree, Vector3d::UnitX()) *
      Eigen::AngleAxisd(tilt_deg.y() * kDegree, Vector3d::UnitY()));
  return wing_object;
}

// What the builder refuses, with the place of the object.
template <typename BuildObject>
void Build(const YamlSection& section, BuildObject build) {
  try {
    build();
  } catch (const ConfigError& error) {
    throw ConfigError(section.place() + ": " + error.what());
  }
}

}  // namespace

void ReadObject(YamlSection section, const MaterialNames& materials, int wings,
                SceneBuilder* builder) {
  ObjectKeys keys(&section, materials);
  std::string name;
  section.Read("kind", &name);
  const auto kind = Kinds().find(name);
  if (name != "wall" && kind == Kinds().end()) {
    std::string names = "wall";
    for (const auto& [known, build] : Kinds()) names += ", " + known;
    throw ConfigError(section.place() + ".kind: found '" + name + "', expected one of: " + names);
  }
  const int wing = keys.Count("wing", 0, 0);
  if (wing >= wings) keys.Fail("wing", "an index into wings");
  const Isometry3d wing_object = ReadPlace(keys);
  if (name == "wall") {
    const WallSpec spec = ReadWall(keys);
    section.Finish();
    Build(section, [&] { AddWall(spec, wing_object, wing, builder); });
    return;
  }
  const BuildOne build = kind->second(keys);
  const int repeat = keys.Count("repeat", 1), seed = keys.Count("seed", 1, 0);
  const Vector3d step = keys.Vector<3>("step", Vector3d::Zero());
  section.Finish();
  for (int i = 0; i < repeat; ++i) {
    builder->SetPlacement(wing, Eigen::Translation3d(i * step) * wing_object);
    builder->AddBody(name, name != "slab" && name != "stairs");
    Build(section, [&] { build(static_cast<uint32_t>(seed + i), builder); });
  }
}

}  // namespace slcmap::data
