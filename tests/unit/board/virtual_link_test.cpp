// SPDX-License-Identifier: Apache-2.0
#include "bench.hpp"
#include "servers.hpp"
#include "symrig/board/self_test.hpp"
#include "symrig/board/virtual_bench.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::virtual_link_test {
namespace {

using namespace std::chrono_literals;
using namespace test;

/// A server in a thread and the uri that leads to it.
struct Served {
  explicit Served(std::uint32_t version = 1)
      : server(version),
        thread([this] { return listener.accept(); },
               [this](int fd, const std::atomic<bool>& stop) { server.serve(fd, stop); }) {}
  DeviceUri uri() const { return {.transport = Transport::virtual_unix, .place = (scratch / "v").string()}; }

  Scratch scratch;
  Listener listener = Listener::local(scratch / "v");
  VirtualServer server;
  ServerThread thread;
};

TEST(VirtualLink, a_whole_run_in_virtual_time) {
  const Served served;
  const auto bench = VirtualBench::connect(served.uri());
  ASSERT_OK(bench);
  EXPECT_EQ(bench->name(), "sim-virtual");
  EXPECT_EQ(bench->tick_hz(), 125'000'000U);
  Board board = Bench::connect(bench->link());
  ASSERT_OK(board.configure({}));
  ProgramBuilder builder(board.info());
  const auto program = builder.loop(600).pulse("camera_trigger", 1ms).hold(1s).end_loop().end();
  ASSERT_OK(program);
  ASSERT_OK(bench->edges());
  const auto receipt = board.run(*program, 700s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  EXPECT_EQ(receipt->duration(), 600 * 1001ms);
  const auto edges = bench->edges();
  ASSERT_OK(edges);
  ASSERT_EQ(edges->size(), 1200U);
  for (std::size_t k = 0; k < edges->size(); ++k) {
    const auto [cycle, gpio, level] = (*edges)[k];
    EXPECT_EQ(gpio, board.info().line("camera_trigger"));
    EXPECT_EQ(level, k % 2 == 0);
    EXPECT_EQ(cycle - receipt->started.count, k / 2 * 125'125'000 + k % 2 * 125'000);
  }
}

TEST(VirtualLink, open_link_leads_to_it) {
  const Served served;
  auto link = open_link(served.uri());
  ASSERT_OK(link);
  const Board board = Bench::connect(std::move(link).value());
  EXPECT_EQ(board.info().board, "sim");
}

TEST(VirtualLink, a_uri_brings_a_jumper_along) {
  const Served served;
  DeviceUri uri = served.uri();
  uri.jumper_from = "1";
  uri.jumper_to = "3";
  auto link = open_link(uri);
  ASSERT_OK(link);
  Board board = Bench::connect(std::move(link).value());
  const auto test = self_test(board, {.pings = 1, .jumper = Jumper{"camera_trigger", "vsync"}});
  ASSERT_OK(test);
  EXPECT_TRUE(test->passed());
}

TEST(VirtualLink, time_passes_only_while_the_link_waits) {
  const Served served;
  const auto bench = VirtualBench::connect(served.uri());
  ASSERT_OK(bench);
  const auto link = bench->link();
  EXPECT_EQ(link->now(), 0ns);
  const auto bytes = link->receive(1s);
  ASSERT_OK(bytes);
  EXPECT_TRUE(bytes->empty());
  EXPECT_EQ(link->now(), 1s);
  EXPECT_EQ(*bench->now(), 1s);
  const auto later = bench->link();  // a link's clock begins when it is opened
  EXPECT_EQ(later->now(), 0ns);
}

TEST(VirtualLink, pins_are_driven_and_pulsed) {
  const Served served;
  const auto bench = VirtualBench::connect(served.uri());
  ASSERT_OK(bench);
  const auto link = bench->link();
  ASSERT_OK(bench->drive(3, true));
  ASSERT_OK(bench->let_go(3));
  ASSERT_OK(link->receive(1ms));
  ASSERT_OK(bench->pulse(4, 10ms, 1ms));
  ASSERT_OK(link->receive(20ms));
  ASSERT_OK(bench->pulse(4, 0ns, 0ns));
  ASSERT_OK(link->receive(20ms));
  const auto edges = bench->edges();
  ASSERT_OK(edges);
  const std::vector<PinEdge> expected{{0, 3, true},         {125'000, 4, true},    {250'000, 4, false},
                                      {1'375'000, 4, true}, {1'500'000, 4, false}, {2'625'000, 4, true}};
  EXPECT_EQ(*edges, expected);
}

TEST(VirtualLink, a_jumper_carries_an_output_to_an_input) {
  const Served served;
  const auto bench = VirtualBench::connect(served.uri());
  ASSERT_OK(bench);
  Board board = Bench::connect(bench->link());
  const std::vector<LineConfig> lines{{.line = "vsync", .capture = true}};
  ASSERT_OK(board.configure(lines));
  ASSERT_OK(bench->jumper(1, 3));
  const auto program = ProgramBuilder(board.info()).pulse("camera_trigger", 10us).hold(10us).end();
  ASSERT_OK(program);
  const auto receipt = board.run(*program, 1s);
  ASSERT_OK(receipt);
  ASSERT_EQ(receipt->edges.size(), 2U);
  EXPECT_EQ((receipt->edges[1].tick - receipt->edges[0].tick).count, 1250U);
  ASSERT_OK(bench->remove_jumpers());
  const auto again = board.run(*program, 1s);
  ASSERT_OK(again);
  EXPECT_EQ(again->edges.size(), 0U);
}

TEST(VirtualLink, power_cycles_and_cables) {
  const Served served;
  const auto bench = VirtualBench::connect(served.uri());
  ASSERT_OK(bench);
  Board board = Bench::connect(bench->link());
  ASSERT_OK(bench->cable(false));
  ASSERT_OK(bench->cable(true));
  ASSERT_OK(bench->power_cycle());
  const auto status = board.status();  // the board knows nothing of the session any more
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::device_lost);
}

TEST(VirtualLink, another_version_is_refused) {
  const Served served(2);
  const auto bench = VirtualBench::connect(served.uri());
  ASSERT_FALSE(bench.ok());
  EXPECT_EQ(bench.error().code, ErrorCode::protocol);
  EXPECT_NE(bench.error().what.find("version 2"), std::string::npos);
}

TEST(VirtualLink, a_real_cable_is_no_bench) {
  const auto bench = VirtualBench::connect({.transport = Transport::tcp, .place = "localhost", .port = 1});
  ASSERT_FALSE(bench.ok());
  EXPECT_EQ(bench.error().code, ErrorCode::bad_argument);
}

/// A server that answers every request with the same bytes, then closes.
Error error_after(const std::vector<std::uint8_t>& answer) {
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "v");
  ServerThread server([&] { return listener.accept(); },
                      [&](int fd, const std::atomic<bool>&) {
                        std::vector<std::uint8_t> bytes;
                        while (read_some(fd, bytes) && bytes.empty()) {
                        }
                        write_all(fd, answer);
                      });
  const auto bench =
      VirtualBench::connect({.transport = Transport::virtual_unix, .place = (scratch / "v").string()});
  EXPECT_FALSE(bench.ok());
  return bench.ok() ? Error{ErrorCode::fault, "no error"} : bench.error();
}

TEST(VirtualLink, answers_that_make_no_sense) {
  EXPECT_EQ(error_after({'h', 4, 0, 0, 0, 1, 0, 0, 0}).code, ErrorCode::protocol);  // too short
  EXPECT_EQ(error_after({'w', 0, 0, 0, 0}).code, ErrorCode::protocol);              // another's
  EXPECT_EQ(error_after({'h', 255, 255, 255, 255}).code, ErrorCode::protocol);      // too long
  EXPECT_EQ(error_after({'h', 12, 0}).code, ErrorCode::device_lost);                // cut off
  EXPECT_EQ(error_after({}).code, ErrorCode::device_lost);                          // nothing
  const Error refused = error_after({'x', 2, 0, 0, 0, 'n', 'o'});
  EXPECT_EQ(refused.code, ErrorCode::device_lost);
  EXPECT_NE(refused.what.find(": no"), std::string::npos) << refused.line();
}

}  // namespace
}  // namespace symrig::virtual_link_test
