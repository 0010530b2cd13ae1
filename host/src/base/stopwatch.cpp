// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/stopwatch.hpp"

#include <algorithm>

namespace symrig {

Nanoseconds steady_now() {
  return std::chrono::duration_cast<Nanoseconds>(std::chrono::steady_clock::now().time_since_epoch());
}

Nanoseconds Deadline::left() const {
  return std::max(at_ - steady_now(), Nanoseconds{0});
}

}  // namespace symrig
