// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <string>

/// Numbers for people. Scripts read the JSON instead.

namespace symrig::text {

/// 1234567 → "1,234,567".
std::string grouped(double number);
/// Three significant figures: "0.00123", "4.56e-07".
std::string short_number(double number);
/// "0.12 %", "99.6 %": two significant figures, one decimal at least.
std::string percent(double share);
/// "12.3 MB" (decimal units).
std::string byte_size(double bytes);
/// "3 h 20 min", "4 min 5 s", "1.2 s", "35 ms".
std::string duration(double seconds);

}  // namespace symrig::text

namespace symrig {

/// The word SYMRIG in block letters, on one line or two, whichever is larger. Reports relight with this
/// picture [Garg06 Fig. 1 uses letters too].
/// shapes: [grid, 1 channel].
/// units: 0..1, the share of the pixel that the strokes cover. So any grid works; letters blur if a stroke is
/// thinner than a pixel.
Image<float> letters_pattern(Grid grid);

}  // namespace symrig
