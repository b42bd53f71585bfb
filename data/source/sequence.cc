#include "data/source/sequence.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "data/calibration/calibration.h"
#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_words.h"
#include "data/calibration/imu_calibration.h"
#include "data/calibration/mask.h"
#include "data/calibration/other_calibrations.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/light_dots.h"
#include "data/source/asl_files.h"
#include "data/source/recording_tables.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

// Of one camera, the second is taken to be the next.
int CameraNumber(const Sequence& sequence, size_t camera) {
  const std::vector<int>& cameras = sequence.cameras;
  if (camera < cameras.size()) return cameras[camera];
  return static_cast<int>(camera) + (cameras.empty() ? 0 : cameras[0]);
}

std::string CameraFolder(const Sequence& sequence, size_t camera) {
  return sequence.CameraNames()[camera];
}

void RequireOverlap(const RecordingTables& recording, const Sequence& sequence) {
  const int64_t offset_ns = ToNanoseconds(sequence.rig.camera_time_offset_s);
  const int64_t first_image_ns = sequence.images.front().stamp_ns + offset_ns;
  const int64_t last_image_ns = sequence.images.back().stamp_ns + offset_ns;
  const int64_t first_imu_ns = sequence.imu.front().stamp_ns;
  const int64_t last_imu_ns = sequence.imu.back().stamp_ns;
  if (first_image_ns <= last_imu_ns && first_imu_ns <= last_image_ns) return;
  throw InputFault(
      "clocks",
      fmt::format("{}: found images from {:.3f} to {:.3f} s and IMU samples from {:.3f} to {:.3f} "
                  "s, expected them to overlap (are both in nanoseconds of one clock?)",
                  sequence.folder, ToSeconds(first_image_ns), ToSeconds(last_image_ns),
                  ToSeconds(first_imu_ns), ToSeconds(last_imu_ns)),
      fmt::format("write the stamps of {} and {} in nanoseconds of one clock",
                  recording.NameTable(CameraFolder(sequence, 0)), recording.NameTable("imu0")));
}

// The tables of a recording as they are read.
struct Tables {
  std::vector<std::vector<ImageFile>> images;  // by camera, of two at least
  std::vector<ImuSample> imu;
};

// Where the clock of one camera alone was set, and images of both, put back, follow each other row
// by row, those of the other tell the time. False where that is not so.
bool TakeStamps(const ClockTable<ImageFile>& whole, const std::vector<ClockJump>& of_imu,
                ClockTable<ImageFile>* table) {
  const std::vector<ImageFile>& given = *whole.elements;
  if (table->jumps->empty() || given.size() != table->elements->size()) return false;
  for (const ClockJump& jump : *table->jumps) {
    if (!jump.put_back || SameJump(jump, *whole.jumps) < whole.jumps->size() ||
        SameJump(jump, of_imu) < of_imu.size()) {
      return false;
    }
  }
  const double near_ns = 0.4e9 * MedianStep_s(given);
  std::vector<double> offsets_ns;  // of the table, before its clock was set
  for (size_t i = 0; i < given.size(); ++i) {
    const int64_t stamp_ns = (*table->elements)[i].stamp_ns;
    const int64_t apart_ns = stamp_ns - given[i].stamp_ns;
    if (static_cast<double>(std::abs(apart_ns)) > near_ns) return false;
    if (stamp_ns < table->jumps->front().stamp_ns)
      offsets_ns.push_back(static_cast<double>(apart_ns));
  }
  const auto offset_ns = static_cast<int64_t>(Quantile(offsets_ns, 0.5));
  for (size_t i = 0; i < given.size(); ++i) {
    ImageFile& image = (*table->elements)[i];
    if (image.stamp_ns >= table->jumps->front().stamp_ns)
      image.stamp_ns = given[i].stamp_ns + offset_ns;
  }
  return true;
}

