#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "data/simulator/scene/camera_response.h"
#include "data/simulator/shading.h"

namespace slcmap::inline data {
namespace {

constexpr int kSide = TextureTile::kSide;

// Integers and fractions in a fixed order.
class Dice {
 public:
  explicit Dice(uint32_t seed) : seed_(seed) {}
  float Fraction() { return UnitFloat(Mixed(seed_, count_++)); }
  float Between(float low, float high) { return low + (high - low) * Fraction(); }
  int Below(int limit) { return static_cast<int>(Fraction() * static_cast<float>(limit)); }

 private:
  uint32_t seed_, count_ = 0;
};

cv::Mat RandomGrid(int columns, int rows, uint32_t seed) {
  cv::Mat grid(rows, columns, CV_32F);
  Dice dice(seed);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) grid.at<float>(y, x) = dice.Between(-1, 1);
  }
  return grid;
}

// Smooth noise of columns x rows cells, which divide kSide; repeats without a seam.
cv::Mat Noise(int columns, int rows, uint32_t seed) {
  constexpr int kPad = 2;
  const cv::Mat grid = RandomGrid(columns, rows, seed);
  if (columns == kSide && rows == kSide) return grid;
  cv::Mat padded, large;
  cv::copyMakeBorder(grid, padded, kPad, kPad, kPad, kPad, cv::BORDER_WRAP);
  const int sx = kSide / columns, sy = kSide / rows;
  cv::resize(padded, large, {padded.cols * sx, padded.rows * sy}, 0, 0, cv::INTER_CUBIC);
  return large(cv::Rect(kPad * sx, kPad * sy, kSide, kSide)).clone();
}

// Octaves from columns x rows cells to the finest, each `gain` times as strong as the one before.
cv::Mat Fractal(int columns, int rows, float gain, uint32_t seed) {
  cv::Mat sum = cv::Mat::zeros(kSide, kSide, CV_32F);
  float strength = 1;
  for (uint32_t octave = 0; columns <= kSide && rows <= kSide; ++octave) {
    sum += strength * Noise(columns, rows, Mixed(seed, octave));
    strength *= gain;
    columns *= 2;
    rows *= 2;
  }
  return sum;
}

// Rectangular cells of random brightness with joints between them, as bricks or tiles.
struct Bond {
  int columns, rows;
  float joint_px;
  float spread, joint;  // of the cells' brightness; brightness of the joints
  bool staggered;       // every other row by half a cell
  float relief = 0;     // how much brighter the rims above are, and darker those below
  float wobble_px = 0;  // of the width of the joints
};

cv::Mat Cells(const Bond& bond, uint32_t seed) {
  cv::Mat out(kSide, kSide, CV_32F);
  const cv::Mat wobble = bond.wobble_px * Noise(128, 128, Mixed(seed, 77));
  const float w = static_cast<float>(kSide) / static_cast<float>(bond.columns),
              h = static_cast<float>(kSide) / static_cast<float>(bond.rows);
  for (int y = 0; y < kSide; ++y) {
    const int row = y * bond.rows / kSide;
    const float from_below = static_cast<float>(y) - static_cast<float>(row) * h,
                from_above = h - from_below;
    const int shift = bond.staggered && row % 2 == 1 ? static_cast<int>(w / 2) : 0;
    for (int x = 0; x < kSide; ++x) {
      const int xs = (x + shift) % kSide, column = xs * bond.columns / kSide;
      const uint32_t cell = Mixed(seed, static_cast<uint32_t>(row * bond.columns + column));
      const float joint_px = bond.joint_px + wobble.at<float>(y, x);
      const float near =
          std::min(static_cast<float>(xs) - static_cast<float>(column) * w, from_below);
      const float share = std::clamp(joint_px - near, 0.0f, 1.0f);  // of the joint in the texel
      constexpr float kRim_px = 2.5f;
      const float rims = std::exp(-std::max(from_above, 0.0f) / kRim_px) -
                         std::exp(-std::max(from_below - joint_px, 0.0f) / kRim_px);
      const float face = bond.spread * (2 * UnitFloat(cell) - 1) + bond.relief * rims;
      out.at<float>(y, x) = share * bond.joint + (1 - share) * face;
    }
  }
  return out;
}

