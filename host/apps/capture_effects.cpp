// SPDX-License-Identifier: Apache-2.0
#include "capture_effects.hpp"

#include "effects.hpp"

#include <array>

#include <fmt/format.h>

namespace symrig::apps {

Result<void> check_capture_effects(const CLI::App& command, Algorithm algorithm) {
  const bool dual = algorithm == Algorithm::dual;
  const bool searches = algorithm == Algorithm::symrig || algorithm == Algorithm::paper;
  const bool checked = default_economy(algorithm).checks;
  const std::string with = fmt::format("with --algorithm {}", name(algorithm));
  const std::array<Idle, 10> options{{
      {"--tolerance", algorithm == Algorithm::brute, with + ", which measures each pixel"},
      {"--tolerance", dual && command.count("--dual-threshold") > 0, "beside --dual-threshold"},
      {"--dual-threshold", !dual, with},
      {"--dual-subtract", !dual, with},
      {"--max-patterns", !searches, with + ", which runs to its end"},
      {"--max-seconds", !searches, with + ", which runs to its end"},
      {"--target-error", !checked, with + ", which holds no photographs out"},
      {"--polish", !searches, with},
      {"--photograph-seconds", !searches, with},
      {"--split", algorithm != Algorithm::symrig, with},
  }};
  return check_effects(command, options);
}

Result<void> check_rig_effects(const CLI::App& command, const Probe& rig) {
  const std::array<Idle, 2> options{{
      {"--split", rig.views().count() == 1, "on a rig of one view"},
      {"--photograph-seconds", !rig.plans_exposures(1),
       "on a rig of fixed exposures (exposures = \"auto\" plans them)"},
  }};
  return check_effects(command, options);
}

}  // namespace symrig::apps
