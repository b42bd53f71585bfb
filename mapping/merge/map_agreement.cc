#include "mapping/merge/map_agreement.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "mapping/cube_grid.h"

namespace slcmap {
namespace {

constexpr double kCell_m = 0.4;                      // of the index
constexpr double kFacing = 0.8;                      // cosine between normals of one surface
constexpr double kParallel = 0.995;                  // cosine between lines that are one
constexpr double kBeside_m = 0.3;                    // along a surface or line, to the next sample
constexpr double kSurface_m = 0.08, kLine_m = 0.04;  // across, of what agrees
constexpr double kSurfaceSample_m2 = kSurfaceSample_m * kSurfaceSample_m;

// Whether all around a place is known to be free, so that no surface is near.
bool IsFreeAround(const OccupancyMap& occupancy, const Eigen::Vector3d& p) {
  const double step_m = occupancy.resolution_m();
  for (int i = 0; i < kCubesAround; ++i) {
    const Eigen::Vector3d offset = CubeAround({0, 0, 0}, i).cast<double>();
    if (!occupancy.IsFree(p + step_m * offset)) return false;
  }
  return true;
}

bool IsKnown(const OccupancyMap& occupancy, const Eigen::Vector3d& p) {
  return occupancy.IsFree(p) || occupancy.IsOccupied(p);
}

}  // namespace

// Which samples are in a cell or beside it: they are asked for more often than they are added.
struct FeatureIndex::Cells {
  std::unordered_map<int64_t, std::vector<int>> near;

  void Add(const Eigen::Vector3d& p, int sample) {
    const Eigen::Vector3i cell = CubeOf(p, kCell_m);
    for (int i = 0; i < kCubesAround; ++i) near[KeyOf(CubeAround(cell, i))].push_back(sample);
  }

