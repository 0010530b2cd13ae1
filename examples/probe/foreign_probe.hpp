// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "foreign_rig.hpp"
#include <symrig/acquisition/probe.hpp>
#include <symrig/base/time.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// Somebody else's rig as a Probe: all that symrig needs to capture with it (docs/howto-own-rig.md).
class ForeignProbe final : public symrig::Probe {
 public:
  static symrig::Result<std::unique_ptr<ForeignProbe>> open() {
    std::unique_ptr<ForeignProbe> probe(new ForeignProbe);
    if (const int code = probe->rig_.connect(); code != 0) return failure("connect", code);
    return probe;
  }

  symrig::Grid grid() const override { return {foreign::kHeight, foreign::kWidth}; }
  int channels() const override { return 1; }
  symrig::ProbeCost cost() const override { return cost_; }
  std::string describe() const override { return "foreign rig"; }

  symrig::Result<std::vector<symrig::Radiance>> measure(std::span<const symrig::Pattern> patterns) override {
    SYMRIG_CHECK(check_patterns(*this, patterns));  // before the first one is shown
    const symrig::Stopwatch watch;
    std::vector<symrig::Radiance> photographs;
    for (const symrig::Pattern& pattern : patterns) {
      std::vector<std::uint16_t> levels(pattern.values().size()), counts;
      for (std::size_t i = 0; i < levels.size(); ++i)
        levels[flipped(i)] =
            static_cast<std::uint16_t>(std::lround(pattern.values()[i] * foreign::kWhiteLevel));
      if (const int code = rig_.shoot(levels, counts); code != 0) return failure("shoot", code);
      photographs.push_back(photograph(counts));
    }
    cost_.photographs += static_cast<std::int64_t>(patterns.size());
    cost_.frames += static_cast<std::int64_t>(patterns.size());  // one exposure each
    cost_.rig_seconds += watch.seconds();
    return photographs;
  }

 private:
  static symrig::Error failure(const char* what, int code) {
    return {symrig::ErrorCode::device_lost,
            std::string("the foreign rig failed to ") + what + " (" + std::to_string(code) + ")",
            "look the number up in its manual"};
  }

  /// This rig counts rows from the bottom, symrig from the top.
  static std::size_t flipped(std::size_t i) {
    return (foreign::kHeight - 1 - i / foreign::kWidth) * foreign::kWidth + i % foreign::kWidth;
  }

  /// Counts to radiance. The variance is that of the mean: shot noise, read noise and rounding.
  symrig::Radiance photograph(const std::vector<std::uint16_t>& counts) const {
    symrig::Radiance out{symrig::Image<float>(grid()), symrig::Image<float>(grid()),
                         symrig::Image<std::uint8_t>(grid())};
    constexpr double kUnit = foreign::kSaturated - foreign::kPedestal;  // counts of one unit of radiance
    constexpr double kPerCount = foreign::kElectronsPerCount;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const std::uint16_t count = counts[flipped(i)];
      if (count >= foreign::kSaturated) continue;       // valid stays 0
      const double light = count - foreign::kPedestal;  // signed: black subtraction clips nothing
      const double variance = std::max(light, 0.0) / kPerCount +
                              foreign::kReadNoise * foreign::kReadNoise / (kPerCount * kPerCount) + 1.0 / 12;
      out.mean.values()[i] = static_cast<float>(light / kUnit);
      out.variance.values()[i] = static_cast<float>(variance / (kUnit * kUnit));
      out.valid.values()[i] = 1;
    }
    return out;
  }

  foreign::Rig rig_;
  symrig::ProbeCost cost_;
};
