// SPDX-License-Identifier: Apache-2.0
// Tensors of several parts: in memory, and left in their file.
#include "tensor/leaf_parts.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace symrig::leaf_parts_test {
namespace {

namespace fs = std::filesystem;

constexpr Grid kGrid{128, 128};
constexpr std::size_t kPart = std::size_t{1} << 18;
constexpr double kEpsilon = 0x1p-24;

std::vector<float> positive(Random& random, std::size_t n) {
  std::vector<float> values(n);
  for (float& v : values) v = static_cast<float>(random.uniform());
  return values;
}

Image<float> random_light(std::uint64_t seed) {
  Random random(seed);
  Image<float> light(kGrid);
  for (float& v : light.values()) v = static_cast<float>(random.uniform());
  return light;
}

/// A tensor of three parts: `count` leaves of rank 4 between the four blocks of level 1, and single entries.
TransportTensor large_tensor(bool symmetric, int channels = 1) {
  const BlockTree tree(kGrid);
  TensorBuilder builder = symmetric ? TensorBuilder(tree, channels) : TensorBuilder(tree, tree, channels);
  Random random(31);
  const auto blocks = tree.level(1);
  constexpr int kRank = 4;
  const std::size_t values =
      static_cast<std::size_t>(channels) * kRank * 2 * static_cast<std::size_t>(blocks[0].size());
  for (std::size_t at = 0, k = 0; at < 5 * kPart / 2; at += values, ++k) {
    const Block& i = blocks[1 + k % 3];
    const Block& j = blocks[k % 3 % (1 + k % 2)];
    builder.add_leaf(i.begin, i.end, j.begin, j.end, kRank, 1, positive(random, values));
  }
  for (std::int32_t i = 0; i < kGrid.size(); i += 3)
    builder.add_scalar(i, i / 2, positive(random, static_cast<std::size_t>(channels)));
  return std::move(builder).finish();
}

class LeafParts : public testing::Test {
 protected:
  void SetUp() override {
    small_.emplace(kPart);
    std::string name = (fs::temp_directory_path() / "symrig-parts-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::optional<tensor::SmallParts> small_;
  fs::path file() const { return folder_ / "scene.h5"; }

  /// The tensor, read back whole and left in its file.
  struct Pair {
    TransportTensor kept, left;
  };
  Pair stored(const TransportTensor& tensor) const {
    EXPECT_TRUE(save_scene(file(), {tensor, "{}", {}}).ok());
    auto kept = load_scene(file(), {.memory = std::int64_t{1} << 40});
    auto left = load_scene(file(), {.memory = 1});
    EXPECT_TRUE(kept.ok() && left.ok());
    return {std::move(kept->tensor), std::move(left->tensor)};
  }

 private:
  fs::path folder_;
};

// Every leaf is in one part, its values follow those of the leaf before, and no part of several leaves is
// larger than it may be.
TEST_F(LeafParts, parts_have_all_leaves_once) {
  small_.reset();
  std::vector<Leaf> leaves;
  Random random(5);
  std::size_t values = 0, columns = 0;
  for (int k = 0; k < 500; ++k) {
    const auto rows = static_cast<std::int32_t>(1 + random.uniform() * 60000);
    leaves.push_back({0, rows, rows, rows + k % 7 * 9000 + 4, 1 + k % 4, 0});
    values += 3 * static_cast<std::size_t>(leaves.back().rank) *
              static_cast<std::size_t>(leaves.back().rows() + leaves.back().cols());
    columns += 6 * static_cast<std::size_t>(leaves.back().rank);
  }
  leaves.push_back({0, 20'000'000, 20'000'000, 40'000'000, 1, 0});  // larger than a part
  values += std::size_t{120'000'000};
  columns += 6;
  const auto parts = tensor::parts_of(leaves, 3);
  ASSERT_GT(parts.size(), 3U);
  tensor::PartRange end{};
  for (const tensor::PartRange& part : parts) {
    EXPECT_EQ(part.first, end.last);
    EXPECT_EQ(part.first_value, end.first_value + end.values);
    EXPECT_EQ(part.first_column, end.first_column + end.columns);
    EXPECT_TRUE(part.values <= tensor::part_values() || part.last - part.first == 1);
    end = part;
  }
  EXPECT_EQ(end.last, leaves.size());
  EXPECT_EQ(end.first_value + end.values, values);
  EXPECT_EQ(end.first_column + end.columns, columns);
}

// The list of leaves is read in runs of a million. Here the last run has three.
TEST_F(LeafParts, a_list_of_several_runs_is_read_as_it_was_written) {
  constexpr std::size_t kLeaves = (std::size_t{1} << 20) + 3;
  constexpr int kLevel = 6;  // blocks of four pixels
  const BlockTree tree(kGrid);
  TensorBuilder builder(tree, 1);
  builder.pack_leaves();
  const std::vector<float> factors(8, 0.5F);
  const auto blocks = tree.level(kLevel);
  std::size_t added = 0;
  for (std::size_t i = 1; added < kLeaves; ++i)
    for (std::size_t j = 0; j < i && added < kLeaves; ++j, ++added)
      builder.add_leaf(blocks[i].begin, blocks[i].end, blocks[j].begin, blocks[j].end, 1, kLevel, factors);
  const TransportTensor tensor = std::move(builder).finish();
  ASSERT_TRUE(save_scene(file(), {tensor, "{}", {}}).ok());
  const auto read = load_scene(file(), {.memory = 1});
  ASSERT_TRUE(read.ok());
  const auto numbers = [](const TransportTensor& of) {
    std::vector<std::int32_t> all;
    for (const Leaf& leaf : of.leaves())
      all.insert(all.end(),
                 {leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level});
    return all;
  };
  ASSERT_EQ(tensor.leaves().size(), kLeaves);
  EXPECT_TRUE(numbers(read->tensor) == numbers(tensor));
}

TEST_F(LeafParts, a_tensor_left_in_its_file_gives_the_same_bits) {
  for (const bool symmetric : {true, false}) {
    const auto [kept, left] = stored(large_tensor(symmetric, symmetric ? 1 : 3));
    EXPECT_TRUE(kept.in_memory());
    EXPECT_FALSE(left.in_memory());
    const Image<float> light = random_light(7);
    EXPECT_EQ(*left.apply(light), *kept.apply(light));
    EXPECT_EQ(*left.apply_transposed(light), *kept.apply_transposed(light));
    std::vector<Image<float>> batch;
    for (std::uint64_t k = 0; k < 18; ++k) batch.push_back(random_light(20 + k));
    const auto whole = *kept.apply_batch(batch);
    EXPECT_EQ(*left.apply_batch(batch), whole);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(*left.apply_batch(batch), whole) << "one thread";
    EXPECT_EQ(*left.factors(), *kept.factors());
    Image<float> picture(kGrid, kept.channels());
    std::ranges::copy(light.values(), picture.plane(0).begin());
    EXPECT_EQ(*apply_adjoint(left, picture), *apply_adjoint(kept, picture));
  }
}

// As for one part: the bound of TransportTensor::apply, on both sides, and the rounding of the factors. All
// values are positive, so the photograph is the sum of magnitudes.
TEST_F(LeafParts, parts_add_up_to_the_tensor) {
  const BlockTree tree(kGrid);
  TensorBuilder builder(tree, 1);
  Random random(3);
  const Block &i = tree.level(1)[1], &j = tree.level(1)[0];
  constexpr int kRank = 4;
  int leaves = 0;
  for (std::size_t at = 0; at <= kPart; ++leaves) {
    const auto factors = positive(random, std::size_t{2} * kRank * static_cast<std::size_t>(i.size()));
    builder.add_leaf(i.begin, i.end, j.begin, j.end, kRank, 1, factors);
    at += factors.size();
  }
  const Image<float> light = random_light(9);
  const Image<float> in_floats = *builder.current().apply(light);
  const TransportTensor packed = std::move(builder).finish();
  const Image<float> photograph = *packed.apply(light);
  const double terms = static_cast<double>(j.size()) + kRank * leaves + 4;
  const double bound = 0x1p-10 * (1 + 0x1p-11) + 2 * terms * kEpsilon;
  for (std::size_t k = 0; k < photograph.values().size(); ++k)
    ASSERT_NEAR(photograph.values()[k], in_floats.values()[k],
                bound * static_cast<double>(in_floats.values()[k]))
        << k;
}

TEST_F(LeafParts, a_tensor_left_in_its_file_is_saved_as_it_was) {
  const auto [kept, left] = stored(large_tensor(true));
  const fs::path copy = file().parent_path() / "copy.h5";
  ASSERT_TRUE(save_scene(copy, {left, "{}", {}}).ok());
  EXPECT_EQ(*load_scene(copy)->tensor.factors(), *kept.factors());
  // Its own file may be the one that is written.
  ASSERT_TRUE(save_scene(file(), {left, "{}", {}}).ok());
  EXPECT_EQ(*load_scene(file())->tensor.factors(), *kept.factors());
  EXPECT_EQ(*left.factors(), *kept.factors());
}

TEST_F(LeafParts, another_file_of_the_name_is_not_read) {
  const auto [kept, left] = stored(large_tensor(true));
  const Image<float> light = random_light(2);
  fs::remove(file());
  std::ofstream(file()) << "another";
  EXPECT_EQ(*left.apply(light), *kept.apply(light));
}

// The file is checked when it is read: a flipped bit of a factor is an error then, and no picture.
TEST_F(LeafParts, a_flipped_bit_is_an_error_when_it_is_read) {
  const auto [kept, left] = stored(large_tensor(true));
  std::fstream bytes(file(), std::ios::in | std::ios::out | std::ios::binary);
  const auto middle = static_cast<std::streamoff>(fs::file_size(file()) / 2);
  bytes.seekg(middle);
  const auto byte = static_cast<char>(bytes.get() ^ 0x10);
  bytes.seekp(middle);
  bytes.put(byte).flush();
  const auto photograph = left.apply(random_light(2));
  ASSERT_FALSE(photograph.ok());
  EXPECT_EQ(photograph.error().code, ErrorCode::bad_format);
  EXPECT_NE(photograph.error().what.find("leaves/factors"), std::string::npos) << photograph.error().line();
  EXPECT_NE(photograph.error().what.find("scene.h5"), std::string::npos);
  EXPECT_FALSE(left.apply_transposed(random_light(2)).ok());
  EXPECT_FALSE(left.apply_batch(std::vector<Image<float>>{random_light(2)}).ok());
  EXPECT_FALSE(left.stopped_at(1).ok());
  EXPECT_FALSE(left.slice(3, 0).ok());
  EXPECT_FALSE(save_scene(file().parent_path() / "copy.h5", {left, "{}", {}}).ok());
  EXPECT_FALSE(fs::exists(file().parent_path() / "copy.h5"));
}

}  // namespace
}  // namespace symrig::leaf_parts_test
