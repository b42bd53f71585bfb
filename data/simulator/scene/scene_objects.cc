#include "data/simulator/scene/scene_objects.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>

#include "data/core/error.h"
#include "data/core/tag_name.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A box by the middle of its foot and its size.
void AddStandingBox(const Vector3d& foot, const Vector3d& size, uint32_t material,
                    SceneBuilder* builder) {
  const Vector3d min = foot - Vector3d(0.5 * size.x(), 0.5 * size.y(), 0);
  builder->AddBox(min, min + size, material);
}

void AddLegs(const Vector3d& size, double side, uint32_t material, SceneBuilder* builder) {
  const double x = 0.5 * (size.x() - side) - 0.02, y = 0.5 * (size.y() - side) - 0.02;
  for (const Vector2d& leg : {Vector2d(x, y), Vector2d(-x, y), Vector2d(-x, -y), Vector2d(x, -y)}) {
    AddStandingBox({leg.x(), leg.y(), 0}, {side, side, size.z()}, material, builder);
  }
}

}  // namespace

void AddCrate(const Vector3d& size, uint32_t wood, SceneBuilder* builder) {
  constexpr double kBatten_m = 0.02, kWidth_m = 0.08;
  const Vector3d inside = size - Vector3d::Constant(2 * kBatten_m);
  AddStandingBox({0, 0, kBatten_m}, inside, wood, builder);
  const double x = 0.5 * size.x(), y = 0.5 * size.y();
  for (const double side : {-1.0, 1.0}) {
    const double face = side > 0 ? y - kBatten_m : -y;
    for (const double low : {0.0, size.z() - kWidth_m}) {
      builder->AddBox({-x, face, low}, {x, face + kBatten_m, low + kWidth_m}, wood);
    }
    for (const double left : {-x, x - kWidth_m}) {
      builder->AddBox({left, face, kWidth_m},
                      {left + kWidth_m, face + kBatten_m, size.z() - kWidth_m}, wood);
    }
  }
}

void AddPallet(const Vector3d& size, uint32_t wood, SceneBuilder* builder) {
  constexpr int kSlats = 5, kBearers = 3;
  constexpr double kBoard_m = 0.022;
  const double slat = 0.62 * size.x() / kSlats, pitch = (size.x() - slat) / (kSlats - 1);
  for (int i = 0; i < kSlats; ++i) {
    const double x = -0.5 * (size.x() - slat) + i * pitch;
    AddStandingBox({x, 0, size.z() - kBoard_m}, {slat, size.y(), kBoard_m}, wood, builder);
  }
  for (int i = 0; i < kBearers; ++i) {
    const double y = (i - 1) * 0.5 * (size.y() - 0.1);
    AddStandingBox({0, y, 0}, {size.x(), 0.1, size.z() - kBoard_m}, wood, builder);
  }
}

void AddTable(const Vector3d& size, uint32_t top, uint32_t legs, SceneBuilder* builder) {
  constexpr double kTop_m = 0.03;
  AddStandingBox({0, 0, size.z() - kTop_m}, {size.x(), size.y(), kTop_m}, top, builder);
  AddLegs(size - Vector3d(0, 0, kTop_m), 0.05, legs, builder);
}

void AddChair(uint32_t seat, uint32_t legs, SceneBuilder* builder) {
  AddStandingBox({0, 0, 0.43}, {0.44, 0.44, 0.03}, seat, builder);
  AddLegs({0.44, 0.44, 0.43}, 0.035, legs, builder);
  builder->AddBox({-0.2, 0.17, 0.46}, {-0.165, 0.2, 0.9}, legs);
  builder->AddBox({0.165, 0.17, 0.46}, {0.2, 0.2, 0.9}, legs);
  builder->AddBox({-0.165, 0.175, 0.64}, {0.165, 0.195, 0.88}, seat);
}

