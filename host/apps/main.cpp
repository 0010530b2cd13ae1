// SPDX-License-Identifier: Apache-2.0
#include "program.hpp"
#include "symrig/base/files.hpp"

int main(int argc, char** argv) {
  symrig::reserve_standard_streams();
  return symrig::apps::run_program(symrig::apps::symrig_program(), argc, argv);
}
