#include <algorithm>
#include <cmath>

#include "data/simulator/scene/scene_parts.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kProud_m = 0.02;        // frames stand out of the wall
constexpr double kFrameWidth_m = 0.06;   // on the wall beside the opening
constexpr double kFrameInside_m = 0.02;  // within the opening
constexpr double kSkirtingDepth_m = 0.015;

// One straight piece: x along it, y out of its front, z up.
struct Segment {
  double length;
  bool turns_at_start, turns_at_end;
  std::vector<WallOpening> openings;  // sorted along
};

struct Span {
  double from, to;
};

// The parts of the segment beside its openings down to the floor, frames included.
std::vector<Span> SpansBesideDoors(const Segment& segment, double frame) {
  std::vector<Span> spans;
  double from = 0;
  for (const WallOpening& opening : segment.openings) {
    if (opening.sill > 0) continue;
    spans.push_back({from, opening.along - frame});
    from = opening.along + opening.width + frame;
  }
  spans.push_back({from, segment.length});
  return spans;
}

void AddFacePart(const Span& span, double low, double high, double length, bool front, double y,
                 uint32_t material, SceneBuilder* builder) {
  if (span.to - span.from < 1e-6 || high - low < 1e-6) return;
  const Vector3d size(span.to - span.from, 0, high - low);
  if (front) {
    builder->AddQuad({span.to, y, low}, {-size.x(), 0, 0}, {0, 0, size.z()}, material,
                     {length - span.to, low});
  } else {
    builder->AddQuad({span.from, y, low}, {size.x(), 0, 0}, {0, 0, size.z()}, material,
                     {span.from, low});
  }
}

// A face with its openings cut out, and its long edges.
void AddFace(const WallSpec& spec, const Segment& segment, bool front, SceneBuilder* builder) {
  const double y = front ? 0 : -spec.thickness;
  const auto part = [&](Span span, double low, double high) {
    AddFacePart(span, low, high, segment.length, front, y, spec.material, builder);
  };
  double from = 0;
  for (const WallOpening& opening : segment.openings) {
    const double to = opening.along + opening.width;
    part({from, opening.along}, 0, spec.height);
    part({opening.along, to}, 0, opening.sill);
    part({opening.along, to}, opening.sill + opening.height, spec.height);
    from = to;
  }
  part({from, segment.length}, 0, spec.height);
  builder->AddEdge({0, y, spec.height}, {segment.length, y, spec.height});
  for (const Span& span : SpansBesideDoors(segment, kFrameWidth_m)) {
    builder->AddEdge({span.from, y, 0}, {span.to, y, 0});
  }
  if (segment.turns_at_start) builder->AddEdge({0, y, 0}, {0, y, spec.height});
  if (segment.turns_at_end) {
    builder->AddEdge({segment.length, y, 0}, {segment.length, y, spec.height});
  }
}

void AddEnd(const WallSpec& spec, double x, bool at_start, SceneBuilder* builder) {
  const double t = spec.thickness;
  const Vector3d up(0, 0, spec.height);
  if (at_start) {
    builder->AddQuad({x, 0, 0}, {0, -t, 0}, up, spec.material);
  } else {
    builder->AddQuad({x, -t, 0}, {0, t, 0}, up, spec.material);
  }
  builder->AddBorder({x, -t, 0}, {0, t, 0}, up);
}

// A board along the foot of the wall: front and top, and the edges of its top.
void AddSkirting(const WallSpec& spec, const Segment& segment, bool front, SceneBuilder* builder) {
  const double wall_y = front ? 0 : -spec.thickness;
  const double y = front ? kSkirtingDepth_m : -spec.thickness - kSkirtingDepth_m;
  const double h = spec.skirting_height;
  for (const Span& span : SpansBesideDoors(segment, kFrameWidth_m)) {
    if (span.to - span.from < 0.01) continue;
    AddFacePart(span, 0, h, segment.length, front, y, spec.skirting, builder);
    builder->AddQuad({span.from, std::min(y, wall_y), h}, {span.to - span.from, 0, 0},
                     {0, kSkirtingDepth_m, 0}, spec.skirting);
    builder->AddEdge({span.from, y, h}, {span.to, y, h});
    builder->AddEdge({span.from, wall_y, h}, {span.to, wall_y, h});
    builder->AddEdge({span.from, y, 0}, {span.to, y, 0});
  }
}

