// SPDX-License-Identifier: Apache-2.0
// benchmark_apply scene.h5 [rounds]: what applying a stored tensor costs, against the machine's memory speed
// in the same run. JSON on standard output.
//
// One thread is timed by the processor time of the process, which other programs on the machine disturb
// least; two threads by the wall clock, with one thread by the wall clock beside it. Cold: an array eight
// times the usual last cache was written and another read in between. Best of the rounds, everything
// alternating.
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <vector>

#include <tbb/global_control.h>

namespace {

using symrig::Image;
using symrig::TransportTensor;

double processor_time() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double wall_time() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Runs `work` with so many threads and keeps the shortest time.
template <class Work>
void keep_best(double& best, double (*clock)(), std::size_t threads, const Work& work) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const double start = clock();
  work();
  best = std::min(best, clock() - start);
}

/// a = b + s c over three arrays far larger than any cache [STREAM]: 12 bytes an element.
class Triad {
 public:
  void run() {
    for (std::size_t i = 0; i < kSize; ++i) a_[i] = b_[i] + 3.0F * c_[i];
  }
  /// Leaves the caches full of clean lines that nobody needs.
  void sweep() {
    run();
    float sum = 0;
    for (std::size_t i = 0; i < kSize; i += 16) sum += c_[i];
    a_[0] = sum;
  }
  static double rate(double seconds) { return 12.0 * static_cast<double>(kSize) / seconds; }

 private:
  static constexpr std::size_t kSize = std::size_t{32} << 20;  // 128 MiB an array
  std::vector<float> a_ = std::vector<float>(kSize, 1), b_ = std::vector<float>(kSize, 2),
                     c_ = std::vector<float>(kSize, 3);
};

struct Times {
  double triad = 1e9, cold = 1e9, hot = 1e9, cold_wall = 1e9, cold_two = 1e9, hot_wall = 1e9, hot_two = 1e9,
         batch = 1e9, batch_wall = 1e9, batch_two = 1e9;
};

Times measure(const TransportTensor& tensor, const std::vector<Image<float>>& patterns, int rounds) {
  Times best;
  Triad triad;
  const auto one = [&] { (void)tensor.apply(patterns[0]); };
  const auto all = [&] { (void)tensor.apply_batch(patterns); };
  for (int round = 0; round < rounds; ++round) {
    keep_best(best.triad, processor_time, 1, [&] { triad.run(); });
    triad.sweep();
    keep_best(best.cold, processor_time, 1, one);
    triad.sweep();
    keep_best(best.cold_wall, wall_time, 1, one);
    triad.sweep();
    keep_best(best.cold_two, wall_time, 2, one);
    for (int again = 0; again < 8; ++again) {
      keep_best(best.hot, processor_time, 1, one);
      keep_best(best.hot_wall, wall_time, 1, one);
      keep_best(best.hot_two, wall_time, 2, one);
    }
    triad.sweep();
    keep_best(best.batch, processor_time, 1, all);
    keep_best(best.batch_wall, wall_time, 1, all);
    keep_best(best.batch_two, wall_time, 2, all);
  }
  best.triad = Triad::rate(best.triad);
  return best;
}

/// The same tensor with nothing rounded: its builder's floats. They are the rounded ones of the file, moved
/// by up to half a step of a half, so that rounding them again costs what rounding the measured ones did.
double rounding(const TransportTensor& tensor, const Image<float>& pattern) {
  symrig::TensorBuilder builder(tensor.camera_tree(), tensor.channels());
  symrig::Random random(1);
  const std::vector<float> pool = *tensor.factors();
  const float* at = pool.data();
  std::vector<float> factors;
  const auto moved = [&](float v) {
    return v * (1 + static_cast<float>((random.uniform() - 0.5) * 0x1p-10));
  };
  for (const symrig::Leaf& leaf : tensor.leaves()) {
    factors.assign(at, at + std::ptrdiff_t{tensor.channels()} * leaf.rank * (leaf.rows() + leaf.cols()));
    at += factors.size();
    std::transform(factors.begin(), factors.end(), factors.begin(), moved);
    builder.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level,
                     factors);
  }
  const std::vector<float> values = tensor.scalar_values();
  auto value = values.begin();
  for (const symrig::ScalarLeaf& s : tensor.scalars()) {
    std::vector<float> of_scalar(value, value + tensor.channels());
    std::transform(of_scalar.begin(), of_scalar.end(), of_scalar.begin(), moved);
    value += tensor.channels();
    builder.add_scalar(s.row, s.col, of_scalar);
  }
  const auto exact = builder.current().apply(pattern);
  const auto stored = std::move(builder).finish().apply(pattern);
  double error = 0, size = 0;
  for (std::size_t i = 0; i < exact->values().size(); ++i) {
    error += std::pow(double{exact->values()[i]} - double{stored->values()[i]}, 2);
    size += std::pow(double{exact->values()[i]}, 2);
  }
  return std::sqrt(error / size);
}

int print_times(const char* path, int rounds) {
  const auto scene = symrig::load_scene(path);
  if (!scene) {
    static_cast<void>(std::fprintf(stderr, "%s\n", scene.error().line().c_str()));
    return symrig::exit_code(scene.error().code);
  }
  const TransportTensor& tensor = scene->tensor;
  symrig::Random random(1);
  std::vector<Image<float>> patterns(16, Image<float>(tensor.projector_grid()));
  for (Image<float>& pattern : patterns)
    for (float& v : pattern.values()) v = static_cast<float>(random.uniform());
  const Times t = measure(tensor, patterns, rounds);
  const auto bytes = static_cast<double>(tensor.bytes());
  std::printf(R"({"tensor_mb": %.3f, "triad_gb_per_s": %.2f, "cold_ms": %.3f, "hot_ms": %.3f, )",
              1e-6 * bytes, 1e-9 * t.triad, 1e3 * t.cold, 1e3 * t.hot);
  std::printf(R"("cold_share_of_triad": %.3f, "two_threads_gain_cold": %.2f, "two_threads_gain_hot": %.2f, )",
              bytes / t.cold / t.triad, t.cold_wall / t.cold_two, t.hot_wall / t.hot_two);
  std::printf(R"("two_threads_gain_batch": %.2f, )", t.batch_wall / t.batch_two);
  std::printf(R"("batch_of_16_ms_a_pattern": %.3f, "batch_gain": %.2f)", 1e3 * t.batch / 16,
              16 * t.cold / t.batch);
  if (tensor.symmetric()) std::printf(R"(, "rounding": %.2e)", rounding(tensor, patterns[0]));
  std::printf("}\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc > 1)
      return print_times(argv[1], argc > 2 ? static_cast<int>(std::strtol(argv[2], nullptr, 10)) : 15);
    static_cast<void>(std::fprintf(stderr, "usage: benchmark_apply scene.h5 [rounds]\n"));
    return 2;
  } catch (const std::exception& error) {
    static_cast<void>(std::fprintf(stderr, "%s\n", error.what()));
    return 5;
  }
}
