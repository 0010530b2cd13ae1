// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/job/capture_job.hpp"

#include <string_view>

namespace symrig::capi {

/// Sets what the options of symrig_capture() say: pairs key=value with blanks or line feeds between them.
/// fails: bad_argument (no pair, a value out of its kind, a key twice), unknown_name (a key, or the name of
/// an algorithm or an order).
Result<void> take_capture_text(std::string_view text, CaptureJob& job);

}  // namespace symrig::capi
