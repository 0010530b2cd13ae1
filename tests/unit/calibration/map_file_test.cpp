// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/map_file.hpp"

#include "scratch.hpp"
#include "symrig/image/file.hpp"
#include "synthetic_photographs.hpp"

#include <filesystem>

#include <gtest/gtest.h>

namespace symrig::map_file_test {
namespace {

Image<float> good() {
  Image<float> picture(Grid{3, 4}, 3);
  picture.at(1, 2, 0) = 63;
  picture.at(1, 2, 1) = 0.25F;
  picture.at(1, 2, 2) = 1;
  return picture;
}

TEST(MapFile, ComesBackAsItWasWritten) {
  const auto map = decode(test::default_photographs());
  ASSERT_TRUE(map.ok()) << map.error().line();
  const test::Scratch scratch;
  const auto path = scratch / "map.exr";
  ASSERT_TRUE(write_image(path, map_picture(*map)).ok());
  const auto read = read_pixel_map(path, map->projector);
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->camera, map->camera);
  EXPECT_EQ(read->mask, map->mask);
  for (std::size_t i = 0; i < map->mask.values().size(); ++i) {
    EXPECT_EQ(read->col.values()[i], map->mask.values()[i] ? map->col.values()[i] : 0);
    EXPECT_EQ(read->row.values()[i], map->mask.values()[i] ? map->row.values()[i] : 0);
  }
}

TEST(MapFile, OfAnotherProjectorNamesThePixel) {
  EXPECT_TRUE(map_of_picture(good(), {64, 64}, "map.exr").ok());
  const auto refused = map_of_picture(good(), {64, 63}, "map.exr");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
  EXPECT_NE(refused.error().line().find("map.exr: pixel (1, 2) looks at row 0.25, column 63"),
            std::string::npos)
      << refused.error().line();
}

TEST(MapFile, AnyOtherPictureIsRefused) {
  EXPECT_EQ(map_of_picture(Image<float>(Grid{3, 4}), {64, 64}, "x").error().code, ErrorCode::bad_format);
  Image<float> colours = good();
  colours.at(0, 0, 2) = 0.5F;
  EXPECT_EQ(map_of_picture(colours, {64, 64}, "x").error().code, ErrorCode::bad_format);
}

}  // namespace
}  // namespace symrig::map_file_test
