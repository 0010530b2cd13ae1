// SPDX-License-Identifier: Apache-2.0
// T of a bench with a camera of its own, through the exact map.
#include "symrig/sim/bench_truth.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <numeric>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::bench_truth_test {
namespace {

/// ‖T − Tᵀ‖ / ‖T‖ by random signs p and q: E[(qᵀTp − pᵀTq)²] = ‖T − Tᵀ‖², and E‖Tp‖² = ‖T‖².
double asymmetry(const TrueTransport& truth, Grid grid, int tries) {
  Random random(7);
  const auto signs = [&] {
    Image<float> image(grid);
    for (float& v : image.values()) v = random.sign();
    return image;
  };
  const auto product = [](const Image<float>& a, const Image<float>& b) {
    return std::inner_product(a.values().begin(), a.values().end(), b.values().begin(), 0.0);
  };
  double difference = 0, all = 0;
  for (int k = 0; k < tries; ++k) {
    const Image<float> p = signs(), q = signs();
    const auto of_p = truth(p), of_q = truth(q);
    EXPECT_TRUE(of_p.ok() && of_q.ok());
    difference += std::pow(product(q, *of_p) - product(p, *of_q), 2);
    all += product(*of_p, *of_p);
  }
  return std::sqrt(difference / all);
}

double asymmetry_of(const std::string& keys, int size = 32, int camera = 152, int tries = 24) {
  const auto uri = parse_scene_uri(fmt::format(
      "sim:vgroove-textured?size={0}x{0}&camera={1}x{1}&turn=1.5&zoom=0.784{2}", size, camera, keys));
  EXPECT_TRUE(uri.ok());
  const auto truth = bench_truth(*uri);
  EXPECT_TRUE(truth.ok() && truth->has_value());
  return asymmetry(**truth, uri->size, tries);
}

// What blurs of second moments leave: pixels are boxes, not Gaussians. If a pixel's side counted as w² / 12,
// or not at all, the first would be 0.0044 and 0.0054 (24 November 2026); a perfect match leaves 0.0036.
TEST(BenchTruth, is_symmetric) {
  EXPECT_LT(asymmetry_of("&fine=4&defocus=0.15,0.3"), 0.0040);
  EXPECT_LT(asymmetry_of("&fine=8&defocus=0.15,0.3"), 0.0030);
  EXPECT_LT(asymmetry_of("&fine=4&defocus=0.1,0.4"), 0.0052);
}

// For the sanitizers: few cells and few tries. 0.0051 (25 November 2026); four tries scatter by a third.
TEST(BenchTruth, is_symmetric_on_a_small_grid) {
  EXPECT_LT(asymmetry_of("&fine=4&defocus=0.15,0.3", 12, 57, 4), 0.011);
}

}  // namespace
}  // namespace symrig::bench_truth_test
