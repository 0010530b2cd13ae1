// SPDX-License-Identifier: Apache-2.0
// The first rank runs the tests; the others help it, as in `symrig-mpi`.
#include "dealt_transport.hpp"
#include "ranks.hpp"

#include <gtest/gtest.h>

int main(int argc, char** argv) {
  const symrig::mpi::Session session(argc, argv);
  const symrig::mpi::Ranks ranks = symrig::mpi::Ranks::world();
  if (!ranks.first()) return symrig::mpi::help(ranks);
  testing::InitGoogleTest(&argc, argv);
  const int code = RUN_ALL_TESTS();
  symrig::mpi::release(ranks, code);
  return code;
}