void AddMonitor(uint32_t screen, uint32_t body, SceneBuilder* builder) {
  AddStandingBox({0, 0, 0}, {0.24, 0.18, 0.015}, body, builder);
  AddStandingBox({0, 0.03, 0.015}, {0.06, 0.03, 0.2}, body, builder);
  AddStandingBox({0, 0, 0.12}, {0.56, 0.03, 0.34}, body, builder);
  builder->AddQuad({-0.265, -0.0205, 0.135}, {0.53, 0, 0}, {0, 0, 0.31}, screen);
  builder->AddBorder({-0.265, -0.0205, 0.135}, {0.53, 0, 0}, {0, 0, 0.31});
}

void AddMachine(const Vector3d& size, uint32_t body, uint32_t metal, uint32_t seed,
                SceneBuilder* builder) {
  std::mt19937 generator(seed);
  const auto any = [&](double low, double high) { return UniformIn(low, high, &generator); };
  const double w = size.x(), d = size.y(), h = size.z();
  const double base = 0.12 * h, body_top = any(0.55, 0.75) * h;
  AddStandingBox({0, 0, 0}, {w, d, base}, metal, builder);
  AddStandingBox({-0.04 * w, 0, base}, {0.86 * w, 0.84 * d, body_top - base}, body, builder);
  const double head = any(0.3, 0.55) * w, x = any(-0.15, 0.15) * w;
  AddStandingBox({x, 0, body_top}, {head, 0.7 * d, h - body_top - 0.02}, body, builder);
  AddStandingBox({x, 0, h - 0.02}, {head + 0.06, 0.75 * d, 0.02}, metal, builder);
  // Hatches and a control panel on the front and the back, and a motor at the side.
  for (const double side : {-1.0, 1.0}) {
    const double hatch = any(0.15, 0.3) * w, left = any(-0.4, -0.1) * w;
    const double low = base + any(0.05, 0.15) * h, high = body_top - any(0.05, 0.1) * h;
    const double face = side * 0.42 * d;
    const auto plate = [&](double x0, double x1, double z0, double z1, double depth) {
      builder->AddBox({x0, std::min(face, face + side * depth), z0},
                      {x1, std::max(face, face + side * depth), z1}, metal);
    };
    plate(left, left + hatch, low, high, 0.012);
    plate(left + hatch + 0.05, left + hatch + 0.05 + 0.2 * w, 0.5 * (low + high), high, 0.06);
    plate(left + 0.3 * hatch, left + 0.7 * hatch, low + 0.05, low + 0.09, 0.04);
  }
  builder->AddCylinder({0.39 * w, 0, base + 0.2 * h}, {0.5 * w, 0, base + 0.2 * h},
                       0.12 * std::min(d, h), metal);
  for (int i = 0; i < 3; ++i) {
    const double px = 0.3 * w - 0.12 * w * i * any(0.7, 1), py = any(-0.3, 0.3) * d;
    builder->AddPipe({px, py, body_top}, {px, py, any(0.85, 1) * h}, 0.04, 8, metal);
  }
}

void AddDrum(double radius, double height, uint32_t metal, SceneBuilder* builder) {
  builder->AddCylinder({0, 0, 0.003}, {0, 0, height}, radius, metal);
  for (const double z : {0.33 * height, 0.66 * height}) {
    builder->AddCylinder({0, 0, z}, {0, 0, z + 0.02}, radius + 0.008, metal);
  }
}

void AddLadder(double width, double length, uint32_t metal, SceneBuilder* builder) {
  constexpr double kRung_m = 0.28;
  for (const double x : {-0.5 * width, 0.5 * width}) {
    AddStandingBox({x, 0, 0}, {0.03, 0.06, length}, metal, builder);
  }
  for (double z = kRung_m; z < length - 0.1; z += kRung_m) {
    AddStandingBox({0, 0, z}, {width - 0.03, 0.035, 0.03}, metal, builder);
  }
}

