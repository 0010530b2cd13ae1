// SPDX-License-Identifier: Apache-2.0
// symrigd with a TCP socket and with a serial line (a pair of pseudo-terminals) behaves as with any other
// link.
#include "assert_ok.hpp"
#include "daemon_process.hpp"
#include "symrig/board/program.hpp"

#include <array>
#include <atomic>
#include <cstdio>

#include <poll.h>
#include <termios.h>

namespace symrig::bench::board_links_test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kTcp = "127.0.0.1:7700";
// Lateness does not matter here.
constexpr const char* kLateness = "[realtime]\nlateness_us = 1000\n";

Result<Board> connect(const std::string& uri_text) {
  SYMRIG_TRY(const auto uri, DeviceUri::parse(uri_text));
  SYMRIG_TRY(auto link, open_link(uri));
  return Board::connect(std::move(link));
}

/// Uploads a program of many frames, checks that the board holds it unchanged, and that it runs as planned.
void expect_a_board(Board& board) {
  ProgramBuilder builder(board.info());
  constexpr int kPulses = 200;
  for (int k = 0; k < kPulses; ++k)
    builder.set("camera_trigger", true).hold(5ms).set("camera_trigger", false).hold(5ms);
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_OK(board.configure({}));
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.verify_program());
  const auto receipt = board.run(*program, 60s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  EXPECT_EQ(receipt->actual.count, board.info().rate.ticks(kPulses * 10ms).count);
}

TEST(BoardLinks, TcpServesOneHostAfterAnother) {
  const DaemonProcess daemon(std::string("tcp = \"") + kTcp + "\"\n" + kLateness);
  for (int host = 0; host < 3; ++host) {
    auto board = connect(std::string("tcp:") + kTcp);
    ASSERT_OK(board);
    expect_a_board(*board);
    const auto second = connect(std::string("tcp:") + kTcp);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::device_refused) << second.error().line();
  }
}

/// The master of a pseudo-terminal. Its slave behaves like a serial port.
class Terminal {
 public:
  Terminal() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    EXPECT_GE(master_, 0);
    EXPECT_EQ(::grantpt(master_), 0);
    EXPECT_EQ(::unlockpt(master_), 0);
    std::array<char, 64> name{};
    EXPECT_EQ(::ptsname_r(master_, name.data(), name.size()), 0);
    path_ = name.data();
    // Keeps the slave open, else the master reads errors until another process opens it.
    slave_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY);
    EXPECT_GE(slave_, 0);
    termios settings{};
    EXPECT_EQ(::tcgetattr(slave_, &settings), 0);
    ::cfmakeraw(&settings);
    EXPECT_EQ(::tcsetattr(slave_, TCSANOW, &settings), 0);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() {
    ::close(slave_);
    ::close(master_);
  }
  int master() const { return master_; }
  const std::string& path() const { return path_; }

 private:
  int master_;
  int slave_ = -1;
  std::string path_;
};

/// A null-modem cable: copies bytes between its two ends.
class Cable {
 public:
  ~Cable() {
    pulled_ = true;
    carrier_.join();
  }
  const std::string& board_end() const { return board_.path(); }
  const std::string& host_end() const { return host_.path(); }

 private:
  void carry() {
    std::array<pollfd, 2> ends{{{board_.master(), POLLIN, 0}, {host_.master(), POLLIN, 0}}};
    while (!pulled_) {
      if (::poll(ends.data(), ends.size(), 10) <= 0) continue;
      copy(board_.master(), host_.master());
      copy(host_.master(), board_.master());
    }
  }
  static void copy(int from, int to) {
    std::array<char, 1024> piece{};
    const ssize_t got = ::read(from, piece.data(), piece.size());
    for (ssize_t sent = 0; sent < got;) {
      const ssize_t more = ::write(to, piece.data() + sent, static_cast<std::size_t>(got - sent));
      if (more > 0) sent += more;
    }
  }

  Terminal board_;
  Terminal host_;
  std::atomic<bool> pulled_ = false;
  std::thread carrier_{[this] { carry(); }};
};

TEST(BoardLinks, ASerialLineIsALinkLikeOthers) {
  const Cable cable;
  const DaemonProcess daemon("serial = \"" + cable.board_end() + "\"\nbaud = 921600\n" + kLateness);
  for (int host = 0; host < 2; ++host) {
    auto board = connect("serial:" + cable.host_end() + "?baud=921600");
    ASSERT_OK(board);
    expect_a_board(*board);
  }
}

/// A serial port does not show that its host has gone. The keep-alive makes the lines safe.
TEST(BoardLinks, ASerialHostThatFallsSilentLeavesTheLinesSafe) {
  const Cable cable;
  const DaemonProcess daemon("serial = \"" + cable.board_end() + "\"\n" + kLateness);
  {
    auto board = connect("serial:" + cable.host_end());
    ASSERT_OK(board);
    const std::vector<LineConfig> lines{{.line = "lamp_enable"}};
    ASSERT_OK(board->configure(lines));
    ASSERT_OK(board->keep_alive(200ms));
    ASSERT_OK(board->set_line("lamp_enable", true));
  }
  std::this_thread::sleep_for(1s);
  auto board = connect("serial:" + cable.host_end());
  ASSERT_OK(board);
  const auto status = board->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->state, BoardState::fault);
  ASSERT_OK(board->clear_fault());
}

}  // namespace
}  // namespace symrig::bench::board_links_test
