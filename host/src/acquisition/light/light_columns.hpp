// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_series.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

namespace symrig::acquisition {

/// Measured by brute force: a photograph for each pixel alone, and nothing else; enough pixels to tell
/// something.
bool are_columns(const TransportTensor& measured);

/// Whether these photographs can be those of a coaxial rig: each holds most light where it is lit, and as
/// much light goes from a pixel to another as comes back. Random patterns tell this from seven photographs,
/// but not on few pixels, and not of one photograph among many. measured: are_columns().  fails: wrong_light.
Result<void> check_columns(const TransportTensor& measured);

/// Whether all columns together give the flood-lit photograph.
/// measured: are_columns().  cost: no photograph if they do, else six.  fails: wrong_light; as look.
Result<void> check_sum_of_columns(const TransportTensor& measured, const LightSeries& series,
                                  const LookAside& look);

}  // namespace symrig::acquisition
