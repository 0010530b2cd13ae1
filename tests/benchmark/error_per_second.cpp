// SPDX-License-Identifier: Apache-2.0
// benchmark_error_per_second [SIZE [PROFILES [SCENES [SEED [SEEDS]]]]]: the table of
// docs/research/error-per-second.md, as CSV: what several ways to capture cost and leave, on every scene
// and on sim:random.
//   SIZE      default 64x64
//   PROFILES  of the rig, separated by commas; default screen60
//   SCENES    "fixed" for the nine scenes, "random" for the seeds, "all" (default)
//   SEED      of the nine scenes, default 7
//   SEEDS     of sim:random, default 1-20
// Seeds from 21 on are not for choosing rules: they are judged once, in the end
// (docs/research/random-scenes.md).
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace {

using namespace symrig;

struct Way {
  const char* name;
  Algorithm algorithm;
  const char* exposures;
  std::optional<int> polish = {};
  double tolerance = 1;  ///< times the default
};
// The tolerances show what a given error costs.
constexpr std::array kWays{Way{"paper, four", Algorithm::paper, "4"},
                           Way{"symrig, four", Algorithm::symrig, "4", 0},
                           Way{"symrig", Algorithm::symrig, "auto"},
                           Way{"symrig, 8/3", Algorithm::symrig, "auto", {}, 8.0 / 3},
                           Way{"symrig, 4/3", Algorithm::symrig, "auto", {}, 4.0 / 3},
                           Way{"symrig, 2/3", Algorithm::symrig, "auto", {}, 2.0 / 3},
                           Way{"symrig, 1/2", Algorithm::symrig, "auto", {}, 1.0 / 2}};

[[noreturn]] void give_up(const Error& error) {
  (void)std::fprintf(stderr, "%s\n", error.line().c_str());
  std::exit(4);
}

template <class T>
T or_give_up(Result<T> result) {
  if (!result) give_up(result.error());
  return *std::move(result);
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();  // an error that was not estimated

/// Light that leaves a lit bar and arrives outside it: (Σ estimate − Σ truth) / Σ truth. Negative: too dark.
double signed_outside_bar(const TransportTensor& tensor, const Scene& scene) {
  const Image<float> bar = bar_pattern(scene.grid()), truth = scene.apply(bar);
  const Image<float> estimate = or_give_up(tensor.apply(bar));
  double sum = 0, difference = 0;
  for (std::size_t i = 0; i < bar.values().size(); ++i) {
    if (bar.values()[i] > 0) continue;
    sum += truth.values()[i];
    difference += estimate.values()[i] - truth.values()[i];
  }
  return sum > 0 ? difference / sum : kNone;
}

void run(const std::string& scene, const std::string& size, const std::string& profile, int seed,
         const Way& way) {
  const std::string uri = fmt::format("sim:{}?size={}&seed={}&exposures={}&profile={}", scene, size, seed,
                                      way.exposures, profile);
  const auto rig = or_give_up(open_virtual_rig(uri));
  CaptureOptions options;
  options.algorithm = way.algorithm;
  options.polish = way.polish;
  if (way.tolerance != 1) options.tolerance = way.tolerance * *default_tolerance(way.algorithm);
  const CaptureResult result = or_give_up(capture(*rig, options));
  const Scene& truth = rig->truth();
  const TransportErrors error = or_give_up(
      evaluate(result.tensor, [&](const Image<float>& p) -> Result<Image<float>> { return truth.apply(p); }));
  const ProbeCost cost = rig->cost();
  const RigTime time = rig->rig().time();
  const TransportErrors claimed =
      result.estimated.value_or(TransportErrors{kNone, kNone, kNone, kNone, kNone, kNone, kNone});
  fmt::print("{},{},{},{},\"{}\",{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.3g}", scene, size, profile, seed,
             way.name, result.patterns, cost.frames, cost.rig_seconds, time.light, time.camera,
             time.projector, result.process_seconds + cost.merge_seconds);
  for (const double number :
       {error.frobenius, error.flood, error.indirect, error.bar_indirect, claimed.frobenius, claimed.flood,
        claimed.indirect, claimed.bar_indirect, signed_outside_bar(result.tensor, truth)})
    fmt::print(",{:.4g}", number);
  fmt::print("\n");
  (void)std::fflush(stdout);
}

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    parts.emplace_back(text.substr(0, comma));
    text = comma == std::string_view::npos ? std::string_view() : text.substr(comma + 1);
  }
  return parts;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string size = argc > 1 ? argv[1] : "64x64";
  const std::vector<std::string> profiles = split(argc > 2 ? argv[2] : "screen60");
  const std::string_view scenes = argc > 3 ? argv[3] : "all";
  const int seed = argc > 4 ? static_cast<int>(std::strtol(argv[4], nullptr, 10)) : 7;
  const std::string seeds = argc > 5 ? argv[5] : "1-20";
  char* rest = nullptr;
  const int first = static_cast<int>(std::strtol(seeds.c_str(), &rest, 10));
  const int last = *rest == '-' ? static_cast<int>(std::strtol(rest + 1, nullptr, 10)) : first;
  fmt::print(
      "scene,size,profile,seed,way,patterns,frames,rig_seconds,light_seconds,camera_seconds,projector_"
      "seconds,"
      "host_seconds,frobenius,flood,indirect,bar_indirect,estimated_frobenius,estimated_flood,estimated_"
      "indirect,"
      "estimated_bar_indirect,signed_outside_bar\n");
  for (const std::string& profile : profiles) {
    for (const std::string_view name : scene_names())
      for (const Way& way : kWays)
        if (name != "random" && scenes != "random") run(std::string(name), size, profile, seed, way);
    for (int k = first; k <= last && scenes != "fixed"; ++k)
      for (const Way& way : kWays) run("random", size, profile, k, way);
  }
}
