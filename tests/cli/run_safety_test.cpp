// SPDX-License-Identifier: Apache-2.0
// What becomes of the lamp when `symrig run` is stopped or dies: a board in wall-clock time behind a socket.
#include "command.hpp"
#include "symrig/boards/sim_board.hpp"
#include "unit/board/socket_server.hpp"

#include <chrono>
#include <csignal>
#include <mutex>
#include <optional>
#include <thread>

namespace symrig::test::run_safety_test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A board that goes on living when its client goes: it takes the next one. Its time is the wall's, and what
/// the test adds to it.
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
  /// The board's time goes on by so much, now.
  void pass(std::chrono::nanoseconds time) {
    const std::scoped_lock lock(mutex_);
    passed_ += time;
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
        const std::scoped_lock lock(mutex_);
        const std::chrono::nanoseconds now = Clock::now() - begin + passed_;
        board_.advance_to(static_cast<std::uint64_t>(now.count()) / 8);
        if (fd >= 0) board_.write(bytes);
        const auto out = board_.read();
        if (fd >= 0) test::write_all(fd, out);
      } while (fd >= 0 && !stop_);
      if (fd >= 0) close(fd);
    }
  }

  test::Listener listener_;
  std::mutex mutex_;
  board_sim::SimBoard board_;
  std::chrono::nanoseconds passed_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class RunSafety : public CommandTest {
 protected:
  static constexpr int kFaultState = 7;

  RunSafety() : board_((path("b")).string()) {
    write_text(path("lamp.toml"),
               "symrig = 1\n[rig]\nkeep_alive = \"20 s\"\n[rig.lines.lamp_enable]\nrole = \"lamp\"\n"
               "max_on = \"600 s\"\n[program]\nsteps = [{ set = \"lamp_enable\", to = \"on\" },\n"
               "{ hold = \"300 s\" }, { set = \"lamp_enable\", to = \"off\" }, { hold = \"1 ms\" }]\n");
    write_text(path("short.toml"),
               "symrig = 1\n[program]\nsteps = [{ pulse = \"lamp_enable\", width = \"1 ms\" }, { hold = \"1 "
               "ms\" }]\n");
  }

  /// Waits for the lamp; false: it did not come to that within two minutes, which ends a broken test.
  bool lamp_becomes(bool on) {
    const auto deadline = Clock::now() + 120s;
    for (; board_.lamp() != on; std::this_thread::sleep_for(1ms))
      if (Clock::now() > deadline) return false;
    return true;
  }
  static constexpr std::chrono::seconds kKeepAlive{20};  // so long that no busy machine outlasts it
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
  EXPECT_TRUE(board_.lamp()) << "nobody is left who could turn it off but the board";
  board_.pass(kKeepAlive);
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
}  // namespace symrig::test::run_safety_test
