// Finds the lines of a building in the views, one after the other.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/line_sweep.h"
#include "mapping/lines/options.h"

namespace slcmap::inline mapping {

// Every segment of a left image that no line known so far explains is looked for in the views
// around, along the axes that it may follow, else in any direction, and becomes a line where enough
// of them show it. Lines are in the order in which they were found.
class LineFinder {
 public:
  // All must outlive the finder.
  LineFinder(const Views& views, const ViewImages& images, const std::vector<BuildingAxis>& axes,
             const MapLineOptions& options);

  // The known lines and those found. Once progress says so, later views are left out.
  std::vector<TrackedLine> Find(std::vector<TrackedLine> known, const Progress& progress);

 private:
  // A line that a segment may be of.
  struct Hypothesis {
    int axis = -1;
    bool is_level = false;
    SweptLine swept;
  };

  void LookAt(int view);
  // Marks the segments (px) that lies on known lines, and lengthens these by them.
  void Explain(int view, const std::vector<LineSegment>& segments, size_t first_line,
               std::vector<char>* explained);
  std::optional<Hypothesis> Sweep(const LineSegment& px, int view,
                                  const std::vector<SweepImage>& images) const;
  std::optional<Hypothesis> SweepLevel(const LineSegment& segment, int view,
                                       const std::vector<SweepImage>& images) const;
  // The median gradient of a line's edge in the left image of a view.
  double GradientIn(int view, const TrackedLine& line) const;
  std::optional<TrackedLine> Accept(const Hypothesis& hypothesis, int view,
                                    const std::vector<SweepImage>& images) const;

  const Views& views_;
  const ViewImages& images_;
  const std::vector<BuildingAxis>& axes_;
  const MapLineOptions& options_;
  const ViewCameras cameras_;
  EdgeViews window_;
  std::vector<TrackedLine> lines_;
};

// What the direction of a line is known to be beforehand.
std::optional<DirectionPrior> MakePrior(const TrackedLine& line,
                                        const std::vector<BuildingAxis>& axes);

// The gradient from which an image shows a line.
double MinGradient(const TrackedLine& line);

}  // namespace slcmap::mapping
