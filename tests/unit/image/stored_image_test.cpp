// SPDX-License-Identifier: Apache-2.0
// Images that are kept for later, in memory and in scratch files.
#include "symrig/image/stored_image.hpp"

#include "symrig/base/memory.hpp"

#include <filesystem>
#include <optional>

#include <gtest/gtest.h>

namespace symrig::stored_image_test {
namespace {

/// Another value in each place.
Image<float> numbered(Grid grid, int channels) {
  Image<float> image(grid, channels);
  for (std::size_t k = 0; k < image.values().size(); ++k) image.values()[k] = static_cast<float>(k);
  return image;
}

TEST(StoredImage, is_the_image_that_it_was_made_from) {
  const Image<float> image = numbered({300, 200}, 3);  // 720 kB: large enough for a scratch file
  for (const bool in_file : {false, true}) {
    std::optional<MemoryScope> scope;
    if (in_file) scope.emplace(MemoryBudget{1, 0, std::filesystem::temp_directory_path()});
    const StoredImage stored = image;
    EXPECT_EQ(MemoryScope::scratch_bytes() > 0, in_file);
    EXPECT_EQ(stored, image);
    EXPECT_EQ(stored.grid(), image.grid());
    EXPECT_EQ(stored.channels(), 3);
    EXPECT_EQ(stored.plane(2)[199], image.plane(2)[199]);
    EXPECT_EQ(stored.at(7, 5, 1), image.at(7, 5, 1));
    const Image<float> again = stored;
    EXPECT_EQ(again, image);
    StoredImage other = stored;
    EXPECT_EQ(other, stored);
    other.at(299, 199, 2) = -1;
    EXPECT_FALSE(other == stored);
    EXPECT_FALSE(other == image);
  }
}

// Equal values are another image on another grid.
TEST(StoredImage, differs_from_an_image_of_another_shape) {
  EXPECT_FALSE(StoredImage(Image<float>({2, 6})) == Image<float>({3, 4}));
  EXPECT_FALSE(StoredImage(Image<float>({2, 6})) == Image<float>({2, 3}, 2));
}

}  // namespace
}  // namespace symrig::stored_image_test
