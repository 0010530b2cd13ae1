// SPDX-License-Identifier: Apache-2.0
// What is assumed of nodes that no photograph has tested, so that the tensor is complete at any moment.
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/error_estimate.hpp"
#include "acquisition/search/findings.hpp"

namespace symrig::acquisition {

/// Assumed transport of the unknown nodes. A pair of different blocks is the product of its images. A block
/// with itself is direct light alone, or also the product of its images.
struct Assumption {
  bool direct = true;  ///< of blocks with themselves
  ErrorBar error;      ///< estimated frobenius error if the search ended here
};

/// The assumption that the checks contradict less. Changes nothing that is known.
Assumption better_assumption(const SceneFacts& facts, Findings& found, Checks& checks);

/// The tensor with all unknown nodes as assumed. Changes nothing that is known.
TensorBuilder assumed_draft(const SceneFacts& facts, Findings& found, bool direct);

/// Stores all unknown nodes as assumed. checks: may be nullptr; then blocks with themselves are direct light.
void accept_open(const SceneFacts& facts, Findings& found, Checks* checks);

}  // namespace symrig::acquisition