// The sides of the opening through the wall, and a frame of bars around it on three or four sides.
void AddFrame(const WallSpec& spec, const WallOpening& opening, SceneBuilder* builder) {
  const double x0 = opening.along, x1 = x0 + opening.width;
  const double z0 = opening.sill, z1 = z0 + opening.height;
  const double back = -spec.thickness - kProud_m;
  const double foot = opening.is_door ? z0 : z0 - kFrameWidth_m;
  builder->AddBox({x0 - kFrameWidth_m, back, foot},
                  {x0 + kFrameInside_m, kProud_m, z1 + kFrameWidth_m}, spec.frame);
  builder->AddBox({x1 - kFrameInside_m, back, foot},
                  {x1 + kFrameWidth_m, kProud_m, z1 + kFrameWidth_m}, spec.frame);
  builder->AddBox({x0 + kFrameInside_m, back, z1 - kFrameInside_m},
                  {x1 - kFrameInside_m, kProud_m, z1 + kFrameWidth_m}, spec.frame);
  if (opening.is_door) return;
  builder->AddBox({x0 + kFrameInside_m, back, z0 - kFrameWidth_m},
                  {x1 - kFrameInside_m, 3 * kProud_m, z0 + kFrameInside_m}, spec.frame);
}

bool IsClear(const WallSpec& spec, const WallOpening& opening) {
  return spec.clear_glass && !opening.is_door && opening.radiance == 0;
}

// What is true of a face as a whole.
SceneWallFace MakeFace(const WallSpec& spec, const Segment& segment, bool front,
                       const std::vector<int>& opening_ids) {
  constexpr double kOpen_deg = 20;
  SceneWallFace face;
  const double y = front ? 0 : -spec.thickness;
  face.foot_world = {0, y, 0};
  face.end_world = {segment.length, y, 0};
  face.normal = {0, front ? 1.0 : -1.0, 0};
  face.height_m = spec.height;
  face.thickness_m = spec.thickness;
  face.is_solid = !front || spec.is_solid;
  for (size_t i = 0; i < segment.openings.size(); ++i) {
    const WallOpening& opening = segment.openings[i];
    const double frame = kFrameInside_m, low = opening.is_door ? 0 : frame;
    face.openings.push_back(
        {opening_ids[i], opening.is_door, opening.is_door && opening.open_deg >= kOpen_deg,
         IsClear(spec, opening), opening.along + frame, opening.along + opening.width - frame,
         opening.sill + low, opening.sill + opening.height - frame});
  }
  return face;
}

// In the frame of its hinge: x along the closed leaf, its front at y = 0.
void AddLeaf(const WallSpec& spec, double width, double height, SceneBuilder* builder) {
  builder->AddBox({0, -0.04, 0.008}, {width, 0, height}, spec.leaf);
  for (const double side : {1.0, -1.0}) {
    const double face = side > 0 ? 0 : -0.04;
    const auto box = [&](Vector3d a, Vector3d b) {
      builder->AddBox(a.cwiseMin(b), a.cwiseMax(b), spec.metal);
    };
    box({width - 0.1, face, 0.95}, {width - 0.05, face + side * 0.008, 1.15});
    box({width - 0.19, face + side * 0.04, 1.04}, {width - 0.065, face + side * 0.055, 1.06});
    box({width - 0.085, face + side * 0.008, 1.04}, {width - 0.065, face + side * 0.04, 1.06});
  }
}

Eigen::Isometry3d ComputeHinge(const WallSpec& spec, const WallOpening& opening) {
  Eigen::Isometry3d segment_leaf = Eigen::Isometry3d::Identity();
  const double depth = opening.open_deg > 0 ? spec.thickness + 0.025 : 0.05;
  segment_leaf.translation() << opening.along + kFrameInside_m + 0.004, -depth, opening.sill;
  segment_leaf.rotate(Eigen::AngleAxisd(-opening.open_deg * M_PI / 180, Vector3d::UnitZ()));
  return segment_leaf;
}

// Two panes of glass in a cross of bars; daylight shines out of the wall's front.
void AddPanes(const WallSpec& spec, const WallOpening& opening, SceneBuilder* builder) {
  const double x0 = opening.along + kFrameInside_m, x1 = opening.along + opening.width;
  const double z0 = opening.sill + kFrameInside_m, z1 = opening.sill + opening.height;
  const double y = -0.6 * spec.thickness;
  const Vector3d a(x1 - kFrameInside_m, y, z0);
  const Vector3d u(x0 - a.x(), 0, 0), v(0, 0, z1 - kFrameInside_m - z0);
  if (IsClear(spec, opening)) {
    builder->AddPane(a, u, v);
  } else {
    if (opening.radiance > 0) {
      builder->AddLamp(a, u, v, static_cast<float>(opening.radiance), spec.daylight);
    } else {
      builder->AddQuad(a, u, v, spec.glass);
    }
    builder->AddBorder(a, u, v);  // where it meets its frame
  }
  const int bars = std::max(1, static_cast<int>(std::lround(opening.width / 0.8)) - 1);
  for (int i = 1; i <= bars; ++i) {
    const double x = x0 + (a.x() - x0) * i / (bars + 1);
    builder->AddBox({x - 0.025, y - 0.02, z0}, {x + 0.025, y + 0.03, z0 + v.z()}, spec.frame);
  }
  const double z = z0 + 0.62 * v.z();
  builder->AddBox({x0, y - 0.018, z - 0.02}, {a.x(), y + 0.028, z + 0.02}, spec.frame);
}

