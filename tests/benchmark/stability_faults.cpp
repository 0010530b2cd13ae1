// SPDX-License-Identifier: Apache-2.0
// benchmark_stability_faults RIG [check]: captures a simulated rig whose photographs are spoiled on their way
// to the algorithm, in ways that no key of a scene asks for. One JSON line a case. check: says instead what
// the coaxial check finds on that rig. tests/benchmark/stability runs it.
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/coaxial_check.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace symrig;

/// A probe whose photographs pass through other hands. number: photographs before this one.
class Spoiled final : public Probe {
 public:
  using Spoil = std::function<void(Radiance& photograph, std::int64_t number)>;
  Spoiled(Probe& probe, Spoil spoil) : probe_(probe), spoil_(std::move(spoil)) {}

  Grid grid() const override { return probe_.grid(); }
  int channels() const override { return probe_.channels(); }
  ProbeCost cost() const override { return probe_.cost(); }
  std::string describe() const override { return probe_.describe(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    SYMRIG_TRY(auto photographs, probe_.measure(patterns));
    for (Radiance& photograph : photographs) spoil_(photograph, number_++);
    return photographs;
  }

 private:
  Probe& probe_;
  Spoil spoil_;
  std::int64_t number_ = 0;
};

struct Case {
  const char* name;
  Spoiled::Spoil spoil;
};

/// Σ ‖M (T̃ − T) M z‖² / Σ ‖M T M z‖² over random signs z, square root; M leaves out what no photograph saw.
double live_error(const TransportTensor& tensor, const Scene& truth, const Image<std::uint8_t>& live) {
  Random random(5);
  double error = 0, size = 0;
  for (int probe = 0; probe < 12; ++probe) {
    Image<float> z(truth.grid());
    for (std::size_t i = 0; i < z.values().size(); ++i)
      z.values()[i] = random.sign() * (live.values()[i] != 0 ? 1.0F : 0.0F);
    const auto stored = tensor.apply(z);
    const Image<float> expected = truth.apply(z);
    if (!stored) return std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < expected.values().size(); ++i) {
      if (live.values()[i] == 0) continue;
      error += std::pow(stored->values()[i] - expected.values()[i], 2);
      size += std::pow(expected.values()[i], 2);
    }
  }
  return std::sqrt(error / size);
}

void run(const std::string& uri, const Case& one) {
  auto rig = open_virtual_rig(uri);
  if (!rig) return static_cast<void>(std::printf("%s\n", rig.error().line().c_str()));
  const Scene& scene = (*rig)->truth();
  Spoiled probe(**rig, one.spoil);
  CaptureOptions options;
  options.rule = default_rule(options.algorithm);
  options.economy = default_economy(options.algorithm);
  const auto flood = (*rig)->measure(std::vector<Pattern>{Pattern((*rig)->grid(), 1, 1.F)});
  const auto result = capture(probe, options);
  if (!result || !flood) {
    const Error& error = result ? flood.error() : result.error();
    std::printf("{\"case\": \"%s\", \"refused\": \"%s\"}\n", one.name, error.line().c_str());
    return;
  }
  const auto errors = evaluate(result->tensor, [&](const Image<float>& p) { return scene.apply(p); });
  if (!errors) return static_cast<void>(std::printf("%s\n", errors.error().line().c_str()));
  std::printf(
      "{\"case\": \"%s\", \"patterns\": %lld, \"frobenius\": %.3g, \"indirect\": %.3g, \"bar_indirect\": "
      "%.3g, \"flood\": %.3g, \"live\": %.3g}\n",
      one.name, static_cast<long long>(result->patterns), errors->frobenius, errors->indirect,
      errors->bar_indirect, errors->flood, live_error(result->tensor, scene, (*flood).front().valid));
}

/// Adds this share of what the dark projector shows: black that was not, or wrongly, subtracted.
Spoiled::Spoil with_black(const Image<float>& leak, double share) {
  return [&leak, share](Radiance& photograph, std::int64_t) {
    for (std::size_t i = 0; i < leak.values().size(); ++i)
      photograph.mean.values()[i] += static_cast<float>(share) * leak.values()[i];
  };
}

