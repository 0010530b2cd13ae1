// SPDX-License-Identifier: Apache-2.0
// What the two ways to measure a sensor share.
#pragma once

#include "hdr/sensor_statistics.hpp"
#include "symrig/hdr/sensor.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::hdr {

/// Marks pixels whose dark level or dark noise differs from the others'. frames: how many `dark` is from.
void find_hot(const PixelMoments& dark, std::size_t frames, std::span<std::uint8_t> defects);

/// The mean of the pixels that are no defects; 0 if there are none.
double mean_of(std::span<const double> values, std::span<const std::uint8_t> defects);

/// √(squares / count − noise), at least 0.
double rms_beyond(double squares, double count, double noise);

/// The rms difference of the pixels' dark levels, without the part from temporal noise.
double dsnu_of(const PixelMoments& dark, std::span<const std::uint8_t> defects, std::size_t frames);

/// Sets the noise model of a sensor and its uncertainties from its transfer line.
void set_noise(Sensor& sensor, const TransferLine& line, int bits, double pedestal, int clipping);

}  // namespace symrig::hdr