  template <typename Visit>
  void ForEachNear(const Eigen::Vector3d& p, const Visit& visit) const {
    const auto found = near.find(KeyOf(CubeOf(p, kCell_m)));
    if (found == near.end()) return;
    for (const int sample : found->second) visit(sample);
  }
};

FeatureIndex::FeatureIndex(const AlignmentFeatures& features)
    : features_(features), surfaces_(std::make_unique<Cells>()), lines_(std::make_unique<Cells>()) {
  for (std::size_t i = 0; i < features.surfaces.size(); ++i) {
    surfaces_->Add(features.surfaces[i].p_world, static_cast<int>(i));
  }
  for (std::size_t i = 0; i < features.lines.size(); ++i) {
    lines_->Add(features.lines[i].p_world, static_cast<int>(i));
  }
}

FeatureIndex::~FeatureIndex() = default;

const SurfaceSample* FeatureIndex::SurfaceNear(const Eigen::Vector3d& p,
                                               const Eigen::Vector3d& normal,
                                               double reach_m) const {
  const SurfaceSample* nearest = nullptr;
  double least_m = 1e9;
  surfaces_->ForEachNear(p, [&](int i) {
    const SurfaceSample& sample = features_.surfaces[i];
    if (sample.normal_world.dot(normal) < kFacing) return;
    const Eigen::Vector3d way = p - sample.p_world;
    const double across_m = std::abs(way.dot(sample.normal_world)), distance_m = way.norm();
    if (across_m > reach_m || distance_m > std::hypot(kBeside_m, across_m)) return;
    if (distance_m >= least_m) return;
    least_m = distance_m;
    nearest = &sample;
  });
  return nearest;
}

const LinePlace* FeatureIndex::LineNear(const Eigen::Vector3d& p, const Eigen::Vector3d& direction,
                                        double reach_m) const {
  const LinePlace* nearest = nullptr;
  double least_m = 1e9;
  lines_->ForEachNear(p, [&](int i) {
    const LinePlace& place = features_.lines[i];
    if (std::abs(place.direction_world.dot(direction)) < kParallel) return;
    const Eigen::Vector3d way = p - place.p_world;
    const double along_m = way.dot(place.direction_world);
    const double across_m = (way - along_m * place.direction_world).norm();
    if (across_m > reach_m || std::abs(along_m) > kBeside_m || across_m >= least_m) return;
    least_m = across_m;
    nearest = &place;
  });
  return nearest;
}

double MapAgreement::surfaces_m2() const {
  return kSurfaceSample_m2 *
         static_cast<double>(std::count(surfaces.begin(), surfaces.end(), Answer::kAgrees));
}

double MapAgreement::lines_m() const {
  return kLinePlace_m *
         static_cast<double>(std::count(lines.begin(), lines.end(), Answer::kAgrees));
}

double MapAgreement::agreeing_share() const {
  const auto count = [&](Answer answer) {
    return static_cast<double>(std::count(surfaces.begin(), surfaces.end(), answer));
  };
  const double agreeing = count(Answer::kAgrees);
  const double known = agreeing + count(Answer::kDiffers) + count(Answer::kContradicts);
  return known > 0 ? agreeing / known : 0;
}

double MapAgreement::contradiction() const {
  const auto count = [&](Answer answer) {
    return static_cast<double>(std::count(surfaces.begin(), surfaces.end(), answer));
  };
  const double contradicted = count(Answer::kContradicts) + first_contradicted;
  const double all = contradicted + count(Answer::kAgrees) + first_agreeing;
  return all > 0 ? contradicted / all : 0;
}

namespace {

Answer AnswerTo(const SurfaceSample& sample, const ComparedMap& map, const RigidTransform& T) {
  const Eigen::Vector3d p = T * sample.p_world, normal = T.rotation * sample.normal_world;
  if (map.index.SurfaceNear(p, normal, kSurface_m)) return Answer::kAgrees;
  if (!IsKnown(map.occupancy, p)) return Answer::kUnknown;
  return IsFreeAround(map.occupancy, p) ? Answer::kContradicts : Answer::kDiffers;
}

Answer AnswerTo(const LinePlace& place, const ComparedMap& map, const RigidTransform& T) {
  const Eigen::Vector3d p = T * place.p_world, direction = T.rotation * place.direction_world;
  if (map.index.LineNear(p, direction, kLine_m)) return Answer::kAgrees;
  if (!IsKnown(map.occupancy, p)) return Answer::kUnknown;
  return IsFreeAround(map.occupancy, p) ? Answer::kContradicts : Answer::kDiffers;
}

}  // namespace

MapAgreement Compare(const ComparedMap& first, const ComparedMap& second,
                     const RigidTransform& T_first_second) {
  MapAgreement agreement;
  for (const SurfaceSample& sample : second.features.surfaces) {
    agreement.surfaces.push_back(AnswerTo(sample, first, T_first_second));
  }
  for (const LinePlace& place : second.features.lines) {
    agreement.lines.push_back(AnswerTo(place, first, T_first_second));
  }
  const RigidTransform T_second_first = T_first_second.Inverse();
  for (const SurfaceSample& sample : first.features.surfaces) {
    const Answer answer = AnswerTo(sample, second, T_second_first);
    agreement.first_contradicted += answer == Answer::kContradicts;
    agreement.first_agreeing += answer == Answer::kAgrees;
  }
  return agreement;
}

Telling WhatTells(const MapAgreement& best, const MapAgreement& rival) {
  Telling telling;
  const auto add = [](const std::vector<Answer>& of_best, const std::vector<Answer>& of_rival,
                      double weight, Telling* sum) {
    for (std::size_t i = 0; i < of_best.size(); ++i) {
      if (of_best[i] == Answer::kUnknown || of_rival[i] == Answer::kUnknown) continue;
      const bool in_best = of_best[i] == Answer::kAgrees, in_rival = of_rival[i] == Answer::kAgrees;
      sum->for_best += in_best && !in_rival ? weight : 0;
      sum->for_rival += in_rival && !in_best ? weight : 0;
    }
  };
  add(best.surfaces, rival.surfaces, kSurfaceSample_m2, &telling);
  add(best.lines, rival.lines, kLinePlace_m, &telling);
  return telling;
}

}  // namespace slcmap