void AddClutter(const Vector2d& size, double max_side, int count, bool tilted,
                const std::vector<uint32_t>& materials, uint32_t seed, SceneBuilder* builder) {
  std::mt19937 generator(seed);
  const auto any = [&](double low, double high) { return UniformIn(low, high, &generator); };
  const int columns =
      std::max(1, static_cast<int>(std::lround(std::sqrt(count * size.x() / size.y()))));
  const int rows = (count + columns - 1) / columns;
  const Vector2d cell(size.x() / columns, size.y() / rows);
  for (int i = 0; i < count; ++i) {
    // A box whose diagonal fits its cell never meets its neighbours.
    const double side = std::min(max_side, 0.7 * cell.minCoeff());
    const Vector3d box(any(0.35, 1) * side, any(0.35, 1) * side, any(0.3, 1) * max_side);
    const Vector2d middle =
        Vector2d((i % columns + 0.5) * cell.x(), (i / columns + 0.5) * cell.y()) - 0.5 * size;
    const double yaw_rad = any(0, M_PI), tilt_rad = tilted ? any(0.1, 0.6) : 0;
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(tilt_rad, Vector3d::UnitY()))
                                     .toRotationMatrix();
    const Vector3d u = box.x() * turn.col(0), v = box.y() * turn.col(1), w = box.z() * turn.col(2);
    const double lift = std::max(0.0, -u.z()) + 0.002;
    const Vector3d a =
        Vector3d(middle.x(), middle.y(), lift) - 0.5 * (u + v) + Vector3d(0, 0, 0.5 * u.z());
    builder->AddParallelepiped(a, u, v, w, materials[generator() % materials.size()]);
  }
}

void AddPoster(const Vector2d& size, uint32_t seed, SceneBuilder* builder) {
  const uint32_t material = builder->AddMaterial({TextureKind::kPoster, 0.6f, 1.0f, seed});
  const Vector3d a(-0.5 * size.x(), -0.006, 0), u(size.x(), 0, 0), v(0, 0, size.y());
  builder->AddQuad(a, u, v, material);
  builder->AddBorder(a, u, v);
}

void AddTag(const std::string& name, double size, SceneBuilder* builder) {
  const auto tag = ParseTagName(name);
  cv::Ptr<cv::aruco::Dictionary> dictionary;
  if (tag && tag->dictionary >= 0) dictionary = cv::aruco::getPredefinedDictionary(tag->dictionary);
  if (!dictionary || tag->id >= dictionary->bytesList.rows) {
    throw ConfigError(
        fmt::format("name: found '{}', expected a tag such as tag36h11:5; families: {}", name,
                    fmt::join(TagFamilies(), ", ")));
  }
  const double cells = dictionary->markerSize + 2;  // with the black border
  const double side = size * (cells + 2) / cells;   // with the white one
  const Vector3d a(-0.5 * side, -0.006, -0.5 * side), u(side, 0, 0), v(0, 0, side);
  const uint32_t seed =
      static_cast<uint32_t>(tag->dictionary) * kTagsOfFamily + static_cast<uint32_t>(tag->id);
  builder->AddTag(name, a, u, v, builder->AddMaterial({TextureKind::kTag, 0.55f, 1.0f, seed}));
}

void AddBoard(const Vector2d& size, uint32_t face, uint32_t frame, uint32_t seed,
              SceneBuilder* builder) {
  constexpr double kFrame_m = 0.03;
  const double x = 0.5 * size.x(), z = size.y();
  builder->AddQuad({-x, -0.012, 0}, {size.x(), 0, 0}, {0, 0, z}, face);
  builder->AddBox({-x, -0.025, 0}, {-x + kFrame_m, 0, z}, frame);
  builder->AddBox({x - kFrame_m, -0.025, 0}, {x, 0, z}, frame);
  builder->AddBox({-x + kFrame_m, -0.025, 0}, {x - kFrame_m, 0, kFrame_m}, frame);
  builder->AddBox({-x + kFrame_m, -0.025, z - kFrame_m}, {x - kFrame_m, 0, z}, frame);
  const int sheets = std::max(1, static_cast<int>(size.x() / 0.34));
  std::mt19937 generator(seed);
  for (int i = 0; i < sheets; ++i) {
    const double left = -x + 0.06 + i * (size.x() - 0.12) / sheets;
    const double low = UniformIn(0.08, std::max(0.09, z - 0.38), &generator);
    const uint32_t sheet = builder->AddMaterial(
        {TextureKind::kPoster, 0.7f, 1.0f, static_cast<uint32_t>(generator())});
    const Vector3d a(left, -0.018, low), u(0.21, 0, 0), v(0, 0, 0.297);
    builder->AddQuad(a, u, v, sheet);
    builder->AddBorder(a, u, v);
  }
}

