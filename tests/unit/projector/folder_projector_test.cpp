// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/internal/folder_projector.hpp"

#include "assert_ok.hpp"
#include "full_disk.hpp"
#include "symrig/base/files.hpp"
#include "symrig/board/internal/sha256.hpp"
#include "symrig/image/file.hpp"
#include "symrig/testing/projector_laws.hpp"

#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::test::folder_projector_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Folder : public ::testing::Test {
 protected:
  Folder() {
    std::string path = (fs::temp_directory_path() / "symrig-XXXXXX").string();
    EXPECT_NE(mkdtemp(path.data()), nullptr);
    scratch = path;
    options.folder = scratch / "patterns";
    options.screen = {20, 30};
    options.placement = {.cell = 3, .top = 1, .left = 2, .mirror_cols = true};
  }
  ~Folder() override {
    std::error_code error;
    fs::remove_all(scratch, error);
  }
  std::unique_ptr<FolderProjector> open() {
    auto projector = FolderProjector::open(options);
    EXPECT_TRUE(projector.ok()) << projector.error().line();
    return *std::move(projector);
  }
  Json manifest() const { return Json::parse(std::ifstream(options.folder / "manifest.json")); }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(options.folder), fs::directory_iterator()));
  }
  static Pattern checkers(Grid grid) {
    Pattern pattern(grid);
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) pattern.at(row, col) = (row + col) % 2 == 0 ? 1.F : 0.F;
    return pattern;
  }
  static Pattern ramp(Grid grid) {
    Pattern pattern(grid);
    const auto last = static_cast<float>(grid.size() - 1);
    for (std::size_t i = 0; i < pattern.values().size(); ++i)
      pattern.values()[i] = static_cast<float>(i) / last;
    return pattern;
  }

  fs::path scratch;
  FolderProjectorOptions options;
};

TEST_F(Folder, keeps_the_laws_of_projectors) {
  expect_projector_laws(*open());
}

TEST_F(Folder, pictures_are_the_screen_that_the_placement_says) {
  const auto projector = open();
  EXPECT_EQ(projector->grid(), (Grid{6, 9}));
  EXPECT_EQ(projector->pacing(), Pacing::trigger);
  const std::vector<Pattern> patterns{checkers(projector->grid()), ramp(projector->grid())};
  ASSERT_OK(projector->load(patterns));
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    const auto codes = to_codes(patterns[k], projector->grid(), {}, k);
    ASSERT_OK(codes);
    const auto wanted = draw(*codes, options.placement, options.screen);
    const auto picture = read_image(options.folder / ("pattern-0000" + std::to_string(k) + ".png"));
    ASSERT_OK(picture);
    ASSERT_EQ(picture->grid(), options.screen);
    for (std::size_t i = 0; i < wanted.values().size(); ++i)
      ASSERT_EQ(picture->values()[i], static_cast<float>(wanted.values()[i]) / 255.F) << i;
  }
}

TEST_F(Folder, the_manifest_tells_order_bits_and_hash) {
  const auto projector = open();
  const std::vector<Pattern> patterns{ramp(projector->grid()), checkers(projector->grid())};
  ASSERT_OK(projector->load(patterns));
  const Json told = manifest();
  EXPECT_EQ(told["symrig"], 1);
  EXPECT_EQ(told["screen"], Json({20, 30}));
  EXPECT_EQ(told["grid"], Json({6, 9}));
  ASSERT_EQ(told["patterns"].size(), 2U);
  EXPECT_EQ(told["patterns"][0]["bits"], 8);
  EXPECT_EQ(told["patterns"][1]["bits"], 1);
  for (const Json& entry : told["patterns"]) {
    const auto bytes = read_file(options.folder / entry["file"].get<std::string>());
    ASSERT_OK(bytes);
    const std::span<const std::uint8_t> octets(reinterpret_cast<const std::uint8_t*>(bytes->data()),
                                               bytes->size());
    EXPECT_EQ(entry["sha256"], board::sha256(octets));
    EXPECT_EQ(bytes->at(24), entry["bits"] == 1 ? std::byte{1} : std::byte{8})
        << "bit depth in the PNG's IHDR";
  }
}

