// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/internal/kernels.hpp"

#include <numeric>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::tensor::lanes_test {
namespace {

std::vector<float> values(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> v(n);
  for (float& x : v) x = static_cast<float>(random.uniform());
  return v;
}

TEST(Lanes, gather_follows_any_order) {
  // Around the group of 16 and around the 256 that it looks ahead.
  for (const std::size_t n : {0U, 1U, 15U, 16U, 17U, 255U, 256U, 257U, 271U, 272U, 273U, 1000U}) {
    std::vector<std::int32_t> order(n);
    std::iota(order.begin(), order.end(), 0);
    Random random(n);
    for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
    const std::vector<float> from = values(n, 1);
    std::vector<float> to(n + 1, -1.0F);
    gather(order.data(), from.data(), to.data(), n);
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(to[i], from[order[i]]) << n << ": " << i;
    EXPECT_EQ(to[n], -1.0F) << n;
  }
}

TEST(Lanes, interleaving_and_back_moves_every_value_to_its_place) {
  for (std::size_t n = 0; n < 40; ++n) {
    std::vector<std::vector<float>> rows;
    LaneRows lanes{};
    for (std::size_t k = 0; k < kBatch; ++k) {
      rows.push_back(values(n, k));
      lanes[k] = rows[k].data();
    }
    std::vector<float> p(n * kBatch + 1, -1.0F);
    interleave(lanes, n, p.data());
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < kBatch; ++k) ASSERT_EQ(p[i * kBatch + k], rows[k][i]) << n;
    EXPECT_EQ(p[n * kBatch], -1.0F) << n;

    std::vector<std::vector<float>> back(kBatch, std::vector<float>(n + 1, -1.0F));
    LaneRowsOut out{};
    for (std::size_t k = 0; k < kBatch; ++k) out[k] = back[k].data();
    deinterleave(p.data(), n, out);
    for (std::size_t k = 0; k < kBatch; ++k) {
      rows[k].push_back(-1.0F);
      EXPECT_EQ(back[k], rows[k]) << n;
    }
  }
}

}  // namespace
}  // namespace symrig::tensor::lanes_test
