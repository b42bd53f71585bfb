#include "export/page_writer.h"

#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <algorithm>
#include <memory>
#include <string_view>

#include "data/error.h"
#include "export/page_pack.h"

namespace slcmap {
namespace {

constexpr std::string_view kMark = "@SLCMAP_MAP@";

struct EndDeflate {
  void operator()(z_stream* stream) const { deflateEnd(stream); }
};

// In the zlib format, which browsers call "deflate".
std::string Deflate(std::string bytes, int level, const Progress& progress) {
  z_stream stream{};
  if (deflateInit(&stream, level) != Z_OK) throw Error("zlib: cannot be set up");
  const std::unique_ptr<z_stream, EndDeflate> end(&stream);
  constexpr std::size_t kStep = 1 << 20;
  std::string compressed, room(kStep, '\0');
  std::size_t done = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    progress.ReportOrStop(static_cast<double>(done) / static_cast<double>(bytes.size() + 1));
    const std::size_t part = std::min(kStep, bytes.size() - done);
    stream.next_in = reinterpret_cast<Bytef*>(bytes.data() + done);
    stream.avail_in = static_cast<uInt>(part);
    done += part;
    // What earlier parts left inside may need more room than this part does.
    do {
      stream.next_out = reinterpret_cast<Bytef*>(room.data());
      stream.avail_out = static_cast<uInt>(room.size());
      state = deflate(&stream, done == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
      compressed.append(room, 0, room.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  }
  return compressed;
}

std::string Base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < count ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text.push_back(k <= count ? kDigits[(group >> (18 - 6 * k)) & 63] : '=');
    }
  }
  return text;
}

std::size_t FindMark(const std::string& page_template) {
  const std::size_t at = page_template.find(kMark);
  const bool once =
      at != std::string::npos && page_template.find(kMark, at + 1) == std::string::npos;
  if (once) return at;
  throw ConfigError(fmt::format("page: found a template {} the mark {}, expected it once",
                                at == std::string::npos ? "without" : "with several of", kMark));
}

}  // namespace

void PageOptions::Check() const {
  if (compression >= 1 && compression <= 9) return;
  throw ConfigError(fmt::format("compression: found {}, expected 1 to 9", compression));
}

std::string MakePage(const MapResult& map, const std::string& page_template,
                     const PageOptions& options, const std::vector<PageImage>& images,
                     const Progress& progress) {
  options.Check();
  const std::size_t mark = FindMark(page_template);
  const std::string title = options.title.empty() ? map.id : options.title;
  std::string pack = PackForPage(map, title, images, progress.Part(0, 0.3));
  const std::string compressed =
      Deflate(std::move(pack), options.compression, progress.Part(0.3, 0.95));
  const std::string text = Base64(compressed);
  std::string page;
  page.reserve(page_template.size() + text.size());
  page.append(page_template, 0, mark).append(text);
  page.append(page_template, mark + kMark.size());
  return page;
}

}  // namespace slcmap
