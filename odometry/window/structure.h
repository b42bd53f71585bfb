// The building's structure in a window: its directions, its lines, and the points on them.
#pragma once

#include <map>
#include <unordered_set>
#include <vector>

#include "odometry/run/run.h"
#include "odometry/structure/manhattan_detector.h"
#include "odometry/structure/points_on_lines.h"
#include "odometry/structure/slope_detector.h"
#include "odometry/window/line_landmarks.h"
#include "odometry/window/line_priors.h"
#include "odometry/window/marginalization.h"
#include "odometry/window/options.h"

namespace slcmap::inline odometry {

class Structure {
 public:
  // Does nothing for methods on points alone.
  Structure(const EstimatorOptions& options, const Rig& rectified_rig);

  // Before the window is optimised with its newest frame: looks for headings of the building, for
  // points on lines, and estimates lines that can be.
  void Update(const CostModel& model, FrameState* newest, WindowState* window);

  // After it: rejects what does not fit, and merges what is the same. Returns the ids of lines
  // that are no longer known.
  std::unordered_set<int64_t> Judge(const CostModel& model, const FrameState& newest,
                                    WindowState* window);

  // Points that turned out to be no landmarks.
  void RemovePoints(const std::unordered_set<int64_t>& ids, WindowState* window) {
    RemoveMembers(ids, &memberships_, window);
  }

  // Before the oldest frame is marginalised: adds what it says of lines to the terms, and the
  // blocks of lines that are to be forgotten to the dropped ones. Returns the ids of these lines,
  // which are to be erased from the window afterwards.
  std::unordered_set<int64_t> ReleaseOldest(const CostModel& model,
                                            const WindowCovariance& covariance, WindowState* window,
                                            std::vector<Term>* terms,
                                            std::vector<double*>* dropped);

  // Moves the lines that have left the window since the last call to the run, and the merges.
  void Collect(int segment, OdometryRun* run);

  // Adds the lines and headings that are still in the window to the run, and the merges that
  // Collect() has not moved.
  void AddContents(int segment, const WindowState& window, const WindowCovariance& covariance,
                   OdometryRun* run) const;

  // Forgets everything but the lines that wait for Collect().
  void Reset();

  // Which points lie on which lines in the images.
  const PointsOnLines& memberships() const { return memberships_; }

 private:
  // What is estimated now: lines of no axis too where the building is crooked.
  LineKinds KindsNow() const;
  void FindHeadings(int camera, const FrameState& newest, const CostModel& model,
                    WindowState* window);
  void FindSlopes(const FrameState& newest, const CostModel& model, WindowState* window);
  Line DescribeLine(const LineLandmark& line, const WindowState& window,
                    const WindowCovariance& covariance) const;
  void FindPointsOnLines(const FrameState& newest);
  void LearnDeviation(const WindowState& window, const WindowCovariance& covariance,
                      const std::unordered_set<int64_t>& gone);
  std::unordered_set<int64_t> LinesToRemove(const WindowState& window) const;

  LineLandmarkOptions options_;
  bool finds_slopes_;
  LineKinds kinds_;  // that the method asks for
  bool points_on_lines_ = false;
  Rig rig_;
  LineClassifier classifier_;
  ManhattanDetector detector_;
  PointsOnLines memberships_;
  SlopeDetector slope_detector_;
  LineDeviations deviations_;
  // Of lines of the window that no frame of it sees, by id: as their last one left.
  std::map<int64_t, Eigen::Matrix3d> covariance_as_left_m2_;
  std::vector<Line> left_lines_;
  std::map<int64_t, int64_t> merges_;      // since Collect()
  std::unordered_set<int64_t> misplaced_;  // lines that Update() has retired
};

}  // namespace slcmap::odometry
