// SPDX-License-Identifier: Apache-2.0
// What becomes of the lamp when `symrig run` is stopped or dies: a board in wall-clock time behind a socket.
#include "command.hpp"
#include "symrig/boards/sim_board.hpp"
#include "unit/board/socket_server.hpp"

#include <chrono>
#include <csignal>
#include <mutex>
#include <optional>

namespace symrig::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A board that goes on living when its client goes: it takes the next one.
class LastingBoard {
 public:
  explicit LastingBoard(const std::string& socket)
      : listener_(test::Listener::local(socket)), thread_([this] { live(); }) {}
  LastingBoard(const LastingBoard&) = delete;
  LastingBoard& operator=(const LastingBoard&) = delete;
  ~LastingBoard() {
    stop_ = true;
    thread_.join();
  }

  bool lamp() {
    const std::scoped_lock lock(mutex_);
    return ((board_.levels() >> 2U) & 1U) != 0;
  }
  int state() {
    const std::scoped_lock lock(mutex_);
    return board_.supervisor_state();
  }

 private:
  void live() {
    const auto begin = Clock::now();
    std::vector<std::uint8_t> bytes;
    while (!stop_) {
      const int fd = listener_.accept_within(5ms);
      do {
        if (fd >= 0 && !test::read_some(fd, bytes)) break;
        const auto passed = std::chrono::nanoseconds(Clock::now() - begin).count();
        const std::scoped_lock lock(mutex_);
        board_.advance_to(static_cast<std::uint64_t>(passed) / 8);
        if (fd >= 0) board_.write(bytes);
        const auto out = board_.read();
        if (fd >= 0) test::write_all(fd, out);
      } while (fd >= 0 && !stop_);
      if (fd >= 0) close(fd);
    }
  }

  test::Listener listener_;
  std::mutex mutex_;
  boards::SimBoard board_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class RunSafety : public CommandTest {
 protected:
  static constexpr int kFaultState = 7;

  RunSafety() : board_((path("b")).string()) {
    write_text(path("lamp.toml"),
               "symrig = 1\n[rig]\nkeep_alive = \"300 ms\"\n[rig.lines.lamp_enable]\nrole = \"lamp\"\n"
               "max_on = \"60 s\"\n[program]\nsteps = [\n"
               "{ pulse = \"lamp_enable\", width = \"30 s\" }, { hold = \"1 ms\" }]\n");
    write_text(path("short.toml"),
               "symrig = 1\n[program]\nsteps = [{ pulse = \"lamp_enable\", width = \"1 ms\" }, { hold = \"1 "
               "ms\" }]\n");
  }

  /// Waits for the lamp; false: it did not come to that within ten seconds.
  bool lamp_becomes(bool on) {
    const auto deadline = Clock::now() + 10s;
    while (board_.lamp() != on)
      if (Clock::now() > deadline) return false;
    return true;
  }
  std::vector<std::string> run(const std::string& file) const {
    return {"run", file, "--device", "unix:" + path("b").string(), "-o", "receipt.json"};
  }

  LastingBoard board_;
};

TEST_F(RunSafety, ctrl_c_turns_the_lamp_off_and_leaves_the_receipt) {
  Running running(path(""), run("lamp.toml"));
  ASSERT_TRUE(lamp_becomes(true));
  running.signal(SIGINT);
  const Outcome outcome = running.wait();
  EXPECT_FALSE(board_.lamp());
  EXPECT_EQ(outcome.code, kFault) << outcome.err;
  EXPECT_EQ(json("receipt.json")["end"], "aborted");
  EXPECT_EQ(symrig(run("short.toml")).code, 0);
}

// The board's keep-alive does what the host cannot any more; the fault stays until somebody clears it.
TEST_F(RunSafety, a_killed_command_leaves_the_lamp_to_the_keep_alive) {
  Running running(path(""), run("lamp.toml"));
  ASSERT_TRUE(lamp_becomes(true));
  running.signal(SIGKILL);
  running.wait();
  EXPECT_TRUE(lamp_becomes(false));
  EXPECT_EQ(board_.state(), kFaultState);
  const Outcome refused = symrig(run("short.toml"));
  EXPECT_EQ(refused.code, kFault);
  EXPECT_NE(refused.err.find("latched the fault keep_alive"), std::string::npos) << refused.err;
  auto cleared = run("short.toml");
  cleared.emplace_back("--clear-fault");
  const Outcome outcome = symrig(cleared);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
}

}  // namespace
}  // namespace symrig::test
