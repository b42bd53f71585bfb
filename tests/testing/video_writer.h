// Videos for tests.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

namespace slcmap::testing {

// Packs frames without loss, each at its own time.
class VideoWriter {
 public:
  VideoWriter(const std::string& path, const cv::Size& size_px, double turned_deg = 0) {
    avformat_alloc_output_context2(&format_, nullptr, nullptr, path.c_str());
    const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_FFV1);
    encoder_ = avcodec_alloc_context3(codec);
    encoder_->width = size_px.width;
    encoder_->height = size_px.height;
    encoder_->pix_fmt = AV_PIX_FMT_GRAY8;
    encoder_->time_base = {1, 1000};
    avcodec_open2(encoder_, codec, nullptr);
    stream_ = avformat_new_stream(format_, codec);
    avcodec_parameters_from_context(stream_->codecpar, encoder_);
    if (turned_deg != 0) {
      constexpr size_t kMatrixBytes = 36;
      av_display_rotation_set(reinterpret_cast<int32_t*>(av_stream_new_side_data(
                                  stream_, AV_PKT_DATA_DISPLAYMATRIX, kMatrixBytes)),
                              turned_deg);
    }
    avio_open(&format_->pb, path.c_str(), AVIO_FLAG_WRITE);
    EXPECT_GE(avformat_write_header(format_, nullptr), 0);
  }
  ~VideoWriter() {
    Send(nullptr);
    av_write_trailer(format_);
    avio_closep(&format_->pb);
    avcodec_free_context(&encoder_);
    avformat_free_context(format_);
  }

  void Add(const cv::Mat& grey, int64_t time_ms) {
    AVFrame* frame = av_frame_alloc();
    frame->format = AV_PIX_FMT_GRAY8;
    frame->width = grey.cols;
    frame->height = grey.rows;
    frame->pts = time_ms;
    av_frame_get_buffer(frame, 0);
    for (int row = 0; row < grey.rows; ++row) {
      std::copy_n(grey.ptr(row), grey.cols, frame->data[0] + row * frame->linesize[0]);
    }
    Send(frame);
    av_frame_free(&frame);
  }

 private:
  void Send(const AVFrame* frame) {
    avcodec_send_frame(encoder_, frame);
    AVPacket* packet = av_packet_alloc();
    while (avcodec_receive_packet(encoder_, packet) >= 0) {
      av_packet_rescale_ts(packet, encoder_->time_base, stream_->time_base);
      av_interleaved_write_frame(format_, packet);
    }
    av_packet_free(&packet);
  }

  AVFormatContext* format_ = nullptr;
  AVCodecContext* encoder_ = nullptr;
  AVStream* stream_ = nullptr;
};

}  // namespace slcmap::testing