// Dots of random size, also across the tile's border.
void AddSpots(int count, float largest_px, float strength, uint32_t seed, cv::Mat* image) {
  Dice dice(seed);
  for (int i = 0; i < count; ++i) {
    const int cx = dice.Below(kSide), cy = dice.Below(kSide);
    const float radius = largest_px * std::pow(dice.Fraction(), 3.0f) + 0.7f;
    const float value = strength * dice.Between(0.3f, 1);
    const int reach = static_cast<int>(std::ceil(radius));
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (static_cast<float>(dx * dx + dy * dy) > radius * radius) continue;
        image->at<float>((cy + dy + kSide) % kSide, (cx + dx + kSide) % kSide) += value;
      }
    }
  }
}

cv::Mat Plaster(uint32_t seed) {
  cv::Mat image = 0.05f * Fractal(4, 4, 0.8f, seed);
  AddSpots(250, 7, -0.25f, seed + 1, &image);
  AddSpots(150, 5, 0.15f, seed + 2, &image);
  return image;
}

cv::Mat Concrete(uint32_t seed) {
  cv::Mat image = 0.13f * Fractal(4, 4, 0.75f, seed);
  image += Cells({2, 2, 3, 0.06f, -0.3f, false}, seed + 1);
  AddSpots(1500, 6, -0.4f, seed + 2, &image);
  return image;
}

cv::Mat Wood(uint32_t seed) {
  cv::Mat image = 0.18f * Fractal(4, 128, 0.7f, seed) + 0.08f * Fractal(8, 8, 0.6f, seed + 1);
  image += Cells({2, 16, 2, 0.16f, -0.5f, true}, seed + 2);
  AddSpots(30, 14, -0.3f, seed + 3, &image);
  return image;
}

cv::Mat Carpet(uint32_t seed) {
  cv::Mat image = 0.08f * Fractal(4, 4, 0.7f, seed) + 0.16f * Fractal(64, 64, 0.9f, seed + 1);
  image += Cells({4, 4, 1, 0.07f, -0.1f, false}, seed + 2);
  return image;
}

// Running bond of 25 x 7.5 cm with mortar of 1 cm.
cv::Mat Brick(uint32_t seed) {
  return Cells({10, 34, 4, 0.22f, 0.3f, true, 0.15f, 0.8f}, seed) +
         0.08f * Fractal(16, 16, 0.8f, seed + 1) + 0.03f * Fractal(4, 4, 0.7f, seed + 2);
}

// Concrete blocks of 40 x 20 cm with joints of 1 cm that hardly differ from them.
cv::Mat Block(uint32_t seed) {
  cv::Mat image = Cells({6, 12, 4.2f, 0.05f, -0.12f, true, 0.12f, 0.7f}, seed);
  image += 0.06f * Fractal(4, 4, 0.75f, seed + 1) + 0.06f * Fractal(128, 128, 0.9f, seed + 2);
  AddSpots(2500, 3, -0.25f, seed + 3, &image);
  return image;
}

// Where boards of 10 to 20 cm begin, and the end.
std::vector<int> BoardStarts(Dice* dice) {
  constexpr int kLeast_px = 40, kMost_px = 80;
  std::vector<int> starts = {0};
  while (kSide - starts.back() > kMost_px) {
    const int rest_px = kSide - starts.back();
    starts.push_back(starts.back() + kLeast_px +
                     dice->Below(std::min(kMost_px, rest_px - kLeast_px) - kLeast_px + 1));
  }
  starts.push_back(kSide);
  return starts;
}

// Boards side by side: each of another trunk, with a dark joint and a bright rim.
cv::Mat Timber(uint32_t seed) {
  constexpr float kJoint_px = 1.6f, kRing_px = 9;
  const cv::Mat grain = Fractal(4, 256, 0.7f, seed), bend = Fractal(2, 8, 0.5f, seed + 1);
  Dice dice(seed + 2);
  const std::vector<int> starts = BoardStarts(&dice);
  cv::Mat image(kSide, kSide, CV_32F);
  for (size_t board = 0; board + 1 < starts.size(); ++board) {
    const int shift = dice.Below(kSide);
    const float shade = dice.Between(-0.16f, 0.16f), rings = dice.Between(0.03f, 0.12f);
    const float heart_px = dice.Between(-20, 100);
    for (int y = starts[board]; y < starts[board + 1]; ++y) {
      const float off_px = static_cast<float>(y - starts[board]);
      const float joint = std::clamp(kJoint_px - off_px, 0.0f, 1.0f);
      for (int x = 0; x < kSide; ++x) {
        const int from = (x + shift) % kSide;
        const float ring = (std::abs(off_px - heart_px) + 25 * bend.at<float>(y, from)) / kRing_px;
        const float face = shade + rings * std::sin(ring) + 0.10f * grain.at<float>(y, from);
        image.at<float>(y, x) = (1 - joint) * face - 0.7f * joint;
      }
    }
  }
  AddSpots(25, 9, -0.3f, seed + 3, &image);
  return image;
}

