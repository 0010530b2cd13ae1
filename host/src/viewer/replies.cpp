// SPDX-License-Identifier: Apache-2.0
#include "viewer/replies.hpp"

#include "viewer/light_code.hpp"
#include "viewer/page_tensor.hpp"
#include "viewer/page_text.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace symrig::viewer {
namespace {

constexpr std::string_view kNumbers = "application/octet-stream";

template <class T>
void append(std::string& to, std::span<const T> values) {
  to.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

/// White light shows all channels of the scene; light k of a coloured one shows channel k.
void append_channels(std::string& to, const Image<float>& seen, std::size_t light, bool white) {
  const int channels = seen.channels();
  const int first = white || channels == 1 ? 0 : static_cast<int>(light);
  const int end = white ? channels : first + 1;
  for (int channel = first; channel < end; ++channel) append_plane(to, seen.plane(channel));
}

}  // namespace

ViewReply refusal(unsigned status, std::string text) {
  return {.status = status, .body = std::move(text) + "\n"};
}

ViewReply nothing_here() {
  return refusal(404, "There is nothing at this address.");
}

ViewReply json_reply(const nlohmann::json& value) {
  return {.type = "application/json",
          .body = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)};
}

ViewReply page_reply(const nlohmann::json& facts, std::string_view nonce) {
  return {.type = "text/html; charset=utf-8",
          .body = page_text({.facts = facts, .nonce = nonce}),
          .policy = content_policy(nonce, true)};
}

ViewReply picture_reply(std::string_view light, Grid grid, const Seen& seen) {
  const auto lights = decode_light(light, grid);
  if (!lights) return refusal(400, "This is no light of the scene's size.");
  ViewReply reply{.type = kNumbers};
  for (std::size_t k = 0; k < lights->size(); ++k) {
    const auto picture = seen((*lights)[k]);
    if (!picture) return refusal(500, picture.error().line());
    append_channels(reply.body, *picture, k, lights->size() == 1);
  }
  return reply;
}

ViewReply relit_reply(std::string_view light, const TransportTensor& tensor, bool dual) {
  return picture_reply(
      light, dual ? tensor.camera_grid() : tensor.projector_grid(),
      [&](const Image<float>& one) { return dual ? tensor.apply_transposed(one) : tensor.apply(one); });
}

ViewReply photograph_reply(const Image<float>& pattern, const Image<float>& photograph) {
  ViewReply reply{.type = kNumbers};
  append_plane(reply.body, pattern.values());
  for (int channel = 0; channel < photograph.channels(); ++channel)
    append_plane(reply.body, photograph.plane(channel));
  return reply;
}

ViewReply leaves_reply(const TransportTensor& tensor) {
  const auto camera = tensor.camera_tree().order(), projector = tensor.projector_tree().order();
  std::vector<PageLeaf> table;
  for (const Leaf& leaf : tensor.leaves()) table.push_back(page_leaf(leaf, tensor.symmetric()));
  const std::array<std::int32_t, 3> head{static_cast<std::int32_t>(camera.size()),
                                         tensor.symmetric() ? 0 : static_cast<std::int32_t>(projector.size()),
                                         static_cast<std::int32_t>(table.size())};
  ViewReply reply{.type = kNumbers};
  append(reply.body, std::span<const std::int32_t>(head));
  append(reply.body, camera);
  if (!tensor.symmetric()) append(reply.body, projector);
  append(reply.body, std::span<const PageLeaf>(table));
  return reply;
}

}  // namespace symrig::viewer
