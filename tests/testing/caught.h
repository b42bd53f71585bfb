// The error that a call throws, for what it holds beside its message.
#pragma once

#include <stdexcept>

namespace slcmap::testing {

template <typename E, typename Call>
E Caught(Call call) {
  try {
    call();
  } catch (const E& error) {
    return error;
  }
  throw std::logic_error("nothing was thrown");
}

}  // namespace slcmap::testing
