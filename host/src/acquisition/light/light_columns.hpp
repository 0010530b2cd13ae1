// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_series.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

namespace symrig::acquisition {

/// Whether the photographs of brute force, which lights each pixel alone, can be those of a coaxial rig: each
/// holds most light where it is lit, and as much light goes from a pixel to another as comes back. Random
/// patterns tell this from seven photographs, but not on few pixels, and not of one photograph among many.
/// Another tensor than that of brute force is not judged.
/// fails: wrong_light.
Result<void> check_columns(const TransportTensor& measured);

/// Whether all columns together give the flood-lit photograph.
/// cost: no photograph if they do, else six.  fails: wrong_light; as look.
Result<void> check_sum_of_columns(const TransportTensor& measured, const LightSeries& series,
                                  const LookAside& look);

}  // namespace symrig::acquisition
