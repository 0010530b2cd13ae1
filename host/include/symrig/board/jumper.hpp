// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace symrig {

/// A wire from an output of the board to one of its inputs. The input must stamp edges.
struct Jumper {
  std::string output, input;
};

}  // namespace symrig
