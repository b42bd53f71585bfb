#include "data/video/video.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>

namespace slcmap::inline data {
namespace {

constexpr const char* kBrokenFrames = "video_frames_that_cannot_be_decoded";
constexpr AVRational kNanoseconds = {1, 1'000'000'000};

struct Closer {
  void operator()(AVFormatContext* format) const { avformat_close_input(&format); }
  void operator()(AVCodecContext* decoder) const { avcodec_free_context(&decoder); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

std::string AvProblem(int code) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text = {};
  av_strerror(code, text.data(), text.size());
  return text.data();
}

// Whether the first plane holds what is grey, a byte a pixel.
bool HasGreyPlane(const AVPixFmtDescriptor& form) {
  constexpr uint64_t kOthers = AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL |
                               AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_BAYER |
                               AV_PIX_FMT_FLAG_HWACCEL;
  const AVComponentDescriptor& grey = form.comp[0];
  return (form.flags & kOthers) == 0 && grey.plane == 0 && grey.depth == 8 && grey.step == 1;
}

}  // namespace

class VideoFile::Impl {
 public:
  explicit Impl(const std::string& path) : path_(path), frame_(av_frame_alloc()) {
    av_log_set_level(AV_LOG_FATAL);  // what is wrong is counted here
    AVFormatContext* format = nullptr;
    if (const int code = avformat_open_input(&format, path.c_str(), nullptr, nullptr); code < 0) {
      Fail(fmt::format("no video that can be opened ({})", AvProblem(code)));
    }
    format_.reset(format);
    if (avformat_find_stream_info(format, nullptr) < 0) Fail("no streams");
    const AVCodec* codec = nullptr;
    stream_ = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0 || codec == nullptr) Fail("no stream of images that can be decoded");
    decoder_.reset(avcodec_alloc_context3(codec));
    avcodec_parameters_to_context(decoder_.get(), Stream().codecpar);
    if (avcodec_open2(decoder_.get(), codec, nullptr) < 0) Fail("a stream without a decoder");
    if (IsTaggedAsTurned())
      warnings_.Add("turned_videos_taken_as_stored_calibrate_with_images_as_stored", path_);
  }

  std::optional<VideoFrame> Next() {
    while (true) {
      const int code = avcodec_receive_frame(decoder_.get(), frame_.get());
      if (code == AVERROR_EOF) return std::nullopt;
      if (code == AVERROR(EAGAIN)) {
        Feed();
      } else if (code < 0 || frame_->decode_error_flags != 0 ||
                 (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0) {
        CountBroken();
      } else if (frame_->best_effort_timestamp == AV_NOPTS_VALUE) {
        warnings_.Add("video_frames_without_a_time", path_);
      } else {
        return Take();
      }
    }
  }

  double Done() const {
    if (format_->duration <= 0) return 0;
    const double duration_s = static_cast<double>(format_->duration) / AV_TIME_BASE;
    return std::clamp(
        (static_cast<double>(last_ns_ - first_ns_.value_or(last_ns_)) * 1e-9) / duration_s, 0.0,
        1.0);
  }

  const Warnings& warnings() const { return warnings_; }

 private:
  const AVStream& Stream() const { return *format_->streams[stream_]; }

  // Phones tag so what was filmed upright; programs that calibrate may have turned its images.
  bool IsTaggedAsTurned() const {
    const uint8_t* matrix = av_stream_get_side_data(&Stream(), AV_PKT_DATA_DISPLAYMATRIX, nullptr);
    constexpr double kLeast_deg = 1;
    return matrix != nullptr &&
           std::abs(av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix))) > kLeast_deg;
  }

  [[noreturn]] void Fail(const std::string& found) const {
    throw DataError(fmt::format("{}: found {}, expected a video", path_, found));
  }

  void CountBroken() { warnings_.Add(kBrokenFrames, path_); }

  // The next packet of the stream, or, at the end, that nothing comes any more.
  void Feed() {
    const std::unique_ptr<AVPacket, Closer> packet(av_packet_alloc());
    while (av_read_frame(format_.get(), packet.get()) >= 0) {
      const bool is_ours = packet->stream_index == stream_;
      if (is_ours && avcodec_send_packet(decoder_.get(), packet.get()) < 0) CountBroken();
      av_packet_unref(packet.get());
      if (is_ours) return;
    }
    avcodec_send_packet(decoder_.get(), nullptr);
  }

  VideoFrame Take() {
    const cv::Size size(frame_->width, frame_->height);
    if (!size_.empty() && size != size_) {
      Fail(fmt::format("frames of {}x{} pixels behind others of {}x{}", size.width, size.height,
                       size_.width, size_.height));
    }
    size_ = size;
    last_ns_ = av_rescale_q(frame_->best_effort_timestamp, Stream().time_base, kNanoseconds);
    if (!first_ns_) first_ns_ = last_ns_;
    VideoFrame taken{last_ns_, MakeGrey()};
    av_frame_unref(frame_.get());
    return taken;
  }

  cv::Mat MakeGrey() {
    const auto form = static_cast<AVPixelFormat>(frame_->format);
    const AVPixFmtDescriptor* described = av_pix_fmt_desc_get(form);
    if (described != nullptr && HasGreyPlane(*described)) {
      return cv::Mat(size_, CV_8UC1, frame_->data[0], static_cast<size_t>(frame_->linesize[0]))
          .clone();
    }
    if (!scaler_) {
      scaler_.reset(sws_getContext(size_.width, size_.height, form, size_.width, size_.height,
                                   AV_PIX_FMT_GRAY8, SWS_POINT, nullptr, nullptr, nullptr));
    }
    if (!scaler_) Fail("pixels in a form that cannot be made grey");
    cv::Mat grey(size_, CV_8UC1);
    uint8_t* rows[1] = {grey.data};
    const int steps[1] = {static_cast<int>(grey.step)};
    sws_scale(scaler_.get(), frame_->data, frame_->linesize, 0, size_.height, rows, steps);
    return grey;
  }

  const std::string path_;
  std::unique_ptr<AVFormatContext, Closer> format_;
  std::unique_ptr<AVCodecContext, Closer> decoder_;
  std::unique_ptr<AVFrame, Closer> frame_;
  std::unique_ptr<SwsContext, Closer> scaler_;  // of pixels that have no grey plane
  int stream_ = -1;
  cv::Size size_;
  std::optional<int64_t> first_ns_;
  int64_t last_ns_ = 0;
  Warnings warnings_;
};

VideoFile::VideoFile(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
VideoFile::~VideoFile() = default;
std::optional<VideoFrame> VideoFile::Next() { return impl_->Next(); }
double VideoFile::Done() const { return impl_->Done(); }
const Warnings& VideoFile::warnings() const { return impl_->warnings(); }

bool IsVideoName(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".mp4" || extension == ".mkv" || extension == ".mov" || extension == ".avi";
}

}  // namespace slcmap::data
