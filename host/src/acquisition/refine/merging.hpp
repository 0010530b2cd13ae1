// SPDX-License-Identifier: Apache-2.0
// What the search had to cut in pieces to measure it, put together again.
#pragma once

#include "acquisition/search/known_transport.hpp"
#include "acquisition/search/scene_facts.hpp"

namespace symrig::acquisition {

/// Leaves of neighbouring blocks become one leaf of rank k ≤ Economy::rank where that takes fewer bytes. The
/// merge goes from the finest level up, so that a merged leaf can be merged again. T on a rectangle of child
/// pairs of one pair of blocks is cut to its k largest singular values. k is the smallest that loses no more
/// than
///   E = Σ_ab |ΔT_ab 1_b|² + |ΔT_ab' 1_a|² ≤ n ε²   in the photographs of the children, n samples,
///   L = |ΔT|²                           ≤ N ε²   in that of a random pattern of ±1, N: mean of rows and
/// columns,   ε² = (θ τ_A)² + V / n.
/// The first is the rank-1 test's own measure [Garg06 §5.2], the second sees what cancels within a child. V:
/// the noise that cutting to rank k takes out of the images of the pieces, so that no rank is spent on it.
/// The channels share k, since they share a leaf's index, and sum their E and L. Leaves of a block with
/// itself and scalars stay. Bit-equal for any number of threads.
void merge_leaves(const SceneFacts& facts, KnownTransport& known);

}  // namespace symrig::acquisition
