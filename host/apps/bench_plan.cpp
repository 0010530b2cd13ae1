// SPDX-License-Identifier: Apache-2.0

#include "bench_plan.hpp"

#include "options.hpp"
#include "rig.hpp"
#include "symrig/base/time.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <numeric>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::apps {

namespace {

template <class T>
std::vector<T> each_once(const std::vector<T>& all) {
  std::vector<T> once;
  for (const T& one : all)
    if (std::find(once.begin(), once.end(), one) == once.end()) once.push_back(one);
  return once;
}

std::vector<std::string> scenes_of(const BenchChoice& choice) {
  if (!choice.scenes.empty()) return each_once(choice.scenes);
  return {scene_names().begin(), scene_names().end()};
}

std::vector<std::string> sizes_of(const BenchChoice& choice) {
  if (!choice.sizes.empty()) return each_once(choice.sizes);
  return {choice.quick ? "32x32" : "64x64"};
}

/// The reference comes first.
std::vector<std::string> algorithms_of(const BenchChoice& choice) {
  if (!choice.algorithms.empty()) return each_once(choice.algorithms);
  std::vector<std::string> names;
  for (const AlgorithmInfo& one : algorithms())
    names.insert(one.reference ? names.begin() : names.end(), std::string(one.name));
  return names;
}

/// Parses one rig name per scene, size and profile, so that names and numbers are checked as in every other
/// command.
Result<void> read_rigs(const BenchChoice& choice, BenchPlan& plan) {
  plan.scenes = scenes_of(choice);
  if (!choice.profiles.empty()) plan.profiles = each_once(choice.profiles);
  for (const std::string& size : sizes_of(choice))
    for (const std::string& scene : plan.scenes)
      for (const std::string& profile : plan.profiles) {
        const std::string rig = fmt::format("sim:{}?size={}&noise={}&channels={}&profile={}", scene, size,
                                            choice.noise, choice.channels, profile);
        SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
        plan.camera_noise = uri.camera_noise;
        plan.channels = uri.channels;
        if (scene == plan.scenes.front()) plan.sizes.push_back(uri.size);
      }
  plan.sizes = each_once(plan.sizes);
  return {};
}

Result<void> read_seeds(const BenchChoice& choice, BenchPlan& plan) {
  constexpr int kMost = 1000;
  const int seeds = choice.seeds.value_or(choice.quick ? 1 : 3);
  if (seeds < 1 || seeds > kMost)
    return Error{ErrorCode::bad_argument, fmt::format("--seeds cannot be {}", seeds),
                 fmt::format("give a whole number from 1 to {}", kMost)};
  plan.seeds.resize(seeds);
  std::iota(plan.seeds.begin(), plan.seeds.end(), 1);
  return {};
}

Result<double> read_tolerance(std::string_view text) {
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size())
    return Error{ErrorCode::bad_argument, fmt::format("--tolerances: '{}' is not a number", text),
                 "give numbers separated by commas, such as 1e-3,3e-4"};
  SYMRIG_CHECK(check_tolerance("--tolerances", value));
  return value;
}

/// Tolerances by algorithm. The key "" holds those for every algorithm ("1e-3"); "paper:3e-4" is for one.
using Tolerances = std::map<std::string, std::vector<double>>;

Result<Tolerances> read_tolerances(const BenchChoice& choice) {
  Tolerances all;
  for (const std::string& group : choice.tolerances) {
    const std::size_t colon = group.find(':');
    const std::string algorithm = colon == std::string::npos ? "" : group.substr(0, colon);
    if (!algorithm.empty()) SYMRIG_CHECK(parse_algorithm(algorithm));
    std::string_view rest = std::string_view(group).substr(colon == std::string::npos ? 0 : colon + 1);
    for (bool more = true; more;) {
      const std::size_t comma = rest.find(',');
      SYMRIG_TRY(const double value, read_tolerance(rest.substr(0, comma)));
      all[algorithm].push_back(value);
      more = comma != std::string_view::npos;
      if (more) rest.remove_prefix(comma + 1);
    }
  }
  return all;
}

/// Factors on the algorithm's default tolerance. Dual photography needs many patterns at a tight tolerance.
std::vector<double> default_factors(Algorithm algorithm, bool quick) {
  std::vector<double> factors =
      quick ? std::vector{4.0, 1.0, 0.25} : std::vector{8.0, 4.0, 2.0, 1.0, 0.5, 0.25};
  std::erase_if(factors, [&](double factor) { return factor < algorithm_info(algorithm).finest_factor; });
  return factors;
}

BenchSweep sweep_of(Algorithm algorithm, const Tolerances& given, bool quick) {
  BenchSweep sweep{.algorithm = algorithm, .preset = default_tolerance(algorithm).value_or(0)};
  if (!algorithm_info(algorithm).tolerance) return sweep;
  for (const std::string& key : {std::string(name(algorithm)), std::string()})
    if (const auto found = given.find(key); found != given.end() && sweep.tolerances.empty())
      sweep.tolerances = found->second;
  if (sweep.tolerances.empty())
    for (const double factor : default_factors(algorithm, quick))
      sweep.tolerances.push_back(factor * sweep.preset);
  return sweep;
}

/// Refuses tolerances that no capture would use.
Result<void> check_tolerances_used(const BenchPlan& plan, const Tolerances& given) {
  for (const auto& one : given) {
    const std::string& algorithm = one.first;
    const auto uses = [&](const BenchSweep& sweep) {
      const bool own = !algorithm.empty() && name(sweep.algorithm) == algorithm;
      const bool shared = algorithm.empty() && !given.contains(std::string(name(sweep.algorithm)));
      return algorithm_info(sweep.algorithm).tolerance && (own || shared);
    };
    if (std::any_of(plan.sweeps.begin(), plan.sweeps.end(), uses)) continue;
    return Error{
        ErrorCode::bad_argument,
        algorithm.empty()
            ? std::string("--tolerances without an algorithm's name have no effect: no algorithm uses them")
            : fmt::format("--tolerances {}: have no effect: no such capture runs", algorithm),
        "remove them, or add their algorithm to --algorithms"};
  }
  return {};
}

