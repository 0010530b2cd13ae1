// SPDX-License-Identifier: Apache-2.0
// Time of one T p, one channel, one core, at 310×350 (the grid of [Garg06] Table 1), and of making the scene.
#include "symrig/sim/scene.hpp"

#include <benchmark/benchmark.h>

namespace {

using symrig::Image;
using symrig::make_scene;
using symrig::parse_scene_uri;

std::string uri_of(std::string_view name) {
  return "sim:" + std::string(name) + "?size=310x350";
}

void apply(benchmark::State& state, const std::string& uri) {
  const auto scene = make_scene(*parse_scene_uri(uri));
  const Image<float> pattern((*scene)->grid(), 1, 1.F);
  Image<float> photograph((*scene)->grid());
  for (auto _ : state) {
    (*scene)->apply(pattern.plane(0), photograph.plane(0), 0);
    benchmark::DoNotOptimize(photograph.values().data());
  }
}

void make(benchmark::State& state, const std::string& uri) {
  for (auto _ : state) benchmark::DoNotOptimize(make_scene(*parse_scene_uri(uri)));
}

}  // namespace

int main(int argc, char** argv) {
  for (const auto name : symrig::scene_names()) {
    benchmark::RegisterBenchmark(("apply/" + std::string(name)).c_str(), apply, uri_of(name))
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("make/" + std::string(name)).c_str(), make, uri_of(name))
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