// Where the recorder's clock is set to another time, what is recorded of all tables from then on is
// put on the clock before, but begins anew: how long the jump took is not known.
// What is told by another camera is told by the first two.
void JoinClocks(std::vector<std::vector<ClockJump>> images, std::vector<ClockJump> imu,
                Tables* tables, Warnings* warnings) {
  std::vector<ClockTable<ImageFile>> cameras;
  for (size_t i = 0; i < images.size(); ++i) {
    cameras.push_back({&tables->images[i], &images[i]});
  }
  ClockTable<ImuSample> samples{&tables->imu, &imu};
  for (auto& camera : cameras) UndoForward(samples, &camera);
  UndoForward(cameras[0], &samples);
  for (auto& camera : cameras) AgreeOnJumps(samples, &camera);
  for (size_t i = 1; i < cameras.size(); ++i) AgreeOnJumps(cameras[0], &cameras[i]);
  std::vector<bool> told(images.size());
  told[0] = TakeStamps(cameras[1], imu, &cameras[0]);
  for (size_t i = 1; i < cameras.size() && !told[0]; ++i) {
    told[i] = TakeStamps(cameras[0], imu, &cameras[i]);
  }
  const std::vector<ClockJump> of_images = images[0], of_imu = imu;
  for (auto& jumps : images) LeaveOutPauses(of_imu, &jumps);
  LeaveOutPauses(of_images, &imu);
  for (const auto& jumps : images) CountJumps(jumps, warnings);
  CountJumps(imu, warnings);
  for (size_t i = 0; i < images.size(); ++i) {
    if (told[i]) images[i].clear();
    for (const ClockJump& jump : images[i]) BreakImu(jump, &tables->imu);
  }
  for (const ClockJump& jump : imu) BreakImu(jump, &tables->imu);
}

// By how much images jump is told by the samples, also where those are not asked for, or it would
// be another jump than with them. Leaves both empty where there is no table that can be read.
void ReadClockOfImu(const RecordingTables& recording, std::vector<ImuSample>* imu,
                    std::vector<ClockJump>* jumps) {
  Warnings ignored;
  try {
    *imu = TakeSamples(recording.ReadImu(&ignored), &ignored, jumps);
  } catch (const DataError&) {
    jumps->clear();
  }
}

Tables ReadTables(const RecordingTables& recording, const SequenceOptions& options,
                  Sequence* sequence) {
  Warnings* warnings = &sequence->warnings;
  Tables tables;
  tables.images.resize(sequence->rig.cameras.size());
  std::vector<std::vector<ClockJump>> jumps(tables.images.size());
  std::vector<ClockJump> imu;
  for (size_t i = 0; i < static_cast<size_t>(CameraCount(sequence->rig)); ++i) {
    tables.images[i] =
        TakeImages(recording.ReadImages(CameraNumber(*sequence, i), warnings), warnings, &jumps[i]);
  }
  if (options.needs_imu) {
    tables.imu = TakeSamples(recording.ReadImu(warnings), warnings, &imu);
  } else if (std::ranges::any_of(jumps, [](const auto& of_camera) { return !of_camera.empty(); })) {
    ReadClockOfImu(recording, &tables.imu, &imu);
  }
  JoinClocks(std::move(jumps), imu, &tables, warnings);
  if (!options.needs_imu) tables.imu.clear();
  return tables;
}

// The offset at which most right images lie behind the left ones, if they all do.
std::optional<double> ConstantOffset_s(const std::vector<ImageFile>& left,
                                       const std::vector<ImageFile>& right) {
  constexpr double kWithin_s = 1e-3, kMost = 0.8;
  std::vector<double> offsets_s;
  size_t r = 0;
  for (const ImageFile& image : left) {
    const auto apart_ns = [&](size_t i) { return std::abs(right[i].stamp_ns - image.stamp_ns); };
    while (r + 1 < right.size() && apart_ns(r + 1) < apart_ns(r)) ++r;
    if (r < right.size()) offsets_s.push_back(ToSeconds(right[r].stamp_ns - image.stamp_ns));
  }
  const double offset_s = Median(offsets_s);
  const auto near = std::ranges::count_if(
      offsets_s, [&](double each_s) { return std::abs(each_s - offset_s) < kWithin_s; });
  if (static_cast<double>(near) < kMost * static_cast<double>(offsets_s.size()))
    return std::nullopt;
  return offset_s;
}

