// Whether what the images show agrees with the calibration and the IMU.
#include <algorithm>

#include "data/calibration.h"
#include "data/check/check.h"

namespace slcmap {

void CheckGeometry(const SequenceSource& source, const std::vector<ImuSample>& samples,
                   const Progress& progress, CheckReport* report) {
  const Rig& rig = source.info().rig;
  if (IsStereo(rig)) {
    CheckStereo(source, progress.Part(0, 0.4), report);
    // Without images that say better, what the calibration says by itself.
    if (report->Usable()) CheckStereoRig(rig, report);
  }
  // An IMU, or a calibration, that is known to be wrong explains nothing.
  if (!report->Usable()) return;
  CheckClock(source, Corrected(rig, *report), samples, progress.Part(0.4, 0.4), report);
  if (!report->Usable()) return;
  CheckMotion(source, Corrected(rig, *report), samples, progress.Part(0.4, 1), report);
}

}  // namespace slcmap
