// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"

#include <optional>

namespace symrig {

/// T of a simulated bench with a camera of its own, through the exact map: what a perfect registration
/// would capture, with its ghost, the gain ratio and the blurs of its optics corrected. It differs from T of
/// the ideal coaxial rig by what the camera's pixels do not show of a cell. Empty: the camera shares the
/// cells.
/// fails: as make_scene.
Result<std::optional<TrueTransport>> bench_truth(const SceneUri& uri);

/// The gain ratio of such a bench on the cells, exactly: GainRatio. Empty: the camera shares the cells.
/// fails: as make_scene.
Result<Image<float>> bench_gain(const SceneUri& uri);

}  // namespace symrig
