#include "apps/pose_options.h"

namespace slcmap {

std::vector<CLI::Option*> AddPoseOptions(CLI::App& command, PoseForm* form) {
  return {
      command
          .add_option("--poses-of", form->of,
                      "What each row is the pose of: imu or camera (the left one) in the world, or "
                      "the inverse: world-in-imu, world-in-camera")
          ->capture_default_str(),
      command.add_option("--quaternion", form->quaternion,
                         "Order of the quaternions: xyzw or wxyz, with -conjugated behind it for "
                         "inverse rotations (default: as the form of the file has it)"),
      command
          .add_option("--up", form->up,
                      "Where up is in the world of the poses: z, -z, y, -y, x, -x, or x,y,z")
          ->capture_default_str(),
      command.add_option("--poses-scale", form->scale, "Metres a unit of the poses' positions")
          ->capture_default_str(),
      command.add_option("--poses-stamps", form->stamps,
                         "Unit of the poses' stamps: ns, us, ms or s; or a file with the stamp of "
                         "each row (default: told by their size)"),
      command.add_option("--poses-offset", form->offset_s, "Added to the poses' stamps [s]")
          ->capture_default_str()};
}

}  // namespace slcmap
