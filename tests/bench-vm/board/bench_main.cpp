// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/mman.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ::mlockall(MCL_CURRENT);  // in virtual time, loading a page from outside the guest takes seconds
  return RUN_ALL_TESTS();
}
