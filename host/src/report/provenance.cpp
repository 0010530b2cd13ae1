// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/provenance.hpp"

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig {
namespace {

bool simulated(const std::string& rig) {
  return rig.starts_with("sim:");
}

/// True if both scenes answer a random pattern equally, except for rounding.
bool same_light(const SceneUri& a, const SceneUri& b) {
  if (a.size != b.size || a.channels != b.channels) return false;
  const auto one = make_scene(a);
  const auto two = make_scene(b);
  if (!one || !two) return true;  // not known
  constexpr unsigned kSeed = 3;
  constexpr double kRounding = 1e-5;
  const Image<float> pattern = random_pattern(a.size, kSeed);
  const Image<float> p = (*one)->apply(pattern);
  const Image<float> q = (*two)->apply(pattern);
  double difference = 0, light = 0;
  for (std::size_t i = 0; i < p.values().size(); ++i) {
    const double d = static_cast<double>(p.values()[i]) - q.values()[i];
    difference += d * d;
    light += static_cast<double>(p.values()[i]) * p.values()[i];
  }
  return difference <= kRounding * kRounding * light;
}

std::vector<std::string> differences(const SceneUri& file, const SceneUri& rig) {
  std::vector<std::string> found;
  const auto compare = [&](const char* what, const auto& was, const auto& is) {
    if (!(was == is)) found.push_back(fmt::format("{} is {}, the file's is {}", what, is, was));
  };
  compare("the scene", file.name, rig.name);
  compare("size", to_string(file.size), to_string(rig.size));
  compare("channels", file.channels, rig.channels);
  compare("seed", file.seed, rig.seed);
  compare("psf", file.psf, rig.psf);
  compare("indirect", file.indirect, rig.indirect);
  return found;
}

}  // namespace

std::vector<std::string> differences_of_scene(const std::string& captured, const std::string& rig) {
  if (captured.empty() || captured == rig) return {};
  if (!simulated(captured) || !simulated(rig))
    return {fmt::format("the rig is {}, the file's is {}", rig, captured)};
  const auto file = parse_scene_uri(captured);
  const auto given = parse_scene_uri(rig);
  if (!file || !given) return {fmt::format("the rig is {}, the file's is {}", rig, captured)};
  if (same_light(*file, *given)) return {};
  return differences(*file, *given);
}

std::string other_scene_warning(const std::string& of, const std::vector<std::string>& differences) {
  if (differences.empty()) return "";
  return fmt::format("{} was captured from another scene: {}; the errors include this difference", of,
                     fmt::join(differences, ", "));
}

}  // namespace symrig
