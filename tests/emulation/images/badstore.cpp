// SPDX-License-Identifier: Apache-2.0
// What must not work: a plain store to flash.
#include "rp2040.hpp"

RP_RESULTS;
using namespace rp;

void program() {
  start_clocks();
  reg(0x10008000) = 0;
}
