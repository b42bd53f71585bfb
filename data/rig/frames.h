// Frames of a recording and how they stand to each other (tf).
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "data/bag/bag.h"
#include "data/bag/messages.h"
#include "data/core/error.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline data {

inline constexpr const char* kManyParents = "frames_with_several_parents";

// Without the "/" that some drivers write before it.
std::string PlainFrame(const std::string& frame_id);

class FrameTree {
 public:
  // Of one pair of frames the first counts; where a later one differs, the two move against each
  // other and lead nowhere, unless they are said to be fixed.
  void Add(const RosTransformStamped& transform, bool is_fixed);

  bool Has(const std::string& frame) const { return frames_.count(PlainFrame(frame)) > 0; }

  // Takes points of the frame `from` to the frame `to` over the fewest frames between; nothing
  // where nothing fixed leads there.
  std::optional<RigidTransform> Find(const std::string& to, const std::string& from) const;

  // Frames with several parents are counted.
  Warnings warnings() const;

 private:
  struct Edge {
    RigidTransform T_parent_child;
    bool moves = false;
  };
  std::map<std::pair<std::string, std::string>, Edge> edges_;  // by parent and child
  std::set<std::string> frames_;
};

// Adds what is in /tf_static of all names; or in /tf, its first thousands of messages.
void ReadFixedFrames(Bag* bag, FrameTree* frames);
void ReadMovingFrames(Bag* bag, FrameTree* frames);

// Of a transform as ROS has it; nothing where its quaternion is none.
std::optional<RigidTransform> FromRos(const RosTransform& transform);

}  // namespace slcmap::data
