// SPDX-License-Identifier: Apache-2.0
// However symrigd ends, its lines are safe afterwards. If it cannot act itself, --safe does it. Also: only
// one host at a time.
#include "assert_ok.hpp"
#include "daemon_process.hpp"

#include <cstdio>

namespace symrig::bench::board_exits_test {
namespace {

using namespace std::chrono_literals;

class BoardExits : public testing::Test {
 protected:
  /// Brings the outputs to unsafe levels in a run that continues without a host. camera_trigger is high when
  /// safe and low now; lamp_enable is the opposite.
  void stand_unsafe() {
    GpioChip::clear_trace();
    auto board = daemon_.connect();
    ASSERT_OK(board);
    ProgramBuilder builder(board->info());
    builder.set("aux0", true);
    for (int k = 0; k < 10; ++k) builder.hold(4s);
    const auto program = builder.end();
    ASSERT_OK(program);
    const std::vector<LineConfig> lines{{.line = "camera_trigger", .safe_level = true}, {.line = "aux0"}};
    ASSERT_OK(board->configure(lines));
    ASSERT_OK(board->upload(*program));
    ASSERT_OK(board->arm_autonomous());
    ASSERT_OK(board->start());
    ASSERT_OK(board->idle(50ms));
    ASSERT_TRUE(chip_.value("aux0"));
    ASSERT_FALSE(chip_.value("camera_trigger"));
  }
  void expect_safe(const char* when) {
    EXPECT_FALSE(chip_.last_set("aux0")) << when;
    EXPECT_TRUE(chip_.last_set("camera_trigger")) << when;
  }

  GpioChip chip_;
  // Slow real time would give useless measured times. Lateness does not matter here.
  DaemonProcess daemon_{"unix = \"/run/symrig-test/board.sock\"\n[realtime]\nlateness_us = 1000\n"};
};

TEST_F(BoardExits, AskedToEnd) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    stand_unsafe();
    const int status = daemon_.end(signal);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << strsignal(signal);
    expect_safe(strsignal(signal));
    daemon_.start();
  }
}

TEST_F(BoardExits, BreakingDown) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) {
    stand_unsafe();
    const int status = daemon_.end(signal);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << strsignal(signal);
    expect_safe(strsignal(signal));
    daemon_.start();
  }
}

/// SIGKILL cannot be caught. The lines keep their levels until --safe (systemd's ExecStopPost) or the next
/// start.
TEST_F(BoardExits, KilledThenCleanedUp) {
  stand_unsafe();
  daemon_.end(SIGKILL);
  EXPECT_TRUE(chip_.last_set("aux0"));
  EXPECT_EQ(daemon_.once("--safe"), 0);
  expect_safe("after --safe");
  daemon_.start();
  const auto board = daemon_.connect();
  ASSERT_OK(board);
}

TEST_F(BoardExits, TheHostIsTold) {
  auto board = daemon_.connect();
  ASSERT_OK(board);
  daemon_.end(SIGKILL);
  const auto time = board->time();
  ASSERT_FALSE(time);
  EXPECT_EQ(time.error().code, ErrorCode::device_lost);
  std::printf("the host says: %s\n", time.error().line().c_str());
  daemon_.start();
}

TEST_F(BoardExits, ASecondHostIsRefused) {
  auto first = daemon_.connect();
  ASSERT_OK(first);
  const auto second = daemon_.connect();
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::device_refused);
  std::printf("the second host says: %s\n", second.error().line().c_str());
  ASSERT_OK(first->status());
}

TEST_F(BoardExits, ASecondDaemonIsRefused) {
  EXPECT_EQ(daemon_.once("--id"), 0);
  EXPECT_EQ(daemon_.once("--safe"), 3);
  EXPECT_NE(daemon_.log().find("is in use by 'symrigd'"), std::string::npos) << daemon_.log();
}

}  // namespace
}  // namespace symrig::bench::board_exits_test
