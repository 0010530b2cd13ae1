// SPDX-License-Identifier: Apache-2.0
// benchmark_bracket_plan [ROWSxCOLS [seeds [goal ...]]]: frames that a photograph takes with planned
// exposures against fixed brackets of 3, 4 and 5, on every scene with camera noise, in one run, errors
// beside. Planned captures are run once for each goal, a factor on all that ExposureGoal allows, the same for
// all scenes: 1 is what a capture does by default. The last lines are geometric means over the scenes of
// frames and errors against four fixed exposures, and between the goals the frames at which the errors are
// equal.
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace {

using namespace symrig;

/// Logarithms, so that sums over seeds and scenes are geometric means.
enum Number : std::size_t { patterns, frames, exposed, frobenius, indirect, flood, kNumbers };
using Run = std::array<double, kNumbers>;

Run& operator+=(Run& to, const Run& run) {
  for (std::size_t k = 0; k < to.size(); ++k) to[k] += run[k];
  return to;
}
Run operator-(Run a, const Run& b) {
  for (std::size_t k = 0; k < a.size(); ++k) a[k] -= b[k];
  return a;
}
Run operator/(Run run, double by) {
  for (double& number : run) number /= by;
  return run;
}
double each(const Run& run) {
  return std::exp(run[frames] - run[patterns]);
}

[[noreturn]] void give_up(const Error& error) {
  (void)std::fprintf(stderr, "%s\n", error.line().c_str());
  std::exit(4);
}

Run capture_once(const std::string& uri, double goal) {
  auto rig = open_virtual_rig(uri);
  if (!rig) give_up(rig.error());
  CaptureOptions options;
  options.rule = default_rule(options.algorithm);
  options.economy = default_economy(options.algorithm);
  options.exposure.relative *= goal;
  options.exposure.relative_dark *= goal;
  options.exposure.share_of_tolerance *= goal;
  auto result = capture(**rig, options);
  if (!result) give_up(result.error());
  const auto& scene = (*rig)->truth();
  const auto error =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return scene.apply(p); });
  if (!error) give_up(error.error());
  const ProbeCost cost = (*rig)->cost();
  constexpr double kNothing = 1e-9;  // a scene without indirect light has no error in it
  return {std::log(static_cast<double>(result->patterns)),
          std::log(static_cast<double>(cost.frames)),
          std::log(cost.rig_seconds),
          std::log(error->frobenius),
          std::log(std::max(kNothing, error->indirect)),
          std::log(error->flood)};
}

Run capture_mean(const std::string& scene, const std::string& size, const std::string& exposures, int seeds,
                 double goal) {
  Run sum{};
  for (int seed = 1; seed <= seeds; ++seed)
    sum +=
        capture_once(fmt::format("sim:{}?size={}&seed={}&exposures={}", scene, size, seed, exposures), goal);
  return sum / seeds;
}

struct Way {
  std::string name, exposures;
  double goal = 1;
  Run sum{};  // over scenes
};

void print(const std::string& scene, const std::string& how, const Run& run) {
  std::printf(
      "%-17s %-13s %5.0f photographs %6.0f frames %5.2f each %8.1f s   frobenius %.2e indirect %.2e "
      "flood %.2e\n",
      scene.c_str(), how.c_str(), std::exp(run[patterns]), std::exp(run[frames]), each(run),
      std::exp(run[exposed]), std::exp(run[frobenius]), std::exp(run[indirect]), std::exp(run[flood]));
  (void)std::fflush(stdout);
}

/// Frames a photograph against four where an error is that of four, between two of the ratios (logarithms,
/// ascending goals).
void print_equal(const char* name, const std::vector<Run>& ratios, Number error) {
  for (std::size_t k = 1; k < ratios.size(); ++k) {
    const Run &a = ratios[k - 1], &b = ratios[k];
    if (a[error] > 0 || b[error] <= 0) continue;
    const double at = -a[error] / (b[error] - a[error]);
    const double each_a = a[frames] - a[patterns], each_b = b[frames] - b[patterns];
    std::printf("at the %s error of four: %.3f x its frames a photograph\n", name,
                std::exp(each_a + at * (each_b - each_a)));
    return;
  }
  std::printf("at the %s error of four: not between these goals\n", name);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string size = argc > 1 ? argv[1] : "48x48";
  const int seeds = argc > 2 ? std::max(1, static_cast<int>(std::strtol(argv[2], nullptr, 10))) : 1;
  std::vector<Way> ways{{"fixed 4", "4"}, {"fixed 3", "3"}, {"fixed 5", "5"}};
  const std::size_t fixed = ways.size();
  for (int k = 3; k < argc; ++k)
    ways.push_back({fmt::format("planned x{}", argv[k]), "auto", std::strtod(argv[k], nullptr)});
  if (argc <= 3) ways.push_back({"planned", "auto"});
  for (const std::string_view name : scene_names()) {
    const std::string scene(name);
    for (Way& way : ways) {
      const Run run = capture_mean(scene, size, way.exposures, seeds, way.goal);
      way.sum += run;
      print(scene, way.name, run);
    }
  }
  const auto scenes = static_cast<double>(scene_names().size());
  std::vector<Run> planned;
  std::printf("geometric means over %.0f scenes, against four fixed exposures:\n", scenes);
  for (std::size_t k = 1; k < ways.size(); ++k) {
    const Run ratio = (ways[k].sum - ways[0].sum) / scenes;
    std::printf(
        "%-13s %.3f x frames a photograph, %.3f x rig seconds, errors: frobenius %.3f x, indirect %.3f x, "
        "flood %.3f x\n",
        ways[k].name.c_str(), each(ratio), std::exp(ratio[exposed]), std::exp(ratio[frobenius]),
        std::exp(ratio[indirect]), std::exp(ratio[flood]));
    if (k >= fixed) planned.push_back(ratio);
  }
  print_equal("frobenius", planned, frobenius);
  print_equal("indirect", planned, indirect);
  return 0;
}
