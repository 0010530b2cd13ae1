// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/node_counts.hpp"

#include <cstdint>
#include <string>
#include <vector>

/// Inline SVG with colours from the page's style.
namespace symrig::report {

/// One bar for each level, divided into the shares of its nodes [Garg06 Fig. 9], with a legend above.
std::string node_bars(const std::vector<NodeCounts>& levels);

struct Bar {
  std::string label;
  double value = 0;
  std::string text;  ///< beside the bar
  bool accent = false;
};

/// Horizontal bars on a logarithmic axis that begins at 1. quantity: the label of the axis.
std::string log_bars(const std::vector<Bar>& bars, const std::string& quantity);

}  // namespace symrig::report
