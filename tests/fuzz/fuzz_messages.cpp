// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/messages.hpp"
#include "targets.hpp"

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

}  // namespace

void fuzz_messages(const std::uint8_t* data, std::size_t size) {
  expect_stable<symrig_wire_Request>(data, size);
  expect_stable<symrig_wire_Reply>(data, size);
  expect_stable<symrig_wire_Event>(data, size);
}

}  // namespace symrig::fuzz
