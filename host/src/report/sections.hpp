// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/capture_facts.hpp"
#include "symrig/report/html_report.hpp"
#include "symrig/report/summary.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig::report {

/// What every section may look at.
struct Context {
  const StoredScene& scene;
  const ReportOptions& options;
  CaptureFacts facts;
  std::optional<TransportErrors> errors;  ///< present when truth is known
  std::vector<HeldOutError> held_out;     ///< one for each held-out photograph

  const TransportTensor& tensor() const { return scene.tensor; }
  bool has_truth() const { return static_cast<bool>(options.truth); }
};

/// Each returns one piece of the page, empty if it has nothing to show for this scene.
std::string headline(const Context& context);                  // what it is, key numbers
Result<std::string> lights_section(const Context& context);    // flood-lit, bar, letters, beside truth
Result<std::string> inside_section(const Context& context);    // a slice of T, the level map
Result<std::string> levels_section(const Context& context);    // Fig. 9 and Fig. 11
std::string errors_section(const Context& context);            // the errors of TransportErrors
Result<std::string> held_out_section(const Context& context);  // photographs beside predictions
std::string cost_section(const Context& context);              // patterns, time, memory, how to repeat it

/// ‖estimate − truth‖ / ‖truth‖ over all values; 0 if truth is all zero.
double relative_error(const Image<float>& estimate, const Image<float>& truth);

/// Pictures of larger grids are averaged down to this many pixels on the longer side, to keep the page small.
inline constexpr int kPictureSide = 720;

}  // namespace symrig::report
