// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/photograph_each.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::calibration {

Result<std::vector<Radiance>> photograph_each(Probe& probe, std::span<const Pattern> patterns,
                                              const std::string& step, const Progress& progress) {
  std::vector<Radiance> photographs;
  photographs.reserve(patterns.size());
  const auto count = static_cast<std::int64_t>(patterns.size());
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    if (progress && !progress({step, static_cast<std::int64_t>(k), count, kNoneToCome}))
      return Error{ErrorCode::interrupted,
                   fmt::format("calibration stopped at photograph {} of {} ({})", k + 1, count, step),
                   "run it again"};
    SYMRIG_TRY(auto one, probe.measure(patterns.subspan(k, 1)));
    photographs.push_back(std::move(one.front()));
  }
  return photographs;
}

}  // namespace symrig::calibration
