// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ranks.hpp"

#include <cstdint>

namespace symrig::mpi {

/// What the first rank asks of the others, which wait in help().
struct Request {
  enum Kind : std::int32_t { open, photographs, adjoint, refit, end } kind;
  std::int32_t number = 0;  ///< of patterns, or the exit code
};

/// From a request to the end of its work. Whoever leaves before done(), by an error or an exception, would
/// leave the other ranks waiting, so it ends them.
class Together {
 public:
  /// On the first rank.
  Together(const Ranks& ranks, Request request) { ranks.broadcast_value(request); }
  /// On a rank that has got a request.
  Together() = default;
  Together(const Together&) = delete;
  Together& operator=(const Together&) = delete;
  ~Together();
  void done() { done_ = true; }

 private:
  bool done_ = false;
};

}  // namespace symrig::mpi
