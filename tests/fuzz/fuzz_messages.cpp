// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/messages.hpp"
#include "targets.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace symrig::fuzz {
namespace {

template <class Message>
void expect_stable(const std::uint8_t* data, std::size_t size) {
  Message message;
  if (!protocol::decode({data, size}, message)) return;
  protocol::BodyBuffer first{};
  const std::size_t first_size = encode(message, first);
  require(first_size <= protocol::kMaxBody, "a message fits its bound");
  Message again;
  require(protocol::decode({first.bytes, first_size}, again), "what was encoded can be decoded");
  protocol::BodyBuffer second{};
  const std::size_t second_size = encode(again, second);
  require(first_size == second_size && std::memcmp(first.bytes, second.bytes, first_size) == 0,
          "encoding is stable");
}

/// Marks and edges have an encoder of their own, which gives the same bytes.
void expect_twin(const std::uint8_t* data, std::size_t size) {
  symrig_wire_Event event;
  if (!protocol::decode({data, size}, event)) return;
  protocol::BodyBuffer general{};
  protocol::BodyBuffer own{};
  const std::size_t general_size = encode(event, general);
  std::size_t own_size = 0;
  if (event.which_body == symrig_wire_Event_step_mark_tag) {
    own_size = encode(event.body.step_mark, own);
  } else if (event.which_body == symrig_wire_Event_edge_tag) {
    own_size = encode(event.body.edge, own);
  } else {
    return;
  }
  require(own_size == general_size && std::memcmp(own.bytes, general.bytes, own_size) == 0,
          "both encoders of marks and edges agree");
}

/// The first byte names a field of the outer message, the rest is what it holds: each kind of message is
/// reached at once.
void expect_each_stable(const std::uint8_t* data, std::size_t size) {
  if (size == 0 || size > protocol::kMaxBody - 6) return;
  std::array<std::uint8_t, protocol::kMaxBody> body{};
  const std::uint32_t field = data[0] % 64U;
  const auto content = static_cast<std::uint32_t>(size - 1);
  std::size_t at = 0;
  const auto varint = [&](std::uint32_t value) {
    for (; value >= 0x80; value >>= 7U) body[at++] = static_cast<std::uint8_t>(value | 0x80U);
    body[at++] = static_cast<std::uint8_t>(value);
  };
  varint(field << 3U | 2U);
  varint(content);
  std::copy_n(data + 1, content, body.begin() + static_cast<std::ptrdiff_t>(at));
  expect_stable<symrig_wire_Request>(body.data(), at + content);
  expect_stable<symrig_wire_Reply>(body.data(), at + content);
  expect_stable<symrig_wire_Event>(body.data(), at + content);
  expect_twin(body.data(), at + content);
}

}  // namespace

void fuzz_messages(const std::uint8_t* data, std::size_t size) {
  expect_stable<symrig_wire_Request>(data, size);
  expect_stable<symrig_wire_Reply>(data, size);
  expect_stable<symrig_wire_Event>(data, size);
  expect_twin(data, size);
  expect_each_stable(data, size);
}

}  // namespace symrig::fuzz