void AddCabinet(const Vector3d& size, int doors, uint32_t body, uint32_t metal,
                SceneBuilder* builder) {
  constexpr double kPanel_m = 0.018, kGap_m = 0.006;
  const double x = 0.5 * size.x(), front = -size.y() + kPanel_m;
  builder->AddBox({-x, front, 0}, {x, -0.005, size.z()}, body);
  const double pitch = size.x() / doors;
  for (int i = 0; i < doors; ++i) {
    const double left = -x + i * pitch + kGap_m, right = left + pitch - 2 * kGap_m;
    builder->AddBox({left, -size.y(), 0.06}, {right, front, size.z() - 0.02}, body);
    const double handle = i % 2 == 0 ? right - 0.06 : left + 0.04;
    builder->AddBox({handle, -size.y() - 0.03, 0.5 * size.z()},
                    {handle + 0.02, -size.y(), 0.5 * size.z() + 0.14}, metal);
  }
}

void AddShelf(const Vector3d& size, int boards, uint32_t wood,
              const std::vector<uint32_t>& contents, uint32_t seed, SceneBuilder* builder) {
  constexpr double kBoard_m = 0.025, kBack_m = 0.01;
  std::mt19937 generator(seed);
  const double x = 0.5 * size.x(), clear = size.z() / boards - kBoard_m;
  builder->AddBox({-x, -size.y(), 0}, {-x + kBoard_m, -0.005, size.z()}, wood);
  builder->AddBox({x - kBoard_m, -size.y(), 0}, {x, -0.005, size.z()}, wood);
  builder->AddBox({-x + kBoard_m, -kBack_m, 0}, {x - kBoard_m, -0.005, size.z()}, wood);
  for (int i = 0; i <= boards; ++i) {
    const double low = i * (size.z() - kBoard_m) / boards;
    builder->AddBox({-x + kBoard_m, -size.y() + 0.01, low},
                    {x - kBoard_m, -kBack_m, low + kBoard_m}, wood);
    double left = -x + 0.05;
    while (i < boards && !contents.empty()) {
      const double width = UniformIn(0.04, 0.22, &generator);
      if (left + width > x - 0.05) break;
      const double depth = UniformIn(0.5, 0.85, &generator) * size.y();
      const double height = UniformIn(0.45, 0.9, &generator) * clear;
      const double foot = low + kBoard_m + 0.001;
      builder->AddBox({left, -kBack_m - depth, foot},
                      {left + width, -kBack_m - 0.01, foot + height},
                      contents[generator() % contents.size()]);
      left += width + UniformIn(0.005, 0.12, &generator);
    }
  }
}

void AddRadiator(const Vector3d& size, uint32_t metal, SceneBuilder* builder) {
  constexpr double kPitch_m = 0.1;
  const double x = 0.5 * size.x();
  builder->AddBox({-x, -0.6 * size.y(), 0.02}, {x, -0.35 * size.y(), size.z() - 0.02}, metal);
  const int ribs = static_cast<int>(size.x() / kPitch_m);
  for (int i = 0; i < ribs; ++i) {
    const double left = -x + (i + 0.25) * size.x() / ribs;
    builder->AddBox({left, -size.y(), 0}, {left + 0.5 * kPitch_m, -0.6 * size.y(), size.z()},
                    metal);
  }
  builder->AddPipe({x + 0.04, -0.5 * size.y(), -0.1}, {x + 0.04, -0.5 * size.y(), size.z()}, 0.012,
                   6, metal);
}