/// Refuses --quick if every default that it makes smaller is given.
Result<void> check_quick_used(const BenchChoice& choice, const Tolerances& given) {
  const auto names = algorithms_of(choice);
  const bool swept = std::all_of(names.begin(), names.end(), [&given](const std::string& name) {
    const auto algorithm = parse_algorithm(name);
    return (algorithm && !algorithm_info(*algorithm).tolerance) || given.contains(name) || given.contains("");
  });
  if (!choice.quick || !choice.seeds || choice.sizes.empty() || !swept) return {};
  return Error{ErrorCode::bad_argument,
               "--quick has no effect with --size, --seeds and --tolerances: it only makes their defaults "
               "smaller",
               "remove it"};
}

std::vector<std::string_view> profile_names() {
  std::vector<std::string_view> names;
  names.reserve(rig_profiles().size());
  for (const RigProfile& profile : rig_profiles()) names.push_back(profile.name);
  return names;
}

}  // namespace

void add_bench_choice(CLI::App& command, BenchChoice& choice) {
  const auto list = [&command](const char* option, std::vector<std::string>& into, const char* help,
                               const char* type) {
    return command.add_option(option, into, help)->delimiter(',')->allow_extra_args(false)->type_name(type);
  };
  takes_words(list("--scenes", choice.scenes, "Scenes, separated by commas (default: all)", "NAME,..."),
              scene_names());
  list("--size", choice.sizes, "Grid, rows x columns; can be repeated (default: 64x64)", "RxC");
  takes_words(
      list("--profiles", choice.profiles,
           "Timing and light of the rig, separated by commas: values of the key profile (default: standard)",
           "NAME,..."),
      profile_names());
  const std::string algorithms_help =
      fmt::format("Algorithms, separated by commas (default: {})", fmt::join(algorithms_of({}), ","));
  takes_words(list("--algorithms", choice.algorithms, algorithms_help.c_str(), "NAME,..."),
              algorithm_names());
  command
      .add_option(
          "--tolerances", choice.tolerances,
          "Shares of the flood-lit RMS, for all or one algorithm; can be repeated (default: its own x 8 "
          "to 1/4)")
      ->allow_extra_args(false)
      ->type_name("[NAME:]X,...");
  command.add_option("--seeds", choice.seeds, "Run seeds 1 to N of textures and noise (default: 3)")
      ->type_name("N");
  takes_words(command.add_option("--noise", choice.noise, "Camera noise: camera or off")
                  ->type_name("NAME")
                  ->capture_default_str(),
              {"camera", "off"});
  takes_words(command.add_option("--channels", choice.channels, "Colour channels: 1 or 3")
                  ->type_name("N")
                  ->capture_default_str(),
              {"1", "3"});
  takes_number<int>(command.get_option("--seeds"));
  takes_number<int>(command.get_option("--channels"));
  command.add_flag("--quick", choice.quick, "Smaller defaults: 32x32, one seed, three tolerances");
}

Result<BenchPlan> bench_plan(const BenchChoice& choice) {
  BenchPlan plan;
  SYMRIG_CHECK(read_rigs(choice, plan));
  SYMRIG_CHECK(read_seeds(choice, plan));
  SYMRIG_TRY(const Tolerances given, read_tolerances(choice));
  for (const std::string& text : algorithms_of(choice)) {
    SYMRIG_TRY(const Algorithm algorithm, parse_algorithm(text));
    plan.sweeps.push_back(sweep_of(algorithm, given, choice.quick));
  }
  SYMRIG_CHECK(check_tolerances_used(plan, given));
  SYMRIG_CHECK(check_quick_used(choice, given));
  return plan;
}

namespace {

/// The true scene of an open rig. It keeps the rig alive.
std::shared_ptr<const Scene> scene_of(const std::shared_ptr<VirtualRig>& rig) {
  return {rig, &rig->truth()};
}

}  // namespace

Result<BenchedTensor> run_case(const BenchPlan& plan, const BenchCase& what, const Progress& progress) {
  const Stopwatch watch;
  SYMRIG_TRY(std::unique_ptr<VirtualRig> opened, open_simulated_rig(bench_rig(plan, what)));
  const std::shared_ptr<VirtualRig> rig = std::move(opened);
  SYMRIG_TRY(CaptureResult result,
             capture(*rig, {.algorithm = what.algorithm, .tolerance = what.tolerance, .progress = progress}));
  const double wall_seconds = watch.seconds();
  const ProbeCost cost = rig->cost();
  SYMRIG_TRY(const TransportErrors error, evaluate(result.tensor, told(truth_of(scene_of(rig)), progress)));
  BenchCapture capture{.what = what,
                       .patterns = result.patterns,
                       .frames = cost.frames,
                       .tensor_bytes = result.tensor.bytes(),
                       .rig_seconds = cost.rig_seconds,
                       .rig_time = rig->rig().time(),
                       .process_seconds = result.process_seconds,
                       .merge_seconds = cost.merge_seconds,
                       .simulate_seconds = cost.simulate_seconds,
                       .wall_seconds = wall_seconds,
                       .error = error,
                       .failure = {}};
  return BenchedTensor{std::move(capture), std::move(result.tensor)};
}

}  // namespace symrig::apps
