// SPDX-License-Identifier: Apache-2.0
// benchmark_relight scene.h5: time of one relit photograph against the machine's memory speed, both measured
// in this run, alternating.
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <vector>

namespace {

/// a = b + s c over three arrays far larger than any cache: bytes a second, as STREAM counts them (12 a
/// element).
double triad_rate(std::vector<float>& a, const std::vector<float>& b, const std::vector<float>& c) {
  const symrig::Stopwatch watch;
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = b[i] + 3.0F * c[i];
  return 12.0 * static_cast<double>(a.size()) / watch.seconds();
}

int print_speed(const char* path) {
  const auto scene = symrig::load_scene(path);
  if (!scene) {
    static_cast<void>(std::fprintf(stderr, "%s\n", scene.error().line().c_str()));
    return symrig::exit_code(scene.error().code);
  }
  const symrig::TransportTensor& tensor = scene->tensor;
  const auto pattern = symrig::natural_pattern(tensor.projector_grid(), 1);
  constexpr std::size_t kElements = std::size_t{32} << 20;  // 128 MiB an array
  std::vector<float> a(kElements, 1), b(kElements, 2), c(kElements, 3);
  std::vector<double> relight, triad;
  constexpr int kRounds = 15;
  for (int round = 0; round < kRounds; ++round) {
    triad.push_back(triad_rate(a, b, c));
    const symrig::Stopwatch watch;  // the triad has just swept the caches: a cold tensor
    const auto photograph = tensor.apply(pattern);
    relight.push_back(watch.seconds());
    if (!photograph) return 4;
  }
  const double cold = symrig::median(relight);
  const double fastest = *std::max_element(triad.begin(), triad.end());
  std::printf(
      "{\"relight_ms\": %.3f, \"relight_best_ms\": %.3f, \"tensor_mb\": %.3f, \"gb_per_s\": %.2f, "
      "\"triad_gb_per_s\": %.2f, "
      "\"share_of_triad\": %.3f}\n",
      1e3 * cold, 1e3 * *std::min_element(relight.begin(), relight.end()),
      1e-6 * static_cast<double>(tensor.bytes()), 1e-9 * static_cast<double>(tensor.bytes()) / cold,
      1e-9 * fastest, static_cast<double>(tensor.bytes()) / cold / fastest);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2) return print_speed(argv[1]);
    static_cast<void>(std::fprintf(stderr, "usage: benchmark_relight scene.h5\n"));
    return 2;
  } catch (const std::exception& error) {
    static_cast<void>(std::fprintf(stderr, "%s\n", error.what()));
    return 5;
  }
}
