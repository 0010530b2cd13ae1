// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/camera_picture.hpp"

#include <gtest/gtest.h>

namespace symrig::bench_vm::camera_picture_test {
namespace {

TEST(CameraPicture, puts_the_grid_where_it_is_asked_for) {
  const CameraPicture picture{{3, 4}, {2, 2}, 1, 2, 0x0140};
  const std::uint16_t codes[] = {0x0fff, 0x0001, 0x0234, 0x0000};
  const std::vector<std::uint8_t> expected{
      0x40, 1, 0x40, 1, 0x40, 1,    0x40, 1,  //
      0x40, 1, 0x40, 1, 0xff, 0x0f, 0x01, 0,  //
      0x40, 1, 0x40, 1, 0x34, 0x02, 0x00, 0,
  };
  EXPECT_EQ(picture.bytes(codes), expected);
}

TEST(CameraPicture, refuses_a_grid_that_does_not_fit) {
  EXPECT_TRUE((CameraPicture{{3, 4}, {3, 4}, 0, 0, 0}.check()));
  for (const CameraPicture& picture :
       {CameraPicture{{3, 4}, {3, 4}, 1, 0, 0}, CameraPicture{{3, 4}, {3, 5}, 0, 0, 0},
        CameraPicture{{3, 4}, {1, 1}, -1, 0, 0}, CameraPicture{{3, 4}, {1, 1}, 0, 4, 0}}) {
    const auto checked = picture.check();
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::size_mismatch);
  }
}

}  // namespace
}  // namespace symrig::bench_vm::camera_picture_test
