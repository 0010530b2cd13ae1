// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

/// What host/viewer/bundle.py makes of host/viewer at build time.
namespace symrig::viewer {

/// The page: HTML with its style and script, and @MARKS@ for what differs (page_text.cpp).
std::string_view page_template();
/// The kernel: a WebAssembly module (host/viewer/kernel).
std::string_view kernel_module();

}  // namespace symrig::viewer