void AddExtinguisher(uint32_t body, uint32_t metal, SceneBuilder* builder) {
  builder->AddCylinder({0, -0.1, 0}, {0, -0.1, 0.42}, 0.075, body);
  builder->AddCylinder({0, -0.1, 0.421}, {0, -0.1, 0.5}, 0.025, metal);
  builder->AddBox({-0.02, -0.2, 0.47}, {0.02, -0.07, 0.5}, metal);
  builder->AddBox({-0.05, -0.02, 0.1}, {0.05, 0, 0.4}, metal);
}

void AddPipeRun(const std::vector<Vector3d>& points, double radius, int sides, uint32_t material,
                SceneBuilder* builder) {
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    builder->AddPipe(points[i], points[i + 1], radius, sides, material);
    // A flange over each joint.
    const Vector3d along = (points[i + 1] - points[i]).normalized();
    const double half = 0.4 * radius + 0.02;
    builder->AddCylinder(points[i] - half * along, points[i] + half * along, 1.25 * radius + 0.005,
                         material);
  }
}

void AddRailing(const std::vector<Vector3d>& points, double height, uint32_t material,
                SceneBuilder* builder) {
  const Vector3d up(0, 0, height);
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const Vector3d from = points[i], way = points[i + 1] - from;
    builder->AddBar(from + up, from + way + up, 0.045, material);
    builder->AddBar(from + 0.55 * up, from + way + 0.55 * up, 0.03, material);
    const int posts = std::max(1, static_cast<int>(std::ceil(way.norm() / 1.0)));
    for (int k = i == 0 ? 0 : 1; k <= posts; ++k) {
      const Vector3d foot = from + way * k / posts;
      builder->AddBox(foot - Vector3d(0.018, 0.018, 0), foot + up + Vector3d(0.018, 0.018, -0.02),
                      material);
    }
  }
}

void AddCable(const Vector3d& from, const Vector3d& to, double sag, double radius,
              uint32_t material, SceneBuilder* builder) {
  constexpr int kPieces = 12;
  const auto at = [&](int i) {
    const double s = static_cast<double>(i) / kPieces;
    return Vector3d(from + s * (to - from) - Vector3d(0, 0, 4 * sag * s * (1 - s)));
  };
  for (int i = 0; i < kPieces; ++i) builder->AddRoundBar(at(i), at(i + 1), radius, 5, material);
}

void AddStairs(int steps, double rise, double run, double width, uint32_t step, uint32_t side,
               SceneBuilder* builder) {
  constexpr double kBoard_m = 0.04, kNose_m = 0.03, kTread_m = 0.035;
  const double y = 0.5 * width;
  for (int i = 0; i < steps; ++i) {
    const double x = i * run, z = i * rise;
    builder->AddQuad({x, -y, z}, {0, width, 0}, {0, 0, rise}, step);
    builder->AddBox({x - kNose_m, -y, z + rise - kTread_m}, {x + run, y, z + rise}, step);
    builder->AddEdge({x, -y, z}, {x, y, z});
  }
  const Vector3d way(steps * run, 0, steps * rise), up(0, 0, rise + 0.2);
  for (const double left : {-y - kBoard_m, y}) {
    builder->AddParallelepiped({0, left, -0.15}, way, {0, kBoard_m, 0}, up, side);
  }
  builder->AddQuad({0, -y, -0.12}, {0, width, 0}, way, side);
}

void AddCeilingLamp(const Vector2d& size, double radiance, uint32_t lamp, uint32_t housing,
                    SceneBuilder* builder) {
  constexpr double kRim_m = 0.03, kHeight_m = 0.07;
  const double x = 0.5 * size.x(), y = 0.5 * size.y();
  builder->AddBox({-x, -y, -kHeight_m}, {x, y, -0.002}, housing);
  const Vector3d a(-x + kRim_m, y - kRim_m, -kHeight_m - 0.006);
  const Vector3d u(size.x() - 2 * kRim_m, 0, 0), v(0, -size.y() + 2 * kRim_m, 0);
  builder->AddLamp(a, u, v, static_cast<float>(radiance), lamp);
  builder->AddBorder(a, u, v);
}

}  // namespace slcmap::data
