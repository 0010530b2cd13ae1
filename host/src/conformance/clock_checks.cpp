// SPDX-License-Identifier: Apache-2.0
// The board's clock, as the host reads it.
#include "conformance/board_under_test.hpp"

#include <array>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;

Verdict monotone(BoardUnderTest& board) {
  std::uint64_t last = 0;
  for (int k = 0; k < 100; ++k) {
    const auto answer = board.time();
    if (!answer) return failed("no answer to time_ping");
    SYMRIG_MUST(
        that(last <= answer->rx_tick && answer->rx_tick <= answer->tx_tick, "the clock never goes back"));
    last = answer->tx_tick;
  }
  return {};
}

Verdict echo(BoardUnderTest& board) {
  for (const std::uint64_t number : {std::uint64_t{0}, std::uint64_t{1} << 63U, UINT64_MAX}) {
    symrig_wire_Request request = make_request(symrig_wire_Request_time_ping_tag);
    request.body.time_ping.host_ns = number;
    const auto reply = board.session.ask(request);
    if (!reply || reply->which_body != symrig_wire_Reply_time_tag) return failed("no answer to time_ping");
    SYMRIG_MUST(same("host_ns", number, reply->body.time.host_ns));
  }
  return {};
}

struct Reading {
  Nanoseconds sent, received;
  std::uint64_t tick = 0;
};

bool read(BoardUnderTest& board, Reading& reading) {
  reading.sent = board.session.now();
  const auto answer = board.time();
  reading.received = board.session.now();
  reading.tick = answer ? answer->rx_tick : 0;
  return answer.has_value();
}

/// Compares the tick rate over half a second with the board's capabilities. Allows 500 ppm (two poor
/// crystals) and the uncertainty of the two readings.
Verdict rate(BoardUnderTest& board) {
  Reading first;
  Reading second;
  if (!read(board, first)) return failed("no answer to time_ping");
  board.session.listen_for(500ms);
  if (!read(board, second)) return failed("no answer to time_ping");
  const Nanoseconds shortest = second.sent - first.received;
  const Nanoseconds longest = second.received - first.sent;
  const std::uint64_t low = board.ticks(shortest - shortest / 2000);
  const std::uint64_t high = board.ticks(longest + longest / 2000) + 1;
  return within("ticks in half a second", low, high, second.tick - first.tick);
}

Verdict agrees_with_status(BoardUnderTest& board) {
  const std::uint64_t before = board.now();
  const auto now = board.status();
  const std::uint64_t after = board.now();
  if (!now) return failed("no answer to get_status");
  return within("tick of the status", before, after, now->tick);
}

constexpr std::array<Check, 4> kClockChecks{{
    {"clock.monotone", "the clock never goes back", monotone},
    {"clock.echo", "returns the host's number unchanged", echo},
    {"clock.rate", "runs at its stated rate, within 500 ppm", rate},
    {"clock.agrees_with_status", "time_ping and get_status use the same clock", agrees_with_status},
}};

}  // namespace

std::span<const Check> clock_checks() {
  return kClockChecks;
}

}  // namespace symrig::conformance
