// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/frame.hpp"
#include "targets.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace symrig::fuzz {
namespace {

using protocol::Frame;
using protocol::FrameDecoder;

void expect_round_trip(const Frame& frame) {
  require(frame.body.size <= protocol::kMaxBody, "a body fits the MTU");
  const std::vector<std::uint8_t> body(frame.body.data, frame.body.data + frame.body.size);
  std::array<std::uint8_t, protocol::kMaxWire> wire{};
  const std::size_t size =
      protocol::encode_frame(frame.header, {body.data(), body.size()}, {wire.data(), wire.size()});
  require(size > 0, "what was decoded can be encoded");
  FrameDecoder again;
  for (std::size_t i = 0; i + 1 < size; ++i)
    require(wire[i] != 0 && again.push(wire[i]) == FrameDecoder::Event::none, "no zero within a frame");
  require(again.push(0) == FrameDecoder::Event::frame, "what was encoded can be decoded");
  require(again.frame().header.seq == frame.header.seq && again.frame().header.kind == frame.header.kind,
          "the header survives");
  require(std::equal(body.begin(), body.end(), again.frame().body.data,
                     again.frame().body.data + again.frame().body.size),
          "the body survives");
}

}  // namespace

void fuzz_frame(const std::uint8_t* data, std::size_t size) {
  FrameDecoder decoder;
  for (std::size_t i = 0; i < size; ++i)
    if (decoder.push(data[i]) == FrameDecoder::Event::frame) expect_round_trip(decoder.frame());
}

}  // namespace symrig::fuzz
