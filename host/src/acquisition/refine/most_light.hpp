// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/refine/polish_jacobian.hpp"
#include "acquisition/search/known_transport.hpp"

#include <cstddef>

namespace symrig::acquisition {

/// Bounds on what any pattern of values from 0 to 1 gives in any sample, and on every sum of leaves on the
/// way: max_i Σ_leaf |a_i| Σ|b|, in doubles.
/// Of T p.
double most_light(const KnownTransport& known, int channels, std::size_t pixels);
/// Of J direction.
double most_change(const KnownTransport& known, int channels, std::size_t pixels,
                   const PolishNumbers& direction);

}  // namespace symrig::acquisition
