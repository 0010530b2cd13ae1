// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/paged_memory.hpp"
#include "symrig/base/result.hpp"

#include <exception>
#include <new>
#include <string>
#include <utility>

namespace symrig {

inline constexpr const char* kMoreMemory = "use a smaller grid or a machine with more memory";

/// Turns exceptions of a long job into errors, so that its caller can still report what is kept.
template <class Work>
auto guarded(Work&& work) -> decltype(work()) {
  try {
    return std::forward<Work>(work)();
  } catch (const NoScratchSpace& error) {
    return Error{ErrorCode::io, error.what(), "free space on that disk, or allow more memory"};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::limit, "out of memory", kMoreMemory};
  } catch (const std::exception& error) {
    return Error{ErrorCode::limit, std::string("internal fault: ") + error.what(), ""};
  }
}

}  // namespace symrig
