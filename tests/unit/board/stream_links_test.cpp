// SPDX-License-Identifier: Apache-2.0
#include "bench.hpp"

#include <csignal>
#include <cstdint>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/file.h>
#include <termios.h>

namespace symrig::stream_links_test {
namespace {

using namespace std::chrono_literals;
using namespace test;

// Real time is at work here: a busy machine may delay an answer beyond the usual 100 ms.
constexpr BoardOptions kPatient{.reply_timeout = 20s, .attempts = 3};

/// A pseudo-terminal: its far end, and the path of the near one.
struct Pty {
  Pty() : far(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_EQ(grantpt(far), 0);
    EXPECT_EQ(unlockpt(far), 0);
    path = ptsname(far);
  }
  int far;
  std::string path;
};

std::unique_ptr<Link> open_or_fail(const std::string& uri) {
  const auto parsed = DeviceUri::parse(uri);
  EXPECT_TRUE(parsed.ok());
  auto link = open_link(*parsed);
  EXPECT_TRUE(link.ok()) << (link.ok() ? "" : link.error().line());
  return link.ok() ? std::move(link).value() : nullptr;
}

Error refusal(const std::string& uri) {
  const auto parsed = DeviceUri::parse(uri);
  EXPECT_TRUE(parsed.ok());
  const auto link = open_link(*parsed);
  EXPECT_FALSE(link.ok()) << uri;
  return link.ok() ? Error{ErrorCode::fault, "it opened"} : link.error();
}

/// A session that needs both directions and big frames: capabilities, a configuration, a program of 100
/// chunks.
void expect_a_board(const std::string& uri) {
  auto link = open_or_fail(uri);
  ASSERT_NE(link, nullptr);
  auto board = Board::connect(std::move(link), kPatient);
  ASSERT_OK(board);
  EXPECT_EQ(board->info().board, "sim");
  ASSERT_OK(board->configure({}));
  ProgramBuilder builder(board->info());
  for (int k = 0; k < 3000; ++k) builder.pulse("camera_trigger", 100ns).hold(100ns);
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_OK(board->upload(*program));
  const auto status = board->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->program_hash, program->hash());
}

TEST(StreamLinks, a_board_behind_a_local_socket) {
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "board");
  ServerThread server([&] { return listener.accept(); }, serve_board);
  expect_a_board("unix:" + (scratch / "board").string());
}

TEST(StreamLinks, a_board_behind_a_tcp_port) {
  const Listener listener = Listener::tcp();
  ServerThread server([&] { return listener.accept(); }, serve_board);
  expect_a_board("tcp:127.0.0.1:" + std::to_string(listener.port()));
}

TEST(StreamLinks, a_board_on_a_serial_port) {
  const Pty pty;
  ServerThread server([&] { return pty.far; }, serve_board);
  expect_a_board("serial:" + pty.path + "?baud=921600");
}

/// An Arduino's boot loader: deaf while the chip starts, then it leaves after a second without a byte.
void boot_then_serve(int fd, const std::atomic<bool>& stop) {
  std::vector<std::uint8_t> bytes;
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(read_some(fd, bytes));
  for (auto heard = std::chrono::steady_clock::now();
       !stop && std::chrono::steady_clock::now() < heard + 1s;) {
    EXPECT_TRUE(read_some(fd, bytes));
    if (!bytes.empty()) heard = std::chrono::steady_clock::now();
  }
  serve_board(fd, stop);
}

TEST(StreamLinks, a_board_that_its_opened_port_restarts) {
  const Pty pty;
  ServerThread server([&] { return pty.far; }, boot_then_serve);
  auto link = open_or_fail("serial:" + pty.path);
  ASSERT_NE(link, nullptr);
  const auto board = Board::connect(std::move(link), {.reply_timeout = 200ms, .attempts = 20});
  ASSERT_OK(board);
  EXPECT_EQ(board->info().board, "sim");
}

TEST(StreamLinks, a_serial_port_passes_every_byte_and_echoes_none) {
  const Pty pty;
  const auto link = open_or_fail("serial:" + pty.path);
  ASSERT_NE(link, nullptr);
  std::vector<std::uint8_t> all(256);
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  ASSERT_OK(link->send(all));
  std::vector<std::uint8_t> arrived(512);
  std::size_t count = 0;
  while (count < all.size()) {
    const ssize_t more = read(pty.far, arrived.data() + count, arrived.size() - count);
    ASSERT_GT(more, 0);
    count += static_cast<std::size_t>(more);
  }
  arrived.resize(count);
  EXPECT_EQ(arrived, all);
  write_all(pty.far, all);
  std::vector<std::uint8_t> back;
  while (back.size() < all.size()) {
    const auto bytes = link->receive(5s);
    ASSERT_OK(bytes);
    ASSERT_FALSE(bytes->empty());
    back.insert(back.end(), bytes->begin(), bytes->end());
  }
  EXPECT_EQ(back, all);
  close(pty.far);
}

TEST(StreamLinks, a_serial_port_that_hangs_up_is_a_lost_board) {
  const Pty pty;
  const auto link = open_or_fail("serial:" + pty.path);
  ASSERT_NE(link, nullptr);
  close(pty.far);
  const auto bytes = link->receive(5s);
  ASSERT_FALSE(bytes.ok());
  EXPECT_EQ(bytes.error().code, ErrorCode::device_lost);
  const std::vector<std::uint8_t> one{1};
  const auto sent = link->send(one);
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::device_lost);
}

