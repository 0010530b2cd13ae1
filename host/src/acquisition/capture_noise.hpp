// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/completion.hpp"
#include "acquisition/search/photographer.hpp"
#include "symrig/acquisition/noise_check.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>

namespace symrig::acquisition {

/// Compares photographs of the same light that a capture has taken: the first flood-lit one, some of those at
/// the end, the held-out halves. first_again: log number of the flood-lit ones at the end, 0: none.
/// completion: of a capture that brute force ended, or nullptr.  fails: as Photographer::read.
Result<NoiseCheck> check_noise(const BlockTree& tree, const Photographer& photographer, const Checks& checks,
                               std::int64_t first_again, const Completion* completion);

}  // namespace symrig::acquisition
