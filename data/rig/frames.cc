#include "data/rig/frames.h"

#include <cmath>
#include <deque>
#include <vector>

namespace slcmap::inline data {
namespace {

constexpr double kFixed_m = 1e-4, kFixed_rad = 1e-4;  // beyond, frames move
constexpr int kMostMoving = 5000;                     // messages of /tf

bool AreSame(const RigidTransform& a, const RigidTransform& b) {
  const RigidTransform difference = a.Inverse() * b;
  return difference.translation.norm() < kFixed_m &&
         LogRotation(difference.rotation).norm() < kFixed_rad;
}

void ReadFrames(bool are_fixed, int most, Bag* bag, FrameTree* frames) {
  std::vector<uint32_t> chosen;
  for (uint32_t i = 0; i < bag->topics().size(); ++i) {
    const BagTopic& topic = bag->topics()[i];
    const bool is_tf = topic.type == RosTransforms::kType || topic.type == "tf/tfMessage";
    if (is_tf && topic.name.ends_with("tf_static") == are_fixed) chosen.push_back(i);
  }
  if (chosen.empty()) return;
  int seen = 0;
  bag->Visit(chosen, 0, [&](const BagPlace& place, BagBytes bytes) {
    try {
      const BagEncoding encoding = bag->topics()[place.topic].encoding;
      for (const auto& transform : DecodeMessage<RosTransforms>(encoding, bytes).transforms) {
        frames->Add(transform, are_fixed);
      }
    } catch (const DataError&) {  // others may tell the same
    }
    return ++seen < most;
  });
}

}  // namespace

std::string PlainFrame(const std::string& frame_id) {
  return frame_id.starts_with('/') ? frame_id.substr(1) : frame_id;
}

std::optional<RigidTransform> FromRos(const RosTransform& transform) {
  constexpr double kMaxError = 1e-2;
  const auto& q = transform.rotation_xyzw;
  const auto& t = transform.translation_m;
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  const Eigen::Vector3d translation(t[0], t[1], t[2]);
  if (!(std::abs(rotation.norm() - 1) < kMaxError) || !translation.allFinite()) return std::nullopt;
  return RigidTransform(rotation.normalized(), translation);
}

void FrameTree::Add(const RosTransformStamped& transform, bool is_fixed) {
  const auto T_parent_child = FromRos(transform.transform);
  if (!T_parent_child) return;
  const std::string parent = PlainFrame(transform.frame_id);
  const std::string child = PlainFrame(transform.child_frame_id);
  frames_.insert(parent);
  frames_.insert(child);
  const auto [edge, is_new] = edges_.try_emplace({parent, child}, Edge{*T_parent_child});
  if (is_new || is_fixed || AreSame(edge->second.T_parent_child, *T_parent_child)) return;
  edge->second.moves = true;
}

std::optional<RigidTransform> FrameTree::Find(const std::string& to,
                                              const std::string& from) const {
  const std::string goal = PlainFrame(from);
  std::map<std::string, RigidTransform> reached = {{PlainFrame(to), RigidTransform()}};
  std::deque<std::string> next = {PlainFrame(to)};
  while (!next.empty() && reached.count(goal) == 0) {
    const std::string frame = next.front();
    next.pop_front();
    const auto reach = [&](const std::string& other, const RigidTransform& T_frame_other) {
      if (reached.try_emplace(other, reached.at(frame) * T_frame_other).second) {
        next.push_back(other);
      }
    };
    for (const auto& [names, edge] : edges_) {
      if (edge.moves) continue;
      if (names.first == frame) reach(names.second, edge.T_parent_child);
      if (names.second == frame) reach(names.first, edge.T_parent_child.Inverse());
    }
  }
  const auto found = reached.find(goal);
  return found == reached.end() ? std::nullopt : std::optional(found->second);
}

Warnings FrameTree::warnings() const {
  Warnings warnings;
  std::map<std::string, std::string> parents;
  for (const auto& [names, edge] : edges_) {
    const auto [parent, is_new] = parents.try_emplace(names.second, names.first);
    if (is_new) continue;
    warnings.Add(kManyParents, names.second + " of " + parent->second + " and " + names.first);
  }
  return warnings;
}

void ReadFixedFrames(Bag* bag, FrameTree* frames) {
  constexpr int kMostFixed = 100'000;
  ReadFrames(true, kMostFixed, bag, frames);
}

void ReadMovingFrames(Bag* bag, FrameTree* frames) { ReadFrames(false, kMostMoving, bag, frames); }

}  // namespace slcmap::data
