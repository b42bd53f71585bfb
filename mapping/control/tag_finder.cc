#include "mapping/control/tag_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/tag_name.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Corners = std::vector<cv::Point2f>;
using NamesById = std::map<int, std::string>;

constexpr double kTagSigma_px = 0.3;
constexpr int kNotSaid = -1;  // as TagName has it

// By family.
std::map<int, NamesById> SortByFamily(const std::vector<std::string>& names) {
  std::map<int, NamesById> families;
  for (const std::string& name : names) {
    if (const auto tag = ParseTagName(name)) families[tag->dictionary][tag->id] = name;
  }
  return families;
}

// Corners to a fraction of a pixel; a window must not see the next cell of the pattern.
void Refine(const cv::Mat& image, int cells, Corners* corners) {
  const double side_px = std::sqrt(std::abs(cv::contourArea(*corners)));
  const int half = std::clamp(static_cast<int>(0.6 * side_px / cells), 1, 6);
  cv::cornerSubPix(image, *corners, {half, half}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.005});
}

// Where the diagonals cross, which is the middle of the square, seen by a camera that may distort.
std::optional<Vector2d> FindMiddle(const Camera& camera, const Corners& corners) {
  std::array<Vector3d, 4> rays;
  for (size_t i = 0; i < 4; ++i) {
    const auto ray = camera.Unproject({corners[i].x, corners[i].y});
    if (!ray) return std::nullopt;
    rays[i] = *ray;
  }
  Vector3d middle = rays[0].cross(rays[2]).cross(rays[1].cross(rays[3]));
  if (middle.dot(rays[0]) < 0) middle = -middle;
  return camera.Project(middle.normalized());
}

class TagFinder {
 public:
  explicit TagFinder(int family) : dictionary_(cv::aruco::getPredefinedDictionary(family)) {
    options_->adaptiveThreshConstant = 3;  // of 7: walls beside windows are dark
  }

  // By id; of one that is there twice the last.
  std::map<int, Vector2d> Find(const cv::Mat& image, const Camera& camera) const {
    std::vector<Corners> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(image, dictionary_, corners, ids, options_);
    std::map<int, Vector2d> found;
    for (size_t i = 0; i < ids.size(); ++i) {
      Refine(image, dictionary_->markerSize + 2, &corners[i]);
      if (const auto middle = FindMiddle(camera, corners[i])) found[ids[i]] = *middle;
    }
    return found;
  }

 private:
  const cv::Ptr<cv::aruco::Dictionary> dictionary_;
  const cv::Ptr<cv::aruco::DetectorParameters> options_ = cv::aruco::DetectorParameters::create();
};

// An image pair of the recording, and the map's stamp of it.
struct PairOfMap {
  size_t pair = 0;
  int64_t stamp_ns = 0;
};

// The family whose tags of these ids are seen most often in a sample of the images.
int FindFamily(const SequenceSource& recording, const std::vector<PairOfMap>& pairs,
               const NamesById& names) {
  constexpr size_t kSample = 12;
  int best = 0;
  int64_t most = 0;
  for (int family = 0; family < static_cast<int>(TagFamilies().size()); ++family) {
    const TagFinder finder(family);
    int64_t count = 0;
    for (size_t i = 0; i < pairs.size(); i += std::max<size_t>(1, pairs.size() / kSample)) {
      const cv::Mat image = recording.ReadImage(pairs[i].pair, 0).image;
      if (image.empty()) continue;
      for (const auto& [id, px] : finder.Find(image, recording.info().rig.cameras[0])) {
        count += names.contains(id);
      }
    }
    if (count >= most && count > 0) best = family;
    most = std::max(most, count);
  }
  return best;
}

void FindInImage(const cv::Mat& image, const Camera& camera,
                 const std::map<int, NamesById>& families, const Sighting& like,
                 std::vector<Sighting>* sightings) {
  for (const auto& [family, names] : families) {
    for (const auto& [id, px] : TagFinder(family).Find(image, camera)) {
      const auto name = names.find(id);
      if (name == names.end()) continue;
      sightings->push_back(like);
      sightings->back().name = name->second;
      sightings->back().px = px;
    }
  }
}

}  // namespace

std::optional<size_t> FindPair(const SequenceSource& recording, int64_t stamp_ns) {
  constexpr int64_t kSameStamp_ns = 500000;  // poses may come from tables that round
  const std::vector<int64_t>& stamps_ns = recording.info().pair_stamps_ns;
  const auto at = std::ranges::lower_bound(stamps_ns, stamp_ns - kSameStamp_ns);
  if (at == stamps_ns.end() || *at - stamp_ns > kSameStamp_ns) return std::nullopt;
  return static_cast<size_t>(at - stamps_ns.begin());
}

std::vector<Sighting> FindTags(const SequenceSource& recording,
                               const std::vector<int64_t>& stamps_ns, int64_t stamps_moved_ns,
                               const std::vector<std::string>& names, const Progress& progress) {
  std::vector<PairOfMap> pairs;
  for (const int64_t stamp_ns : stamps_ns) {
    if (const auto pair = FindPair(recording, stamp_ns - stamps_moved_ns)) {
      pairs.push_back({*pair, stamp_ns});
    }
  }
  std::map<int, NamesById> families = SortByFamily(names);
  std::vector<Sighting> sightings;
  if (families.empty() || pairs.empty()) return sightings;
  if (const auto unsaid = families.extract(kNotSaid); !unsaid.empty()) {
    families[FindFamily(recording, pairs, unsaid.mapped())].merge(unsaid.mapped());
  }
  const Rig& rig = recording.info().rig;
  for (size_t i = 0; i < pairs.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs.size()));
    for (int camera = 0; camera < (IsStereo(rig) ? 2 : 1); ++camera) {
      const cv::Mat image = recording.ReadImage(pairs[i].pair, camera).image;
      const Sighting like{"", pairs[i].stamp_ns, camera, {}, kTagSigma_px};
      if (!image.empty()) FindInImage(image, rig.cameras[camera], families, like, &sightings);
    }
  }
  return sightings;
}

}  // namespace slcmap::mapping
