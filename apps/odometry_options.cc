#include "apps/odometry_options.h"

#include "apps/sequence_options.h"

namespace slcmap {

void AddOdometryOptions(CLI::App& command, OdometryArguments* arguments) {
  command
      .add_option("sequence", arguments->sequence,
                  "EuRoC (ASL) or TUM VI folder: the one with cam0, cam1, imu0, or the one above; "
                  "points-mono needs no cam1")
      ->required();
  command.add_option("--method", arguments->method,
                     "slc (default: points, structural lines, points on lines), structural, "
                     "points-lines, points or points-mono (left camera only)");
  command.add_option("--config", arguments->config, "YAML file that overrides options");
  AddSequenceOptions(command, &arguments->opened);
  command.add_option("--write-calibration", arguments->write_calibration,
                     "Write the calibration as it was found to this file, a Kalibr camera chain");
  command.add_option("--from", arguments->part.from_s,
                     "Start so many seconds after the first image");
  command.add_option("--duration", arguments->part.duration_s,
                     "Seconds of the recording to use; 0: to the end");
  command
      .add_option(
          "--threads", arguments->threads,
          "Threads, beside the one that reads ahead: 1 does everything one after the other; "
          "with 2, points and lines, and window and next image go side by side; more are "
          "not used. Same results with any")
      ->capture_default_str();
  command.add_flag("--force", arguments->start.force,
                   "Go on in spite of errors that the check before the start finds");
  command.add_flag("!--no-check", arguments->start.check,
                   "Start as calibrated, without the check of IMU, calibration and geometry that "
                   "finds the time offset and the right camera's turn");
  command.add_flag(
      "--realtime", arguments->real_time,
      "Play the recording at its own pace; images are skipped where newer ones are due");
}

}  // namespace slcmap
