// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace symrig {

/// A wire from one of the board's outputs to one of its inputs that stamps edges.
struct Jumper {
  std::string output, input;
};

}  // namespace symrig
