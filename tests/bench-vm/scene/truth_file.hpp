// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// An exposure as TruthLog records it.
struct TrueExposure {
  std::uint64_t frame = 0;  ///< number of exposures before it
  Nanoseconds open{};
  std::uint64_t picture = 0;  ///< key of the picture that was lit
  bool pure = false;          ///< no other picture was lit, and this one nearly all the time
  double share = 1;           ///< of the time in which it was lit; the screen was dark for the rest

  Nanoseconds lit() const;  ///< the time in which it was lit
};

/// Equal pictures have equal keys.
std::uint64_t picture_key(const Image<float>& picture);

/// The exposures of a log, in order.
/// fails: not_found, bad_format (the message names the line).
Result<std::vector<TrueExposure>> read_true_exposures(const std::string& path);

}  // namespace symrig::bench_vm