// The offset of right stamps that makes pairs of most images, where the options' one does not; and
// nothing where none does.
std::string RightOffsetRemedy(const std::vector<ImageFile>& left,
                              const std::vector<ImageFile>& right, const std::string& right_name,
                              double given_s) {
  const std::optional<double> further_s = ConstantOffset_s(left, right);
  if (!further_s) return "";
  const double offset_s = given_s + *further_s;
  return fmt::format(
      "open it with --right-offset {:.3f} (ms): the stamps of {} are {} by that, "
      "where the cameras are triggered together",
      1e3 * offset_s, right_name, offset_s > 0 ? "late" : "early");
}

// By how much right images are stamped later than left ones, where that is so by more than stamps
// scatter and each still belongs to one left image; else 0.
double StampedLater_s(const std::vector<ImageFile>& left, const std::vector<ImageFile>& right) {
  constexpr double kMostOfStep = 0.4;
  const double later_s = left.empty() ? 0 : ConstantOffset_s(left, right).value_or(0);
  const double most_s = std::min(kMaxRightOffset_s, kMostOfStep * MedianStep_s(left));
  return std::abs(later_s) > kMinRightOffset_s && std::abs(later_s) <= most_s ? later_s : 0;
}

// Images of another camera that are stamped later are taken later: who triggers all cameras
// together says so of the right one.
void TakeLater(double later_s, size_t camera, std::vector<ImageFile>* files, Sequence* sequence) {
  if (later_s == 0) return;
  for (ImageFile& image : *files) image.stamp_ns -= ToNanoseconds(later_s);
  Rig& rig = sequence->rig;
  if (camera > 1) rig.other_time_offsets_s.resize(rig.cameras.size() - 2);
  (camera == 1 ? rig.right_time_offset_s : rig.other_time_offsets_s[camera - 2]) += later_s;
  spdlog::warn(
      "{}: images of {} are stamped {:.1f} ms after those of {}, and taken to be exposed so{}",
      sequence->folder, CameraFolder(*sequence, camera), 1e3 * later_s, CameraFolder(*sequence, 0),
      camera > 1 ? ""
                 : fmt::format("; where the cameras are triggered together, open it with "
                               "--right-offset {:.1f}",
                               1e3 * later_s));
}

// Adds to pairs the images of another camera that are nearest to them in time.
void AddCamera(const std::vector<ImageFile>& files, double max_offset_s,
               std::vector<StereoEntry>* images, Warnings* warnings) {
  const int64_t max_offset_ns = ToNanoseconds(max_offset_s);
  size_t next = 0;
  for (StereoEntry& pair : *images) {
    const auto apart_ns = [&](size_t i) { return std::abs(files[i].stamp_ns - pair.stamp_ns); };
    while (next + 1 < files.size() && apart_ns(next + 1) <= apart_ns(next)) ++next;
    const bool is_there = next < files.size() && apart_ns(next) <= max_offset_ns;
    pair.other_paths.push_back(is_there ? files[next].path : "");
    if (!is_there) warnings->Add(kImageUnpaired, pair.left_path);
  }
}

// The images that sequence->rig has cameras for.
std::vector<StereoEntry> PairTables(const RecordingTables& recording,
                                    const SequenceOptions& options, const Tables& tables,
                                    Sequence* sequence) {
  const std::vector<ImageFile>& left = tables.images[0];
  std::vector<StereoEntry> images;
  if (!HasTwoCameras(sequence->rig)) {
    for (const ImageFile& image : left) images.push_back({image.stamp_ns, image.path, ""});
    return images;
  }
  std::vector<ImageFile> right = tables.images[1];
  for (ImageFile& image : right) image.stamp_ns -= ToNanoseconds(options.right_offset_s);
  TakeLater(StampedLater_s(left, right), 1, &right, sequence);
  images = PairImages(left, right, options.max_stereo_offset_s, &sequence->warnings);
  for (size_t i = 2; i < tables.images.size(); ++i) {
    std::vector<ImageFile> files = tables.images[i];
    TakeLater(StampedLater_s(left, files), i, &files, sequence);
    AddCamera(files, options.max_stereo_offset_s, &images, &sequence->warnings);
  }
  if (2 * images.size() >= left.size()) return images;
  const std::string remedy =
      RightOffsetRemedy(left, right, CameraFolder(*sequence, 1), options.right_offset_s);
  if (images.empty() || !remedy.empty()) {
    throw InputFault(
        "unpaired",
        fmt::format("{}: found {} within {} s of each other among {} and {}, expected pairs",
                    sequence->folder,
                    images.empty() ? std::string("no left and right image")
                                   : fmt::format("{} left and right images", images.size()),
                    options.max_stereo_offset_s, left.size(), right.size()),
        !remedy.empty()
            ? remedy
            : fmt::format("trigger both cameras together, and write the stamps of {} and {} in "
                          "nanoseconds of one clock",
                          recording.NameTable(CameraFolder(*sequence, 0)),
                          recording.NameTable(CameraFolder(*sequence, 1))));
  }
  return images;
}