TEST(StreamLinks, a_serial_port_belongs_to_one_program) {
  const Pty pty;
  const auto link = open_or_fail("serial:" + pty.path);
  const Error error = refusal("serial:" + pty.path);
  EXPECT_EQ(error.code, ErrorCode::device_lost);
  EXPECT_NE(error.hint.find("other program"), std::string::npos) << error.line();
  close(pty.far);
}

TEST(StreamLinks, what_cannot_be_opened_says_why) {
  const Scratch scratch;
  EXPECT_NE(refusal("serial:" + (scratch / "none").string()).what.find("No such file"), std::string::npos);
  EXPECT_NE(refusal("unix:" + (scratch / "none").string()).what.find("No such file"), std::string::npos);
  EXPECT_EQ(refusal("serial:/dev/null").code, ErrorCode::bad_argument);
  EXPECT_NE(refusal("serial:/dev/null").what.find("not a serial port"), std::string::npos);
  EXPECT_EQ(refusal("unix:/" + std::string(200, 'x')).code, ErrorCode::bad_argument);
  const Error rate = refusal("serial:/dev/null?baud=100000");
  EXPECT_EQ(rate.code, ErrorCode::bad_argument);
  EXPECT_NE(rate.hint.find("115200"), std::string::npos) << rate.line();
  std::uint16_t closed = 0;
  {
    const Listener listener = Listener::tcp();
    closed = listener.port();
  }
  const Error refused = refusal("tcp:127.0.0.1:" + std::to_string(closed));
  EXPECT_EQ(refused.code, ErrorCode::device_lost);
  EXPECT_NE(refused.what.find("Connection refused"), std::string::npos) << refused.line();
}

TEST(StreamLinks, silence_is_empty_and_takes_its_time) {
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "s");
  const auto link = open_or_fail("unix:" + (scratch / "s").string());
  ASSERT_NE(link, nullptr);
  const Nanoseconds before = link->now();
  const auto bytes = link->receive(20ms);
  ASSERT_OK(bytes);
  EXPECT_TRUE(bytes->empty());
  EXPECT_GE(link->now() - before, 20ms);
}

TEST(StreamLinks, a_closed_connection_is_told_after_its_last_bytes) {
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "s");
  const auto link = open_or_fail("unix:" + (scratch / "s").string());
  ASSERT_NE(link, nullptr);
  const int far = listener.accept();
  const std::vector<std::uint8_t> last{7, 8, 9};
  write_all(far, last);
  close(far);
  const auto bytes = link->receive(5s);
  ASSERT_OK(bytes);
  EXPECT_EQ(*bytes, last);
  const auto end = link->receive(5s);
  ASSERT_FALSE(end.ok());
  EXPECT_EQ(end.error().code, ErrorCode::device_lost);
  // A write to a socket without a reader must be an error, not the signal that ends a process.
  const auto sent = link->send(last);
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::device_lost);
}

/// More bytes than any socket buffer holds, so that the system takes them in pieces.
TEST(StreamLinks, a_slow_reader_gets_every_byte_in_order) {
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "s");
  std::vector<std::uint8_t> sent(4'000'000), arrived;
  for (std::size_t k = 0; k < sent.size(); ++k) sent[k] = static_cast<std::uint8_t>((k * 2654435761U) >> 13U);
  {
    ServerThread server([&] { return listener.accept(); },
                        [&](int fd, const std::atomic<bool>&) {
                          std::vector<std::uint8_t> bytes;
                          while (read_some(fd, bytes))
                            arrived.insert(arrived.end(), bytes.begin(), bytes.end());
                        });
    const auto link = open_or_fail("unix:" + (scratch / "s").string());
    ASSERT_NE(link, nullptr);
    ASSERT_OK(link->send(sent));
  }
  EXPECT_EQ(arrived, sent);
}

TEST(StreamLinks, a_reader_that_stands_still_is_a_lost_board) {
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "s");
  const auto link = open_or_fail("unix:" + (scratch / "s").string());
  ASSERT_NE(link, nullptr);
  const auto sent = link->send(std::vector<std::uint8_t>(4'000'000));
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::device_lost);
  EXPECT_NE(sent.error().what.find("accepted no bytes"), std::string::npos);
}

/// Signals that interrupt the system call neither end a wait early nor lose bytes.
TEST(StreamLinks, signals_do_not_disturb) {
  struct sigaction quiet {};
  quiet.sa_handler = [](int) {};
  struct sigaction before {};
  ASSERT_EQ(sigaction(SIGUSR1, &quiet, &before), 0);
  const Scratch scratch;
  const Listener listener = Listener::local(scratch / "s");
  const auto link = open_or_fail("unix:" + (scratch / "s").string());
  ASSERT_NE(link, nullptr);
  const int far = listener.accept();
  const pthread_t self = pthread_self();
  std::thread pest([&] {
    for (int k = 0; k < 20; ++k) {
      std::this_thread::sleep_for(1ms);
      pthread_kill(self, SIGUSR1);
    }
    write_all(far, std::vector<std::uint8_t>{42});
  });
  const auto bytes = link->receive(30s);
  pest.join();
  sigaction(SIGUSR1, &before, nullptr);
  close(far);
  ASSERT_OK(bytes);
  EXPECT_EQ(*bytes, std::vector<std::uint8_t>{42});
}

}  // namespace
}  // namespace symrig::stream_links_test
