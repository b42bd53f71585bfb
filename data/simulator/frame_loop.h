// Frames of a sequence made in several threads.
#pragma once

#include <functional>

namespace slcmap {

// Calls make(i) for i = 0, 1, ... count - 1, each from one of `threads` threads that take them up
// in this order, and progress(frames done so far) from the calling thread as they get done; no
// further frame is begun once progress returns false. Returns the number of frames made: these are
// the first ones. A StoppedError of make ends the loop too, and its frame and those after it do not
// count as made; any other exception ends the loop and is thrown on.
int MakeFrames(int count, int threads, const std::function<void(int)>& make,
               const std::function<bool(int)>& progress);

}  // namespace slcmap
