// A recording as it was written down, in a folder or in a bag, before anything is judged: what a
// Sequence is made of, and what is written where a recording is converted.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/image.h"
#include "data/source/asl_files.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

class RecordingTables {
 public:
  virtual ~RecordingTables() = default;

  virtual const std::string& place() const = 0;  // the folder with cam0 and imu0, or the bag
  virtual std::string form() const = 0;          // such as "ASL folder"
  virtual std::vector<int> cameras() const = 0;  // 0 of "cam0"; of a bag 0 is the left one
  virtual SharedImageStore images() const = 0;

  // Where images of a camera, or the samples ("imu0"), are listed, for messages.
  virtual std::string NameTable(const std::string& sensor) const = 0;

  // Rows that cannot be read are counted. Paths of images are below place(), and known to images().
  virtual TableRows<ImageFile> ReadImages(int camera, Warnings* warnings) const = 0;
  // Throws InputFault where there are none.
  virtual TableRows<ImuRow> ReadImu(Warnings* warnings) const = 0;

  // The recording's own. Throws InputFault where it has none.
  virtual Calibration FindCalibration(const SequenceOptions& options,
                                      const std::vector<int>& cameras,
                                      Warnings* warnings) const = 0;

  virtual std::string topics() const { return ""; }  // of a bag, as --topics names them
};

// What `path` is, as OpenSequence takes it; throws as that.
std::unique_ptr<RecordingTables> OpenTables(const std::string& path,
                                            const SequenceOptions& options);

std::unique_ptr<RecordingTables> OpenBagTables(const std::string& path,
                                               const SequenceOptions& options);

}  // namespace slcmap::data
