// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>

namespace symrig {

/// Memory speed and relighting time with the same number of threads, measured in the same minute.
struct ThreadSpeed {
  int threads = 1;
  double triad_bytes_per_second = 0;  ///< best round; 12 bytes for each element, as in STREAM
  double relight_seconds = 0;         ///< one photograph, median round, tensor in no cache
};

struct RelightSpeed {
  std::int64_t array_bytes = 0;   ///< of each of the triad's three arrays
  std::int64_t tensor_bytes = 0;  ///< read once for a photograph
  ThreadSpeed one, all;           ///< one thread; every thread of the machine

  /// The tensor's bytes per second as a share of the triad's. 1 means that relighting runs at memory speed.
  double share_of_triad(const ThreadSpeed& speed) const;
};

struct RelightSpeedOptions {
  std::int64_t array_bytes = 0;  ///< 0: more than four times the last-level cache, at least 128 MiB
  int rounds = 15;
  Progress progress = {};  ///< may be empty; one event for each round
};

/// Compares the time of T · pattern with a triad a = b + s c over arrays that fit into no cache. The two
/// alternate in one run. So each application finds the tensor in no cache, and both see the same state of the
/// machine. The threads of the library are limited meanwhile.
/// fails: bad_argument (no rounds), limit (no memory for the arrays), interrupted.
/// source: McCalpin, STREAM.
Result<RelightSpeed> measure_relight(const TransportTensor& tensor, const RelightSpeedOptions& options = {});

}  // namespace symrig
