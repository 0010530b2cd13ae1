// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace symrig::report {

/// One style for screen (light and dark), phone and paper. Colours by role; charts use the same names.
extern const std::string_view kPageStyle;

}  // namespace symrig::report