// Panels of 60 cm with pinholes in a grid of bright bars of 24 mm, which stand in a dark gap.
cv::Mat CeilingGrid(uint32_t seed) {
  constexpr int kPanels = 4;
  constexpr float kBar_px = 10.2f, kGap_px = 1.3f;
  cv::Mat image = Cells({kPanels, kPanels, 0, 0.03f, 0, false}, seed);
  image += 0.02f * Fractal(4, 4, 0.7f, seed + 1);
  AddSpots(9000, 2, -0.35f, seed + 2, &image);
  const auto from_bar = [](int at) {
    constexpr float kPanel_px = 1.0f * kSide / kPanels;
    const float off = std::fmod(static_cast<float>(at) + 0.5f, kPanel_px);
    return std::min(off, kPanel_px - off);
  };
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float off_px = std::min(from_bar(x), from_bar(y)) - kBar_px / 2;
      const float bar = std::clamp(0.5f - off_px, 0.0f, 1.0f);
      const float gap = std::clamp(0.5f + kGap_px - off_px, 0.0f, 1.0f) - bar;
      float& value = image.at<float>(y, x);
      value = (1 - bar - gap) * value + 0.12f * bar - 0.45f * gap;
    }
  }
  return image;
}

cv::Mat Metal(uint32_t seed) {
  cv::Mat image = 0.05f * Fractal(8, 256, 0.8f, seed) + 0.07f * Fractal(4, 4, 0.6f, seed + 1);
  AddSpots(120, 8, -0.3f, seed + 2, &image);
  return image;
}

// 20 cm, with joints of 3 mm; glazed, so nearly uniform.
cv::Mat Tiles(uint32_t seed) {
  return Cells({13, 13, 1.2f, 0.05f, -0.5f, false}, seed) + 0.04f * Fractal(8, 8, 0.8f, seed + 1);
}

// A block of lines of letter-like strokes.
void DrawText(const cv::Rect& box, Dice* dice, cv::Mat* image) {
  const int height = 8 + dice->Below(24);
  const float ink = dice->Between(-0.9f, -0.4f);
  for (int y = box.y; y + height < box.y + box.height; y += 2 * height) {
    for (int x = box.x; x + height < box.x + box.width; x += 2 + dice->Below(height)) {
      const int w = 2 + dice->Below(height / 2 + 1), h = 2 + dice->Below(height);
      cv::rectangle(*image, {x, y + dice->Below(height - h + 1), w, h}, cv::Scalar(ink),
                    cv::FILLED);
      x += w;
    }
  }
}

void DrawThing(Dice* dice, cv::Mat* image) {
  const int w = 60 + dice->Below(kSide / 2), h = 40 + dice->Below(kSide / 3);
  const cv::Rect box(dice->Below(kSide - w), dice->Below(kSide - h), w, h);
  const cv::Scalar value(dice->Between(-0.8f, 0.8f));
  switch (dice->Below(5)) {
    case 0:
      cv::rectangle(*image, box, value, cv::FILLED);
      break;
    case 1:
      cv::ellipse(*image,
                  cv::RotatedRect(0.5 * cv::Point2f(box.tl() + box.br()), cv::Size2f(box.size()),
                                  dice->Between(0, 180)),
                  value, cv::FILLED);
      break;
    case 2:
      cv::line(*image, box.tl(), box.br(), value, 3 + dice->Below(20));
      break;
    default:
      DrawText(box, dice, image);
  }
}

cv::Mat Poster(uint32_t seed) {
  Dice dice(seed);
  cv::Mat image = 0.04f * Fractal(4, 4, 0.7f, seed + 1);
  const float slope = dice.Between(-0.5f, 0.5f);
  for (int y = 0; y < kSide; ++y) {
    image.row(y) += slope * (static_cast<float>(y) / kSide - 0.5f);
  }
  for (int i = 0; i < 16; ++i) DrawThing(&dice, &image);
  cv::rectangle(image, {0, 0, kSide, kSide}, cv::Scalar(0.6), 36);
  return image;
}