bool IsRecorded(const RecordingTables& recording, int camera) {
  return std::ranges::count(recording.cameras(), camera) > 0;
}

Calibration LoadCalibration(const RecordingTables& recording, const SequenceOptions& options,
                            const std::vector<int>& cameras, Warnings* warnings) {
  // What files tell of a bag's rig may be a part, which goes before what the bag has.
  const bool is_part = !recording.topics().empty() && TellsParts(options.calibration);
  return options.calibration.empty() || is_part
             ? recording.FindCalibration(options, cameras, warnings)
             : ReadCalibration(options.calibration, warnings, options.mirrored, cameras);
}

// The cameras that were recorded, of a calibration that has others too.
std::vector<int> ChooseRecorded(const RecordingTables& recording, const SequenceOptions& options) {
  std::vector<ChainCamera> chain;
  for (const int i : recording.cameras()) {
    Warnings ignored;  // come with those that are chosen
    try {
      const Rig rig = LoadCalibration(recording, options, {i}, &ignored).rig;
      chain.push_back({i, rig.cameras[0], rig.T_imu_camera[0], std::nullopt, ""});
    } catch (const InputFault&) {
      continue;  // recorded, but not calibrated
    }
  }
  std::vector<int> chosen;
  for (const size_t at : ChooseCameras(chain, {})) chosen.push_back(chain[at].index);
  return chosen;
}

Calibration LoadCalibration(const RecordingTables& recording, const SequenceOptions& options,
                            Warnings* warnings) {
  Warnings of_reading;
  Calibration calibration = LoadCalibration(recording, options, options.cameras, &of_reading);
  const auto missing = std::ranges::find_if(
      calibration.cameras, [&](int camera) { return !IsRecorded(recording, camera); });
  if (missing != calibration.cameras.end() && !options.cameras.empty()) {
    throw InputFault("cameras",
                     fmt::format("--cameras: found no cam{} in {}", *missing, recording.place()),
                     "name cameras that the recording has");
  }
  if (missing != calibration.cameras.end()) {
    const std::vector<int> recorded = ChooseRecorded(recording, options);
    // Else a stereo rig of which one camera was recorded.
    if (recorded != std::vector{0} || calibration.cameras.front() != 0) {
      return LoadCalibration(recording, options, recorded, warnings);
    }
  }
  warnings->Merge(of_reading);
  return calibration;
}

// The half of the images that an emitter lights, where it lights every other one.
void LeaveOutLit(Sequence* sequence) {
  std::vector<std::string> paths;
  for (const StereoEntry& pair : sequence->images) paths.push_back(pair.left_path);
  const std::vector<size_t> lit = FindLitImages(*sequence->store, paths);
  for (const size_t i : lit) {
    sequence->warnings.Add("images_lit_by_an_emitter_left_out", paths[i]);
  }
  size_t index = 0;
  std::erase_if(sequence->images,
                [&](const StereoEntry&) { return std::ranges::binary_search(lit, index++); });
}

// Words that stand in a path's place stay.
SequenceOptions WithWholePaths(SequenceOptions options) {
  if (!options.calibration.empty()) {
    std::vector<std::string> paths = SplitCalibrationPaths(options.calibration);
    for (std::string& path : paths) path = fs::weakly_canonical(path).string();
    options.calibration = fmt::format("{}", fmt::join(paths, ","));
  }
  for (std::string& mask : options.masks) {
    if (mask != kNoMask) mask = fs::weakly_canonical(mask).string();
  }
  return options;
}

}  // namespace

std::vector<std::vector<std::string>> ImagePaths(const std::vector<StereoEntry>& images,
                                                 size_t cameras) {
  std::vector<std::vector<std::string>> paths(cameras);
  for (const StereoEntry& image : images) {
    for (size_t i = 0; i < cameras; ++i) {
      const std::string& path = image.path(static_cast<int>(i));
      if (!path.empty()) paths[i].push_back(path);
    }
  }
  return paths;
}

