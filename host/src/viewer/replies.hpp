// SPDX-License-Identifier: Apache-2.0
// Replies that a finished and a live scene have in common.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "viewer/service.hpp"

#include <functional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace symrig::viewer {

ViewReply refusal(unsigned status, std::string text);
/// "There is nothing at this address."
ViewReply nothing_here();
ViewReply json_reply(const nlohmann::json& value);
/// The page with these facts.
ViewReply page_reply(const nlohmann::json& facts, std::string_view nonce);

/// The picture under a light (light_code.hpp), one plane or three. grid: of the light.
using Seen = std::function<Result<Image<float>>(const Image<float>& light)>;
ViewReply picture_reply(std::string_view light, Grid grid, const Seen& seen);
/// The same of a tensor. dual: its transpose.
ViewReply relit_reply(std::string_view light, const TransportTensor& tensor, bool dual);
/// A pattern and its photograph.
ViewReply photograph_reply(const Image<float>& pattern, const Image<float>& photograph);
/// Numbers of 32 bits: pixels of the camera, pixels of the projector (0 if it has the camera's order),
/// leaves; the orders; 7 numbers a leaf.
ViewReply leaves_reply(const TransportTensor& tensor);

}  // namespace symrig::viewer
