// A recorded sequence in a folder or a bag, or a part of it by time: which images and samples there
// are, and the rig that made them.
#pragma once

#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"
#include "data/io/image.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

struct ImageFile;

struct Sequence {
  std::string folder;  // the one that holds cam0, cam1 and imu0; or the bag
  std::vector<StereoEntry> images;
  SharedImageStore store = FileImages();  // that has them
  std::vector<PixelForm> pixel_forms;     // of the images, by camera
  std::vector<ImuSample> imu;             // as the files have it, with rig.imu_correction applied
  Rig rig;
  std::string calibration_source;
  std::string form = "ASL folder";
  std::vector<int> cameras;   // "cam0" and "cam1" are 0 and 1, those of a bag too
  bool finds_carried = true;  // whether what moves with the rig is looked for: no mask was given
  std::string truth_path;     // true poses, "" where there are none
  SequenceOptions opened;     // that open it so again: with its cameras, and whole paths
  Warnings warnings;

  // Those of `cameras`; where there is one, the second is named as if it were the next.
  std::vector<std::string> CameraNames() const;
};

// Opens an EuRoC (ASL) or TUM VI sequence: the folder with cam0, cam1, imu0, or the one above it;
// or a bag (ROS 1, rosbag2 or MCAP), of which messages are read when they are asked for. Without
// cam1 the rig has one camera (IsStereo is false), as it has without a calibration for cam1. Rows
// that cannot be used are counted in Sequence::warnings. Throws DataError when a part is missing,
// no pair is left, the calibration is absurd, or IMU and images do not overlap in time.
Sequence OpenSequence(const std::string& path, const SequenceOptions& options = {});

// The folder with cam0, imu0 and, of two cameras, cam1 for a path as OpenSequence takes it, or the
// bag; throws DataError.
std::string LocateRecording(const std::string& path, bool needs_imu = true);

// Whether a path is that of a recording in a bag: a file, or a folder without cam0.
bool IsBagRecording(const std::string& path);

// Texts that are others once a file was changed: of a folder a row a file, with name, size and the
// time of its last change; of a bag, which may be a folder.
std::string DescribeFiles(const std::string& folder);
std::string DescribeBag(const std::string& path);

// A topic of a bag.
struct RecordedTopic {
  std::string name, type;
  int64_t messages = -1;  // -1: not known
  std::string taken_as;   // such as "left images"; "" where it is not
};

// Those of a recording in a bag, as it would be opened; none of another. Throws DataError for a bag
// that cannot be opened, ConfigError as ParseTopics and ChooseTopics (data/bag/topics.h) do.
std::vector<RecordedTopic> ListRecordedTopics(const std::string& path, const std::string& said);

// The images of what LocateRecording gives; of a bag as `opened` has it.
SharedImageStore OpenImageStore(const std::string& place, const SequenceOptions& opened);

// The file of true poses in that folder (EuRoC's state_groundtruth_estimate0, TUM VI's mocap0); ""
// where there is none.
std::string FindTruth(const std::string& asl_folder);

// Pairs left and right images that are nearest to each other in time and at most max_offset_s
// apart; counts the others.
std::vector<StereoEntry> PairImages(const std::vector<ImageFile>& left,
                                    const std::vector<ImageFile>& right, double max_offset_s,
                                    Warnings* warnings);

// The paths of images, by camera, of those that are there.
std::vector<std::vector<std::string>> ImagePaths(const std::vector<StereoEntry>& images,
                                                 size_t cameras);

// The images of the pieces, as they belong together; those without a partner go.
std::vector<StereoEntry> PairedAnew(const std::vector<PairPiece>& pieces,
                                    const std::vector<StereoEntry>& images);

// Throws ConfigError where a tolerance or an offset cannot be.
void CheckPairing(const SequenceOptions& options);

struct PartSpan {
  int64_t from_ns = 0, to_ns = 0;  // of the first and the last image
};

// Seconds from the first image.
struct SequencePart {
  double from_s = 0;
  double duration_s = 0;  // 0: to the end
  // Throws ConfigError, naming --from or --duration, for a time that cannot be.
  void Check() const;
  // Where the first image has this stamp.
  PartSpan SpanFrom(int64_t first_ns) const;
};

// Drops the images of other times, and the IMU samples further than a second from those that stay.
// Throws ConfigError when no image is left.
void KeepPart(const SequencePart& part, Sequence* sequence);

}  // namespace slcmap::data