std::vector<std::string> Sequence::CameraNames() const {
  std::vector<std::string> names;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    names.push_back(fmt::format("cam{}", CameraNumber(*this, i)));
  }
  return names;
}

std::string FindTruth(const std::string& asl_folder) {
  for (const char* name : {"state_groundtruth_estimate0", "mocap0"}) {
    const fs::path path = fs::path(asl_folder) / name / "data.csv";
    std::error_code error;
    if (fs::is_regular_file(path, error)) return path.string();
  }
  return "";
}

std::vector<StereoEntry> PairImages(const std::vector<ImageFile>& left,
                                    const std::vector<ImageFile>& right, double max_offset_s,
                                    Warnings* warnings) {
  const int64_t max_offset_ns = ToNanoseconds(max_offset_s);
  std::vector<StereoEntry> pairs;
  size_t l = 0, r = 0;
  const auto offset_ns = [&](size_t i, size_t k) {
    return std::abs(left[i].stamp_ns - right[k].stamp_ns);
  };
  while (l < left.size() && r < right.size()) {
    const bool left_is_first = left[l].stamp_ns < right[r].stamp_ns;
    const bool nearer_follows = left_is_first
                                    ? l + 1 < left.size() && offset_ns(l + 1, r) < offset_ns(l, r)
                                    : r + 1 < right.size() && offset_ns(l, r + 1) < offset_ns(l, r);
    if (offset_ns(l, r) <= max_offset_ns && !nearer_follows) {
      pairs.push_back({left[l].stamp_ns, left[l].path, right[r].path});
      ++l, ++r;
    } else if (left_is_first) {
      warnings->Add(kImageUnpaired, left[l++].path);
    } else {
      warnings->Add(kImageUnpaired, right[r++].path);
    }
  }
  while (l < left.size()) warnings->Add(kImageUnpaired, left[l++].path);
  while (r < right.size()) warnings->Add(kImageUnpaired, right[r++].path);
  return pairs;
}

std::vector<StereoEntry> PairedAnew(const std::vector<PairPiece>& pieces,
                                    const std::vector<StereoEntry>& images) {
  std::vector<StereoEntry> paired;
  std::ptrdiff_t used = -1;  // right images up to this
  for (const PairPiece& piece : pieces) {
    for (std::ptrdiff_t i = 0; i < std::ssize(images); ++i) {
      const StereoEntry& image = images[static_cast<size_t>(i)];
      if (image.stamp_ns < piece.from_ns || image.stamp_ns > piece.to_ns) continue;
      const std::ptrdiff_t right = i + piece.later, stamp = i + piece.late;
      if (right <= used || right >= std::ssize(images)) continue;
      if (stamp < 0 || stamp >= std::ssize(images)) continue;
      const int64_t stamp_ns = images[static_cast<size_t>(stamp)].stamp_ns;
      if (!paired.empty() && paired.back().stamp_ns >= stamp_ns) continue;
      used = right;
      paired.push_back({stamp_ns, image.left_path,
                        piece.has_right ? images[static_cast<size_t>(right)].right_path : "",
                        image.other_paths});
    }
  }
  return paired;
}

void CheckPairing(const SequenceOptions& options) {
  const auto check = [](const char* name, double found_s, double least_s, double most_s) {
    if (found_s >= least_s && found_s <= most_s) return;
    throw ConfigError(fmt::format("{}: found {}, expected milliseconds from {} to {}", name,
                                  1e3 * found_s, 1e3 * least_s, 1e3 * most_s));
  };
  check("--pair-tolerance", options.max_stereo_offset_s, 0, 1);
  check("--right-offset", options.right_offset_s, -10, 10);
}