/// What is brighter than this is saturated: marked, or cut off without a word.
Spoiled::Spoil saturated(float limit, bool marked) {
  return [limit, marked](Radiance& photograph, std::int64_t) {
    for (std::size_t i = 0; i < photograph.mean.values().size(); ++i) {
      float& mean = photograph.mean.values()[i];
      if (mean < limit) continue;
      mean = marked ? 0 : limit;
      if (!marked) continue;
      photograph.variance.values()[i] = 0;
      photograph.valid.values()[i] = 0;
    }
  };
}

/// Calls hit(photograph, pixel) for a random share of the pixels, others in each photograph.
Spoiled::Spoil sprinkled(double share, const std::function<void(Radiance&, std::size_t)>& hit) {
  return [share, hit](Radiance& photograph, std::int64_t number) {
    Random random(static_cast<std::uint64_t>(1'000 + number));
    for (std::size_t i = 0; i < photograph.mean.values().size(); ++i)
      if (random.uniform() < share) hit(photograph, i);
  };
}

void lose(Radiance& photograph, std::size_t pixel) {
  photograph.mean.values()[pixel] = photograph.variance.values()[pixel] = 0;
  photograph.valid.values()[pixel] = 0;
}

Spoiled::Spoil one_pixel(float value) {
  return [value](Radiance& photograph, std::int64_t number) {
    if (number == 20) photograph.mean.values()[77] = value;
  };
}

/// Nothing but the noise that is stated.
void only_noise(Radiance& photograph, std::int64_t number) {
  Random random(static_cast<std::uint64_t>(9'000 + number));
  for (std::size_t i = 0; i < photograph.mean.values().size(); ++i) {
    double z = -6;  // a normal deviate: twelve uniforms
    for (int k = 0; k < 12; ++k) z += random.uniform();
    photograph.variance.values()[i] = 1e-8F;
    photograph.mean.values()[i] = static_cast<float>(1e-4 * z);
  }
}

std::vector<Case> cases_of(const VirtualRig& rig, const Image<float>& leak) {
  const Image<float> flood = rig.truth().apply(Image<float>(rig.grid(), 1, 1.0F));
  const float brightest = std::ranges::max(flood.values());
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const auto low = [](Radiance& photograph, std::size_t i) {
    photograph.mean.values()[i] -= 5 * std::sqrt(photograph.variance.values()[i]);
  };
  return {
      {"clean", [](Radiance&, std::int64_t) {}},
      {"black level unsubtracted", with_black(leak, 1)},
      {"black level 10 % wrong", with_black(leak, 0.1)},
      {"brightest third of the range saturated, marked", saturated(brightest * 2 / 3, true)},
      {"brightest third of the range saturated, unmarked", saturated(brightest * 2 / 3, false)},
      {"brightest two thirds of the range saturated, marked", saturated(brightest / 3, true)},
      {"1 % of the pixels missing, others each time", sprinkled(0.01, lose)},
      {"1 % of the pixels 5 sigmas low, others each time", sprinkled(0.01, low)},
      {"one pixel of one photograph -1", one_pixel(-1)},
      {"one pixel of one photograph NaN", one_pixel(kNan)},
      {"one pixel of one photograph infinite", one_pixel(kInf)},
      {"all black", only_noise},
  };
}

int measure(const std::string& uri, bool check) {
  const auto rig = open_virtual_rig(uri);
  if (!rig) {
    std::printf("%s\n", rig.error().line().c_str());
    return exit_code(rig.error().code);
  }
  if (check) {
    const auto found = check_coaxial(**rig);
    std::printf("%s\n", found ? found->to_string().c_str() : found.error().line().c_str());
    return 0;
  }
  const auto black = static_cast<float>((*rig)->uri().black);
  const Image<float> leak = (*rig)->truth().apply(Image<float>((*rig)->grid(), 1, black));
  for (const Case& one : cases_of(**rig, leak)) run(uri, one);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2 || argc == 3) return measure(argv[1], argc == 3);
    std::printf("usage: benchmark_stability_faults sim:NAME?... [check]\n");
    return 2;
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 5;
  }
}
