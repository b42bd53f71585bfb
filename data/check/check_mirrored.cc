// Which axes of a mirrored rotation are wrong, by the images' turns.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <vector>

#include "data/check/check.h"
#include "data/check/image_motion.h"
#include "data/check/turn_alignment.h"
#include "data/error.h"
#include "data/source/asl_source.h"

namespace slcmap {
namespace {

// In words, such as "x negated"; "" where the turns do not tell.
std::string MirroredAxes(const TurnAlignment& turns) {
  if (!turns.enough_motion || turns.best.unexplained > kExplained) return "";
  if (turns.best.change.IsNone()) return "";  // of the left camera, which is right
  // With all axes negated it is a rotation, and its axes are changed by -mirror.
  const Eigen::Matrix3d mirror = -turns.best.change.matrix;
  const auto& changes = AxisChanges();
  const auto found = std::find_if(changes.begin(), changes.end(), [&](const AxisChange& change) {
    return (change.matrix - mirror).cwiseAbs().maxCoeff() < 0.5;
  });
  return found == changes.end() ? "" : found->words;
}

}  // namespace

void CheckMirrored(const std::string& path, SequenceOptions options, const Progress& progress,
                   CheckFinding* finding) {
  options.mirrored = Mirrored::kNegated;
  try {
    const auto source = OpenSource(path, options);
    const std::vector<ImuSample> samples = AllSamples(source.get());
    Rig rig = source->info().rig;
    rig.cameras[1] = Camera();  // where it is against the left one is not known
    const auto parts = LiveliestParts(source->info(), samples, kLookedAt_s);
    const std::string words =
        MirroredAxes(AlignTurns(FollowImages(*source, rig, parts, progress).turns, samples,
                                rig.T_imu_camera[0].rotation, rig.camera_time_offset_s));
    if (words.empty()) return;
    finding->found +=
        fmt::format("; by the images' turns it has the IMU's axes changed: {}", words);
    finding->remedy += fmt::format(
        ", or change the rows of the rotation of T_BS or T_imu_cam (columns of T_cam_imu) back: {}",
        words);
  } catch (const DataError&) {
    // What else is wrong with the recording is told once this is mended.
  }
}

}  // namespace slcmap