Sequence OpenSequence(const std::string& path, const SequenceOptions& options) {
  CheckPairing(options);
  const auto recording = OpenTables(path, options);
  Sequence sequence;
  sequence.folder = recording->place();
  sequence.form = recording->form();
  sequence.store = recording->images();
  const Calibration calibration = LoadCalibration(*recording, options, &sequence.warnings);
  if (options.needs_imu && !calibration.without_noise.empty()) {
    sequence.warnings.Add(kImuNoiseAssumed, calibration.without_noise);
  }
  sequence.rig = calibration.rig;
  sequence.calibration_source = calibration.source;
  sequence.cameras = calibration.cameras;
  sequence.finds_carried = options.masks.empty();
  if (HasTwoCameras(sequence.rig) && !IsRecorded(*recording, CameraNumber(sequence, 1))) {
    sequence.rig.Resize(1);
  }
  ReadMasks(options.masks, &sequence.rig);
  Tables tables = ReadTables(*recording, options, &sequence);
  sequence.images = PairTables(*recording, options, tables, &sequence);
  if (!options.pieces.empty()) sequence.images = PairedAnew(options.pieces, sequence.images);
  LeaveOutLit(&sequence);
  sequence.imu = std::move(tables.imu);
  if (options.needs_imu) RequireOverlap(*recording, sequence);
  Correct(sequence.rig.imu_correction, &sequence.imu);
  sequence.pixel_forms =
      FindPixelForms(*sequence.store, ImagePaths(sequence.images, sequence.rig.cameras.size()),
                     &sequence.warnings);
  sequence.truth_path = FindTruth(sequence.folder);
  sequence.opened = WithWholePaths(options);
  sequence.opened.cameras = sequence.cameras;
  sequence.opened.topics = recording->topics();
  sequence.opened.right_stamped_later_s =
      sequence.rig.right_time_offset_s - calibration.rig.right_time_offset_s;
  for (size_t i = 0; i < sequence.rig.other_time_offsets_s.size(); ++i) {
    const int camera = static_cast<int>(i) + 2;
    sequence.opened.others_stamped_later_s.push_back(TimeOffset_s(sequence.rig, camera) -
                                                     TimeOffset_s(calibration.rig, camera));
  }
  // Runs tell the cameras' times where there are some.
  if (IsTakenAtOnce(sequence.rig)) sequence.opened.others_stamped_later_s.clear();
  return sequence;
}

namespace {

constexpr double kMaxTime_s = 1e8;         // three years
constexpr double kImuMargin_s = 1;         // beyond the camera's time offset
constexpr double kImageRounding_s = 1e-6;  // of times given on a command line

void CheckTime(const char* name, double found_s) {
  if (found_s >= 0 && found_s <= kMaxTime_s) return;
  throw ConfigError(
      fmt::format("{}: found {}, expected seconds from 0 to {}", name, found_s, kMaxTime_s));
}

}  // namespace

void SequencePart::Check() const {
  CheckTime("--from", from_s);
  CheckTime("--duration", duration_s);
}

PartSpan SequencePart::SpanFrom(int64_t first_ns) const {
  const double to_s = duration_s == 0 ? 2 * kMaxTime_s : from_s + duration_s;
  return {first_ns + ToNanoseconds(from_s - kImageRounding_s),
          first_ns + ToNanoseconds(to_s + kImageRounding_s)};
}

void KeepPart(const SequencePart& part, Sequence* sequence) {
  part.Check();
  if (part.from_s == 0 && part.duration_s == 0) return;
  const int64_t start_ns = sequence->images.front().stamp_ns;
  const PartSpan span = part.SpanFrom(start_ns);
  const double length_s = ToSeconds(sequence->images.back().stamp_ns - start_ns);
  std::erase_if(sequence->images, [&](const StereoEntry& image) {
    return image.stamp_ns < span.from_ns || image.stamp_ns > span.to_ns;
  });
  if (sequence->images.empty()) {
    throw ConfigError(
        fmt::format("--from {} --duration {}: found no image in it, expected a part of the "
                    "recording's {:.3f} s",
                    part.from_s, part.duration_s, length_s));
  }
  const int64_t margin_ns = ToNanoseconds(kImuMargin_s);
  const int64_t offset_ns = ToNanoseconds(sequence->rig.camera_time_offset_s);
  const int64_t first_ns = sequence->images.front().stamp_ns + offset_ns - margin_ns;
  const int64_t last_ns = sequence->images.back().stamp_ns + offset_ns + margin_ns;
  std::erase_if(sequence->imu, [&](const ImuSample& sample) {
    return sample.stamp_ns < first_ns || sample.stamp_ns > last_ns;
  });
}

}  // namespace slcmap::data
