// Bags as the output of a command: how they are packed, and that they are there whole or not at
// all.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "data/bag/bag.h"
#include "data/video/video.h"

namespace slcmap::inline commands {

inline constexpr const char* kFolder = "folder";  // what is no bag, as a form

// By the output's name, and what --packing says otherwise. Throws ConfigError.
BagPacking ParsePacking(const std::string& output, const std::string& packing);

// How commands that take videos are told what belongs to one.
void AddVideoOptions(CLI::App& command, VideoRecording* video);

// Throws ConfigError where they contradict, or were said of what is no video. Whether it is one.
bool CheckVideoOptions(const std::string& input, const VideoRecording& video);

// Throws DataError where it is one: what else takes recordings takes the folder made of it.
void RefuseVideo(const std::string& path);

// Writes the recording of a video, with its log and all its frames, as a folder (mav0 in it).
// Throws ConfigError where there is one, and what FindVideoRecording and UnpackVideo do.
void UnpackVideoInto(const std::string& path, const std::string& input, const VideoRecording& said);

// Has a bag made beside its path, and puts it there when it is whole. What else `make` needs has
// the path that it gets with more behind it, and goes with the end. Throws ConfigError where
// something is there that would be lost, or `input` would.
void MakeOutputBag(const std::string& path, const BagPacking& packing, const std::string& input,
                   const std::function<void(const std::string& at)>& make);

}  // namespace slcmap::commands
