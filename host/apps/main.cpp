// SPDX-License-Identifier: Apache-2.0
#include "program.hpp"
#include "symrig/base/standard_streams.hpp"

int main(int argc, char** argv) {
  symrig::reserve_standard_streams();
  return symrig::apps::run_program(symrig::apps::symrig_program(), argc, argv);
}
