// SPDX-License-Identifier: Apache-2.0
// Time of one T p, one channel, one core, at 310×350 (the grid of [Garg06] Table 1), and of making the scene.
#include "symrig/base/time.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>

namespace {

/// Milliseconds of the fastest of `times` calls.
template <class Work>
double fastest(int times, Work work) {
  double best = std::numeric_limits<double>::infinity();
  for (int k = 0; k < times; ++k) {
    const symrig::Stopwatch watch;
    work();
    best = std::min(best, 1e3 * watch.seconds());
  }
  return best;
}

}  // namespace

int main() {
  constexpr int kMake = 3, kApply = 20;
  std::printf("%-18s %10s %10s\n", "scene", "make, ms", "apply, ms");
  for (const auto name : symrig::scene_names()) {
    const auto uri = symrig::parse_scene_uri("sim:" + std::string(name) + "?size=310x350");
    const double making = fastest(kMake, [&] { (void)symrig::make_scene(*uri); });
    const auto scene = symrig::make_scene(*uri);
    const symrig::Image<float> pattern((*scene)->grid(), 1, 1.F);
    symrig::Image<float> photograph((*scene)->grid());
    const double applying =
        fastest(kApply, [&] { (*scene)->apply(pattern.plane(0), photograph.plane(0), 0); });
    std::printf("%-18s %10.3f %10.3f\n", std::string(name).c_str(), making, applying);
  }
}
