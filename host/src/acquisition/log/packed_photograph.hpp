// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::acquisition {

// A photograph in three bytes a sample, in strips of rows (docs/photograph-log.md).
//
// A camera that is finer than the cells has ten times as many samples as they have, and a fit to its own
// pixels reads all photographs of a few rows at a time. So a strip is stored in one piece, with a checksum
// of its own.
//
// mean: 16 bits, in steps of the pixel's own (kept_steps()): a step is a small share of its flood-lit light,
// so rounding stays far below the noise wherever a pattern leaves it. variance: 8 bits, eight steps an
// octave. Rounding is noise: a twelfth of the squared step is part of the variance.

/// All parts of a log are so long.
constexpr std::size_t padded(std::size_t bytes) {
  return (bytes + 7) / 8 * 8;
}

/// Each has kLogStripRows rows; the last one may have fewer.
int strips_of(Grid camera);
int rows_of_strip(Grid camera, int strip);
/// Makes pictures of the size of a strip, if they are not.
void shape_of_strip(Grid camera, int channels, int strip, Radiance& to);

/// Of a whole photograph.
std::size_t packed_bytes(Grid camera, int channels);

/// out: packed_bytes(). steps: of the same shape as the photograph, above 0. A mean outside of the codes
/// becomes a sample that is not valid.
void pack(const Radiance& photograph, const Image<float>& steps, std::byte* out);

/// Whether a strip is as it was written. packed: the whole photograph.
bool strip_sound(std::span<const std::byte> packed, Grid camera, int channels, int strip);

/// The rows of a strip that is sound. to: its pictures have the camera's size; only those rows are written.
void unpack_strip(std::span<const std::byte> packed, const Image<float>& steps, int strip, Radiance& to);

/// Where a strip's bytes are in a packed photograph.
struct StripPlace {
  std::size_t begin = 0, bytes = 0;
};
StripPlace place_of_strip(Grid camera, int channels, int strip);
/// Bytes at the front of a packed photograph that hold what its strips share, and their checksums.
std::size_t packed_front_bytes(Grid camera);

/// A strip read alone. front: packed_front_bytes(); bytes: those of place_of_strip(). to: its pictures have
/// the rows of the strip.  false: it has changed since it was written.
[[nodiscard]] bool unpack_strip_alone(std::span<const std::byte> front, std::span<const std::byte> bytes,
                                      const Image<float>& steps, int strip, Radiance& to);

}  // namespace symrig::acquisition
