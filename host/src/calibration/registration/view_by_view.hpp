// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/view_layout.hpp"

#include <cstddef>
#include <optional>
#include <vector>

namespace symrig::calibration {

/// The pattern inside the tile of one view; dark elsewhere.
Pattern inside_view(const Pattern& pattern, ViewLayout views, std::size_t view);

/// Photographs of patterns that are lit from one view after another.
///
/// All views of a rig see the same scene. So a point is lit from all of them, and what a camera pixel gets
/// does not tell which projector pixel it faces. Light from one view alone does.
///
/// Light adds up, so few photographs are taken: what is dark inside a view is dark, a view that is lit whole
/// is photographed once, and the complement of the pattern before is that photograph less the pattern's.
/// The errors of a pattern and its complement then have a part in common.
class ViewByView {
 public:
  /// rig must outlive this.
  explicit ViewByView(Probe& rig);

  std::size_t views() const { return seen_.size(); }
  /// Result: the photograph of the pattern by each view alone.
  /// fails: as the rig.
  Result<std::vector<Radiance>> measure(const Pattern& pattern);

 private:
  struct Photographed {
    Pattern pattern;
    Radiance photograph;
  };
  /// What was seen of one view.
  struct Seen {
    std::optional<Radiance> whole;
    std::optional<Photographed> last;
  };
  Result<Radiance> photograph(const Pattern& pattern);
  Result<const Radiance*> whole_of(std::size_t view);
  Result<Radiance> measure_view(const Pattern& pattern, std::size_t view);

  Probe& rig_;
  std::vector<Seen> seen_;
};

}  // namespace symrig::calibration
