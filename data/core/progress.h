// How long work of a library reports how far it has come, and learns that it should end.
#pragma once

#include <functional>

#include "data/core/error.h"

namespace slcmap::inline data {

// Work was ended, as its caller asked, before it had a result of use.
class StoppedError : public Error {
 public:
  using Error::Error;
};

// What a long function gets from its caller, as its last parameter: whom to report to and to ask
// whether to go on. A Progress made of nothing goes unheard and never ends the work.
//
//   for (size_t i = 0; i < items.size(); ++i) {
//     if (i % 1000 == 0 && !progress.Report(double(i) / items.size())) break;
//     ...
//   }
class Progress {
 public:
  // Gets the share that is done, in [0, 1]; returns whether to go on. Called in the thread that
  // reports; cheap enough for thousands of calls a second.
  using Callback = std::function<bool(double done)>;

  Progress() = default;
  explicit Progress(Callback callback) : callback_(std::move(callback)) {}

  // False: end soon (within a tenth of a second), with what is done so far. Work reports often
  // enough for that.
  bool Report(double done) const { return !callback_ || callback_(done); }

  // The same for work whose unfinished result is of no use: throws StoppedError.
  void ReportOrStop(double done) const {
    if (!Report(done)) throw StoppedError("interrupted");
  }

  // For a part of the work: its share 0 is `from` of the whole, its share 1 is `to`.
  Progress Part(double from, double to) const {
    if (!callback_) return Progress();
    return Progress([callback = callback_, from, to](double done) {
      return callback(from + done * (to - from));
    });
  }

 private:
  Callback callback_;
};

}  // namespace slcmap::data
