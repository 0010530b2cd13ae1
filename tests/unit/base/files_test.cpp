// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/files.hpp"

#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::fd_test {
namespace {

int open_null() {
  return ::open("/dev/null", O_RDONLY | O_CLOEXEC);
}

bool is_open(int fd) {
  return ::fcntl(fd, F_GETFD) >= 0;
}

TEST(Fd, closes_at_its_end) {
  int number = -1;
  {
    const Fd fd(open_null());
    number = fd.get();
    ASSERT_TRUE(fd);
    EXPECT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
  EXPECT_FALSE(Fd());
  EXPECT_FALSE(Fd(-1));
}

TEST(Fd, has_one_owner) {
  Fd first(open_null());
  const int number = first.get();
  Fd second(std::move(first));
  EXPECT_FALSE(first);  // NOLINT(bugprone-use-after-move): that it owns nothing is the promise
  EXPECT_EQ(second.get(), number);
  EXPECT_TRUE(is_open(number));
  second = Fd();
  EXPECT_FALSE(second);
  EXPECT_FALSE(is_open(number)) << "what it owned went with the temporary";
}

TEST(Fd, close_says_whether_the_system_agrees) {
  Fd fd(open_null());
  const int number = fd.get();
  EXPECT_TRUE(fd.close());
  EXPECT_FALSE(is_open(number));
  EXPECT_FALSE(fd);
  EXPECT_TRUE(fd.close()) << "nothing to close";
  Fd wrong(open_null());
  ASSERT_EQ(::close(wrong.get()), 0);
  EXPECT_FALSE(wrong.close());
}

}  // namespace
}  // namespace symrig::fd_test
