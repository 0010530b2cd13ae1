// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/check_sums.hpp"
#include "acquisition/errors/checks.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/gain_mismatch.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <span>

namespace symrig::acquisition {

/// The errors of a finished tensor by check photographs that it was not made from, each with its own error
/// (docs/research/error-estimates.md). The errors contain the mismatch of gains that `sums` knows.
/// noise_ratio: true over stated variance, as far as it is known to differ from 1.
ErrorEstimate estimate_errors(const CheckSums& sums, double noise_ratio = 1);

/// The frobenius error alone, by what is left of the two halves (Checks::halves) of residuals' photographs.
struct ErrorBar {
  double value = 0, half_width = 0;
};
ErrorBar frobenius_error(const BlockTree& tree, std::span<const Checks::Residual> residuals,
                         std::span<const TreePhotograph> left);

}  // namespace symrig::acquisition