Segment GetSegment(const WallSpec& spec, int index) {
  const int n = static_cast<int>(spec.points.size());
  const auto direction = [&](int i) -> Vector2d {
    return (spec.points[(i + 1) % n] - spec.points[i % n]).normalized();
  };
  const auto turns = [&](int i, int j) { return direction(i).dot(direction(j)) < 1 - 1e-9; };
  Segment segment;
  segment.length = (spec.points[(index + 1) % n] - spec.points[index]).norm();
  segment.turns_at_start =
      spec.closed ? turns(index + n - 1, index) : index > 0 && turns(index - 1, index);
  segment.turns_at_end =
      spec.closed ? turns(index, index + 1) : index + 2 < n && turns(index, index + 1);
  for (const WallOpening& opening : spec.openings) {
    if (opening.segment == index) segment.openings.push_back(opening);
  }
  std::sort(segment.openings.begin(), segment.openings.end(),
            [](const WallOpening& a, const WallOpening& b) { return a.along < b.along; });
  return segment;
}

Eigen::Isometry3d FindPlace(const WallSpec& spec, int index) {
  const Vector2d from = spec.points[index];
  const Vector2d way = spec.points[(index + 1) % spec.points.size()] - from;
  Eigen::Isometry3d wall_segment = Eigen::Isometry3d::Identity();
  wall_segment.translation() << from, 0;
  wall_segment.rotate(Eigen::AngleAxisd(std::atan2(way.y(), way.x()), Vector3d::UnitZ()));
  return wall_segment;
}

// The bodies of the openings in the order of the segment's.
void AddSegment(const WallSpec& spec, const Segment& segment,
                const std::vector<int>& opening_bodies, SceneBuilder* builder) {
  std::vector<int> opening_ids;
  for (size_t i = 0; i < segment.openings.size(); ++i) {
    opening_ids.push_back(builder->NewOpening());
  }
  for (const bool front : {true, false}) {
    if (!front && !spec.has_back) continue;
    if (spec.is_told) builder->AddWallFace(MakeFace(spec, segment, front, opening_ids));
    AddFace(spec, segment, front, builder);
    if (spec.skirting_height > 0) AddSkirting(spec, segment, front, builder);
  }
  if (spec.has_back && !spec.closed) {
    if (!segment.turns_at_start) AddEnd(spec, 0, true, builder);
    if (!segment.turns_at_end) AddEnd(spec, segment.length, false, builder);
  }
  for (size_t i = 0; i < segment.openings.size(); ++i) {
    builder->SetBody(opening_bodies[i]);
    AddFrame(spec, segment.openings[i], builder);
    if (!segment.openings[i].is_door) AddPanes(spec, segment.openings[i], builder);
  }
}

}  // namespace

void AddWall(const WallSpec& spec, const Eigen::Isometry3d& wing_object, int wing,
             SceneBuilder* builder) {
  const int n = static_cast<int>(spec.points.size());
  for (int index = 0; index < (spec.closed ? n : n - 1); ++index) {
    const Segment segment = GetSegment(spec, index);
    const Eigen::Isometry3d wing_segment = wing_object * FindPlace(spec, index);
    builder->SetPlacement(wing, wing_segment);
    std::vector<int> opening_bodies;
    for (const WallOpening& opening : segment.openings) {
      opening_bodies.push_back(builder->AddBody(opening.is_door ? "door" : "window", true));
    }
    builder->AddBody("wall", false);
    AddSegment(spec, segment, opening_bodies, builder);
    for (size_t i = 0; i < segment.openings.size(); ++i) {
      const WallOpening& opening = segment.openings[i];
      if (!opening.is_door || !spec.has_leaf) continue;
      builder->SetBody(opening_bodies[i]);
      builder->SetPlacement(wing, wing_segment * ComputeHinge(spec, opening));
      AddLeaf(spec, opening.width - 2 * kFrameInside_m - 0.008,
              opening.height - kFrameInside_m - 0.004, builder);
    }
  }
}

}  // namespace slcmap::data
