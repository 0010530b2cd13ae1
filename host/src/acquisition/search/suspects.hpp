// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/known_transport.hpp"
#include "acquisition/search/scene_facts.hpp"

#include <cstdint>
#include <vector>

namespace symrig::acquisition {

/// Leaves that the check photographs find wrong, although their own photographs fit. Such a leaf has a block
/// that is dark while a random half of the pixels is lit. There the tensor misses by over ten tolerances
/// beyond noise, and by over half the size of its own entries. The leaf shines there strongly enough to have
/// a part in it. Transport that is balanced within every block (a checkerboard) passes every rank test, and
/// is found here.
std::vector<std::int32_t> suspects(const SceneFacts& facts, const KnownTransport& known,
                                   const std::vector<Checks::Residual>& all);

}  // namespace symrig::acquisition