TEST_F(Folder, a_shorter_sequence_leaves_nothing_of_the_longer_one) {
  const auto projector = open();
  const std::vector<Pattern> three(3, checkers(projector->grid()));
  ASSERT_OK(projector->load(three));
  std::ofstream(options.folder / "notes.txt") << "mine";
  std::ofstream(options.folder / "pattern-of-my-own.png") << "mine";
  ASSERT_OK(projector->load({three.data(), 1}));
  EXPECT_EQ(manifest()["patterns"].size(), 1U);
  EXPECT_EQ(files(), 4U);  // the picture, the manifest, and what is not ours
}

TEST_F(Folder, bad_patterns_leave_the_folder_as_it_was) {
  const auto projector = open();
  const std::vector<Pattern> good(2, checkers(projector->grid()));
  ASSERT_OK(projector->load(good));
  std::vector<Pattern> bad = good;
  bad[1].at(0, 0) = 2;
  EXPECT_EQ(projector->load(bad).error().code, ErrorCode::bad_value);
  EXPECT_EQ(projector->load(std::vector<Pattern>{Pattern({1, 1})}).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(manifest()["patterns"].size(), 2U);
}

TEST_F(Folder, a_disk_that_takes_no_more_leaves_no_half_set) {
  options.screen = {300, 300};
  const auto projector = open();
  std::vector<Pattern> patterns{checkers(projector->grid()), ramp(projector->grid())};
  for (std::size_t i = 0; i < patterns[1].values().size(); ++i)  // noise does not compress
    patterns[1].values()[i] = static_cast<float>((i * 2'654'435'761U >> 8U) % 256U) / 255.F;
  ASSERT_OK(projector->load({patterns.data(), 1}));
  const auto loaded = [&] {
    const test::FullDisk full(2048);
    return projector->load(patterns);
  }();
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.error().code, ErrorCode::io);
  EXPECT_NE(loaded.error().what.find("pattern-00001.png"), std::string::npos) << loaded.error().what;
  EXPECT_EQ(files(), 0U);
}

TEST_F(Folder, patterns_are_pushed_once_they_are_complete) {
  int pushed = 0;
  options.push = [&](const fs::path& folder) -> Result<void> {
    ++pushed;
    EXPECT_EQ(folder, options.folder);
    EXPECT_TRUE(fs::exists(folder / "manifest.json"));
    return Error{ErrorCode::device_lost, "no projector there"};
  };
  const auto projector = open();
  const auto loaded = projector->load(std::vector<Pattern>{checkers(projector->grid())});
  EXPECT_EQ(pushed, 1);
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.error().code, ErrorCode::device_lost);
}

TEST_F(Folder, a_command_pushes_and_is_believed) {
  options.push = push_by_command("cp \"$1\"/*.png " + scratch.string());
  ASSERT_OK(open()->load(std::vector<Pattern>{checkers({6, 9})}));
  EXPECT_TRUE(fs::exists(scratch / "pattern-00000.png"));
  options.push = push_by_command(R"(echo one; printf 'cable\tmissing\n\n' >&2; exit 3)");
  const auto failed = open()->load(std::vector<Pattern>{checkers({6, 9})});
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::device_refused);
  EXPECT_NE(failed.error().what.find("status 3: cable missing"), std::string::npos) << failed.error().what;
  options.push = push_by_command("kill -TERM $$");
  EXPECT_NE(open()->load(std::vector<Pattern>{checkers({6, 9})}).error().what.find("signal 15"),
            std::string::npos);
}

TEST_F(Folder, what_cannot_be_is_refused_at_once) {
  options.screen = {};
  EXPECT_EQ(FolderProjector::open(options).error().code, ErrorCode::bad_argument);
  options.screen = {4, 4};
  options.grid = Grid{4, 4};
  EXPECT_EQ(FolderProjector::open(options).error().code, ErrorCode::size_mismatch);
  options.screen = {20, 30};
  options.grid.reset();
  options.folder = scratch / "file";
  std::ofstream(options.folder) << "x";
  EXPECT_EQ(FolderProjector::open(options).error().code, ErrorCode::io);
  options.folder = scratch / "sub" / "folder";
  EXPECT_TRUE(FolderProjector::open(options).ok());
  EXPECT_FALSE(open()->show(0).ok()) << "its trigger line paces it";
}

}  // namespace
}  // namespace symrig::test::folder_projector_test
