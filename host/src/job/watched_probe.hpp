// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/forwarding_probe.hpp"
#include "symrig/job/capture_job.hpp"

#include <span>
#include <utility>
#include <vector>

namespace symrig::job {

/// A probe that shows its photographs to somebody else too. It changes nothing.
class WatchedProbe final : public ForwardingProbe {
 public:
  /// inner must outlive this.
  WatchedProbe(Probe& inner, SeePhotographs see) : ForwardingProbe(inner), see_(std::move(see)) {}

 private:
  Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                     Result<std::vector<Radiance>> photographs) override {
    if (photographs && !patterns.empty() && photographs->size() == patterns.size())
      see_(cost(), patterns, *photographs);
    return photographs;
  }

  SeePhotographs see_;
};

}  // namespace symrig::job
