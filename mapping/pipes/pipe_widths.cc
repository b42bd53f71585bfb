#include "mapping/pipes/pipe_widths.h"

#include "mapping/watched_loop.h"

namespace slcmap {
namespace {

// The indices of those that `holds` for; none once progress says so.
template <typename Holds>
std::vector<size_t> Where(size_t count, const Progress& progress, Holds holds) {
  std::vector<char> each(count, 0);
  if (!ForEachWatched(count, progress, [&](size_t i) { each[i] = holds(i); })) return {};
  std::vector<size_t> indices;
  for (size_t i = 0; i < count; ++i) {
    if (each[i]) indices.push_back(i);
  }
  return indices;
}

template <typename Item>
std::vector<Item> Some(const std::vector<Item>& items, const std::vector<size_t>& indices) {
  std::vector<Item> some;
  for (const size_t i : indices) some.push_back(items[i]);
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
  constexpr size_t kEach = 4;                     // view is looked at first
  constexpr double kChosen = 0.1, kFirst = 0.65;  // of the time
  const ViewCameras cameras(images.views, images.images.rig());
  std::vector<WidthEvidence> widths(places.size());
  const auto evidence = [&](const std::vector<OutlinePair>& pairs, size_t place) {
    return WidthEvidenceOf(pairs, places[place].cylinder.radius_m, pose_sigma_m);
  };
  const auto told = Where(places.size(), progress.Part(0, kChosen), [&](size_t i) {
    return ToldByWidths(ExpectedPairs(places[i], images.views, cameras), pose_sigma_m) >=
           kLeastToldByWidths;
  });
  std::vector<size_t> first, others;
  for (size_t view = 0; view < images.views.size(); ++view) {
    (view % kEach == 0 ? first : others).push_back(view);
  }
  auto pairs = FindOutlinePairs(Some(places, told), images, first, progress.Part(kChosen, kFirst));
  const auto promising = Where(told.size(), progress.Part(kFirst, kFirst),
                               [&](size_t k) { return IsPromising(evidence(pairs[k], told[k])); });
  const auto more = FindOutlinePairs(Some(places, Some(told, promising)), images, others,
                                     progress.Part(kFirst, 1));
  // What part of the images says may be wrong.
  if (!progress.Report(1)) return widths;
  ForEachWatched(promising.size(), {}, [&](size_t j) {
    const size_t k = promising[j];
    pairs[k].insert(pairs[k].end(), more[j].begin(), more[j].end());
    widths[told[k]] = evidence(pairs[k], told[k]);
  });
  return widths;
}

}  // namespace slcmap
