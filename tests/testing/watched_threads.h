// Threads that the thread sanitizer can follow.
#pragma once

namespace slcmap::testing {

// Makes cv::parallel_for_ run on threads of its own. Those of the library that OpenCV comes with
// are not built with the sanitizer, which takes all that they hand over for races. Call before any
// other thread is there.
void RunOnWatchedThreads();

}  // namespace slcmap::testing
