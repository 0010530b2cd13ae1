// SPDX-License-Identifier: Apache-2.0
// What the parts of a hierarchical capture need to be tested one by one.
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/scene_facts.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/statistics.hpp"

#include <cmath>
#include <memory>
#include <vector>

namespace symrig::tests {

/// Standard normal numbers, the same on every machine but for the last bit of log and cos (Box and Muller).
class Gaussian {
 public:
  explicit Gaussian(std::uint64_t seed) : random_(seed) {}
  double operator()() {
    return std::sqrt(-2 * std::log(1 - random_.uniform())) * std::cos(6.283185307179586 * random_.uniform());
  }

 private:
  Random random_;
};

/// What a search needs around a probe and its log: F = 1 in every channel, and nothing is known.
struct Workbench {
  explicit Workbench(Probe& probe)
      : tree(probe.grid()),
        log(make_memory_log(probe.grid(), probe.channels())),
        logged(probe, *log, 32),
        photographer(logged, log.get(), tree, {}),
        known(tree, probe.channels()),
        facts{options, tree, probe.channels(), std::vector<double>(probe.channels(), 1.0)} {}

  CaptureSettings options;
  BlockTree tree;
  std::unique_ptr<PhotographLog> log;
  LoggedProbe logged;
  acquisition::Photographer photographer;
  acquisition::KnownTransport known;
  acquisition::SceneFacts facts;
};

/// Runs the default capture.
inline CaptureOptions default_options() {
  return {.rule = default_rule(Algorithm::symrig), .economy = default_economy(Algorithm::symrig)};
}

}  // namespace symrig::tests