// A tag with its white border, as the seed says (kTagsOfFamily); seen from the front, u to the
// right and v up.
cv::Mat Tag(uint32_t seed) {
  constexpr double kBlack = -0.7, kWhite = 0.5;
  const auto dictionary =
      cv::aruco::getPredefinedDictionary(static_cast<int>(seed / kTagsOfFamily));
  const int side = dictionary->markerSize + 2;
  cv::Mat cells;
  cv::aruco::drawMarker(dictionary, static_cast<int>(seed % kTagsOfFamily), side, cells);
  cv::copyMakeBorder(cells, cells, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::resize(cells, cells, {kSide, kSide}, 0, 0, cv::INTER_NEAREST);
  cv::flip(cells, cells, 0);
  cv::Mat image;
  cells.convertTo(image, CV_32F, (kWhite - kBlack) / 255, kBlack);
  return image;
}

cv::Mat Deviations(TextureKind kind, uint32_t seed) {
  switch (kind) {
    case TextureKind::kPlaster:
      return Plaster(seed);
    case TextureKind::kConcrete:
      return Concrete(seed);
    case TextureKind::kWood:
      return Wood(seed);
    case TextureKind::kCarpet:
      return Carpet(seed);
    case TextureKind::kBrick:
      return Brick(seed);
    case TextureKind::kMetal:
      return Metal(seed);
    case TextureKind::kTiles:
      return Tiles(seed);
    case TextureKind::kBlock:
      return Block(seed);
    case TextureKind::kTimber:
      return Timber(seed);
    case TextureKind::kCeilingGrid:
      return CeilingGrid(seed);
    case TextureKind::kPoster:
      return Poster(seed);
    case TextureKind::kTag:
      return Tag(seed);
    case TextureKind::kPlain:
    case TextureKind::kLamp:
      break;
  }
  return cv::Mat::zeros(kSide, kSide, CV_32F);
}

// So that whole numbers of cells are of the usual sizes.
float TexelSize_m(TextureKind kind) {
  switch (kind) {
    case TextureKind::kBrick:
      return 2.5f / kSide;
    case TextureKind::kTiles:
      return 2.6f / kSide;
    case TextureKind::kBlock:
    case TextureKind::kCeilingGrid:
      return 2.4f / kSide;
    default:
      return 0.0025f;
  }
}

uint32_t Variant(const SurfaceMaterial& material) {
  switch (material.texture) {
    case TextureKind::kPlain:
    case TextureKind::kLamp:
      return 0;
    case TextureKind::kPoster:
      return material.seed % 12;
    case TextureKind::kTag:
      return material.seed;
    default:
      return material.seed % 2;
  }
}

}  // namespace

TextureTile MakeTexture(TextureKind kind, uint32_t seed) {
  const bool is_tag = kind == TextureKind::kTag;  // whose seed says what it shows
  cv::Mat level = Deviations(kind, is_tag ? seed : Mixed(seed, 100 + static_cast<uint32_t>(kind)));
  level -= cv::mean(level)[0];
  TextureTile tile;
  tile.texel_m = TexelSize_m(kind);
  for (int l = 0; l < TextureTile::kLevels; ++l) {
    cv::Mat bytes;
    level.convertTo(bytes, CV_8U, 128, 128);
    tile.levels[l].assign(bytes.begin<uint8_t>(), bytes.end<uint8_t>());
    if (level.cols > 1)
      cv::resize(level.clone(), level, {level.cols / 2, level.rows / 2}, 0, 0, cv::INTER_AREA);
  }
  return tile;
}

TextureSet::TextureSet(const std::vector<SurfaceMaterial>& materials) {
  for (const SurfaceMaterial& material : materials) {
    const uint32_t variant = Variant(material);
    const auto [at, is_new] = tiles_.try_emplace({material.texture, variant});
    if (is_new) at->second = MakeTexture(material.texture, variant);
  }
}

const TextureTile& TextureSet::Of(const SurfaceMaterial& material) const {
  return tiles_.at({material.texture, Variant(material)});
}

}  // namespace slcmap::data
