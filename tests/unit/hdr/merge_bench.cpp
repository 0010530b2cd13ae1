// SPDX-License-Identifier: Apache-2.0
// Merge speed against the memory ceiling of the same run: a[i] = b[i] + s c[i] over arrays of the same
// footprint. The error beside the speed is that of the float kernel against the same formulas in double.
#include "simulated_sensor.hpp"
#include "symrig/hdr/merge.hpp"

#include <cmath>

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;
using test::Random;

const NoiseModel kSensor = NoiseModel::from_electrons({});

Grid grid_of(const benchmark::State& state) {
  return {static_cast<int>(state.range(0)), static_cast<int>(state.range(1))};
}

/// Largest |merged − the same formulas in double| in units of sigma.
double error_in_sigmas(const std::vector<Frame>& frames, const Radiance& merged, const Radiance& black) {
  double worst = 0;
  for (std::size_t i = 0; i < merged.mean.values().size(); ++i) {
    double value = 0, time = 0, sum = 0, weights = 0;
    for (const Frame& f : frames) {
      if (f.raw[i] >= kSensor.saturation_code()) continue;
      value += (f.raw[i] - kSensor.pedestal()) / kSensor.gain();
      time += seconds(f.exposure);
    }
    for (const Frame& f : frames) {
      if (f.raw[i] >= kSensor.saturation_code()) continue;
      const double t = seconds(f.exposure);
      const double rate = std::max(value / time, -kSensor.floor_variance() / 2 / 0.1);
      const double w = t * t / (rate * t + kSensor.floor_variance());
      sum += w * (f.raw[i] - kSensor.pedestal()) / (kSensor.gain() * t);
      weights += w;
    }
    if (weights > 0)
      worst = std::max(worst, std::abs(merged.mean.values()[i] - (sum / weights - black.mean.values()[i])) *
                                  std::sqrt(weights));
  }
  return worst;
}

void merge_bracket(benchmark::State& state) {
  const Grid grid = grid_of(state);
  const auto exposures = static_cast<int>(state.range(2));
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(3)));
  Random random(1);
  auto bracket = test::photograph_uniform(kSensor, test::exposure_ladder(exposures, 8, 100ms), 0, 0, random);
  for (std::size_t k = 0; k < bracket.codes.size(); ++k)
    for (std::int64_t i = 0; i < grid.size();
         ++i) {  // a ramp over five decades: every pixel another mix of saturated frames
      const double electrons =
          std::pow(10, 1 + 5.0 * static_cast<double>(i % 997) / 997) * seconds(bracket.exposures[k]) / 0.1;
      bracket.codes[k].push_back(test::sample(kSensor, electrons, random));
    }
  const Radiance black{Image<float>(grid, 1, 10.0F), Image<float>(grid, 1, 1.0F),
                       Image<std::uint8_t>(grid, 1, 1)};
  const auto frames = bracket.frames();
  Radiance merged;
  for (auto _ : state) {
    if (!merge_into(frames, grid, 1, kSensor, {.black = &black}, merged)) state.SkipWithError("merge failed");
    benchmark::ClobberMemory();
  }
  const double pixels = static_cast<double>(grid.size()) * static_cast<double>(state.iterations());
  // 2 B a frame, black 4 + 4 + 1, out 4 + 4 + 1 (mean, variance, valid).
  state.SetBytesProcessed(static_cast<std::int64_t>(pixels * (2 * exposures + 18)));
  state.counters["pixels"] = benchmark::Counter(pixels, benchmark::Counter::kIsRate);
  state.counters["error_sigmas"] = error_in_sigmas(frames, merged, black);
}

void triad(benchmark::State& state) {
  const auto n =
      static_cast<std::size_t>(grid_of(state).size()) * 26 / 12;  // the merge's bytes of four frames
  std::vector<float> a(n), b(n, 1.0F), c(n, 2.0F);
  for (auto _ : state) {
    for (std::size_t i = 0; i < n; ++i) a[i] = b[i] + 3.0F * c[i];
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(n) * 12);
}

BENCHMARK(triad)->Args({310, 350})->Args({2952, 1000});
BENCHMARK(merge_bracket)
    ->Args({310, 350, 4, 1})
    ->Args({310, 350, 4, 2})
    ->Args({2952, 1000, 4, 1})
    ->Args({2952, 1000, 4, 2})
    ->Args({2952, 1000, 3, 1})
    ->UseRealTime();

}  // namespace
}  // namespace symrig

BENCHMARK_MAIN();
