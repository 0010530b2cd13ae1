// SPDX-License-Identifier: Apache-2.0
#include "requests.hpp"

#include "symrig/base/files.hpp"

namespace symrig::mpi {

Together::~Together() {
  if (done_) return;
  write_standard_error(
      "symrig-mpi: a rank cannot go on (out of memory?); use more machines or a smaller scene\n");
  abort_all(exit_code(ErrorCode::limit));
}

}  // namespace symrig::mpi
