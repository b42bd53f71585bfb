#include "mapping/pipes/pipe_widths.h"

#include <opencv2/core/utility.hpp>

namespace slcmap {
namespace {

// The indices of those that `holds` for.
template <typename Holds>
std::vector<size_t> Where(size_t count, Holds holds) {
  std::vector<char> each(count, 0);
  cv::parallel_for_({0, static_cast<int>(count)}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) each[i] = holds(static_cast<size_t>(i));
  });
  std::vector<size_t> indices;
  for (size_t i = 0; i < count; ++i) {
    if (each[i]) indices.push_back(i);
  }
  return indices;
}

std::vector<PipePlace> Some(const std::vector<PipePlace>& places,
                            const std::vector<size_t>& indices) {
  std::vector<PipePlace> some;
  for (const size_t i : indices) some.push_back(places[i]);
  return some;
}

// Of a part of the images, that often tells little: whether the others may make a pipe of it.
bool IsPromising(const WidthEvidence& widths) {
  constexpr int kLeastImages = 2;
  constexpr double kMostOfImage = 4, kFew = 3;
  return widths.images >= kLeastImages && widths.cylinder <= widths.edges + kFew &&
         widths.cylinder <= kMostOfImage * widths.images;
}

}  // namespace

std::vector<WidthEvidence> WidthsOf(const std::vector<PipePlace>& places, const PipeImages& images,
                                    double pose_sigma_m, const Progress& progress) {
  constexpr size_t kEach = 4;     // view is looked at first
  constexpr double kFirst = 0.6;  // of the time
  const ViewCameras cameras(images.views, images.images.rig());
  const std::vector<size_t> told = Where(places.size(), [&](size_t i) {
    const double radius_m = places[i].cylinder.radius_m;
    return ToldByWidths(ExpectedPairs(places[i], cameras), radius_m, pose_sigma_m) >=
           kLeastToldByWidths;
  });
  std::vector<size_t> first, others;
  for (size_t view = 0; view < images.views.size(); ++view) {
    (view % kEach == 0 ? first : others).push_back(view);
  }
  const auto evidence = [&](const std::vector<OutlinePair>& pairs, size_t place) {
    return WidthEvidenceOf(pairs, places[place].cylinder.radius_m, pose_sigma_m);
  };
  auto pairs = FindOutlinePairs(Some(places, told), images, first, progress.Part(0, kFirst));
  const std::vector<size_t> promising =
      Where(told.size(), [&](size_t k) { return IsPromising(evidence(pairs[k], told[k])); });
  std::vector<PipePlace> further;
  for (const size_t k : promising) further.push_back(places[told[k]]);
  const auto more = FindOutlinePairs(further, images, others, progress.Part(kFirst, 1));
  std::vector<WidthEvidence> widths(places.size());
  cv::parallel_for_({0, static_cast<int>(promising.size())}, [&](const cv::Range& range) {
    for (int j = range.start; j < range.end; ++j) {
      const size_t k = promising[j];
      pairs[k].insert(pairs[k].end(), more[j].begin(), more[j].end());
      widths[told[k]] = evidence(pairs[k], told[k]);
    }
  });
  return widths;
}

}  // namespace slcmap
