// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/file.hpp"
#include "viewer/page_tensor.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::viewer {

/// A tensor as bytes and a table of its sections: {"leaves": [offset, count], ...}. The page's script copies
/// the sections into the kernel's memory (host/viewer/page/engine_kernel.js). Values are 16-bit floats with
/// powers of two, the diagonal is 32-bit floats.
struct Pack {
  std::vector<std::uint8_t> bytes;
  nlohmann::json sections = nlohmann::json::object();
};

/// held_out: photographs that the page shows too; empty if the tensor is reduced.
Pack pack_tensor(const PageTensor& tensor, std::span<const HeldOut> held_out);

/// RFC 4648, without line breaks.
std::string base64_text(std::span<const std::uint8_t> bytes);

}  // namespace symrig::viewer
