// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <string>

namespace symrig::hdr {

Error bad_argument(std::string what, std::string hint = {});

/// fails: bad_argument.
Result<void> check_sensor(Grid grid, int channels, const NoiseModel& noise);
/// fails: size_mismatch, bad_argument (scale).
Result<void> check_options(const MergeOptions& options, Grid grid, int channels);

}  // namespace symrig::hdr
