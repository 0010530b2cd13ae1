// SPDX-License-Identifier: Apache-2.0
// The whole daemon in process, on lines in memory, spoken to by the host library over a socket.
#include "daemon.hpp"

#include "assert_ok.hpp"
#include "fake_gpio.hpp"
#include "socket_transport.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"

#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::daemon_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

// No machine stands still for so long.
constexpr hal::Tick kPatience = 60'000 * kMillisecond;
// For what comes, 20 ms a try: ends a broken test, decides nothing.
constexpr int kTries = 3000;

Abilities generous() {
  Measured measured;
  return abilities(measured, 100 * static_cast<std::uint32_t>(kMillisecond), Daemon::kSegments);
}

class DaemonTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("symrigd-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    begin();
  }
  void TearDown() override {
    end();
    fs::remove_all(folder_);
  }
  void begin() {
    BoardFile file = default_board();
    file.state_folder = folder_;
    file.run_folder = folder_;
    file.priority = 0;
    auto socket = SocketTransport::listen_unix(folder_ / "sock");
    ASSERT_OK(socket);
    std::vector<std::unique_ptr<Transport>> transports;
    transports.push_back(std::move(*socket));
    auto gpio = std::make_unique<FakeGpio>();
    gpio_ = gpio.get();
    daemon_ = std::make_unique<Daemon>(
        Daemon::Parts{file, {1, 2, 3, 4}, generous(), std::move(gpio), std::move(transports), kPatience});
    thread_ = std::thread([this] { ended_ = daemon_->run(stop_.fd()); });
  }
  void end() {
    stop_.ring();
    if (thread_.joinable()) thread_.join();
    stop_.quiet();
    daemon_.reset();
  }
  Result<Board> connect() const {
    SYMRIG_TRY(const auto uri, DeviceUri::parse("unix:" + (folder_ / "sock").string()));
    SYMRIG_TRY(auto link, open_link(uri));
    // A loaded machine, and sanitizers: an answer may take a while.
    return Board::connect(std::move(link), {.reply_timeout = 10s, .attempts = 3, .keep_alive = 60s});
  }
  /// The host before may not be gone yet for the daemon.
  Result<Board> connect_patiently() const {
    auto board = connect();
    for (int k = 0; k < kTries && !board; ++k, board = connect()) std::this_thread::sleep_for(20ms);
    return board;
  }

  fs::path folder_;
  Bell stop_;
  FakeGpio* gpio_ = nullptr;
  std::unique_ptr<Daemon> daemon_;
  Result<void> ended_;
  std::thread thread_;
};

TEST_F(DaemonTest, SaysThatItIsBestEffort) {
  const auto board = connect();
  ASSERT_OK(board);
  EXPECT_EQ(board->info().board, "linux");
  EXPECT_EQ(board->info().unique_id, "01020304");
  EXPECT_TRUE(board->info().best_effort());
  EXPECT_EQ(board->info().lateness.count, 100'000'000U);
}

TEST_F(DaemonTest, RefusesWordsThatItCannotKeep) {
  auto board = connect();
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  std::vector<std::uint8_t> bytes(16);
  bytes[3] = 0x10;  // SetWord for 1000 ticks, End
  bytes[4] = 0xE8, bytes[5] = 3;
  bytes[11] = 0x60;
  const auto program = Program::from_bytes(bytes);
  ASSERT_OK(program);
  const auto refused = board->upload(*program);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().line().find("min_dwell"), std::string::npos) << refused.error().line();
}

TEST_F(DaemonTest, RunsAProgramAndSeesItsEdges) {
  auto board = connect();
  ASSERT_OK(board);
  const std::vector<LineConfig> lines{{.line = "camera_trigger", .capture = true}};
  ASSERT_OK(board->configure(lines));
  ProgramBuilder builder(board->info());
  builder.mark(7).set("camera_trigger", true).hold(1s).set("camera_trigger", false).hold(1s);
  const auto program = builder.end();
  ASSERT_OK(program);
  const auto receipt = board->run(*program, 60s);
  ASSERT_OK(receipt);
  if (receipt->end != RunEnd::completed) {
    // The machine stood still for a whole word: then the board tells so, and its outputs are safe.
    ASSERT_TRUE(receipt->fault.has_value());
    EXPECT_EQ(receipt->fault->name, "underrun");
    EXPECT_EQ(receipt->underruns, 1U);
    EXPECT_EQ(gpio_->outputs(), 0U);
    return;
  }
  EXPECT_EQ(receipt->actual.count, 2'000'000'000U) << "durations are of the plan, to the tick";
  EXPECT_EQ(receipt->marks.size(), 1U);
  ASSERT_EQ(receipt->edges.size(), 2U);
  EXPECT_GE(receipt->edges[0].tick.count, receipt->started.count);
  EXPECT_GE(receipt->edges[1].tick.count, receipt->started.count + 1'000'000'000U) << "never early";
}

TEST_F(DaemonTest, AHostThatGoesAwayAmidARunIsAFault) {
  {
    auto board = connect();
    ASSERT_OK(board);
    ASSERT_OK(board->configure({}));
    ProgramBuilder builder(board->info());
    builder.set("aux0", true);
    for (int k = 0; k < 15; ++k) builder.hold(4s);
    const auto program = builder.end();
    ASSERT_OK(program);
    ASSERT_OK(board->upload(*program));
    ASSERT_OK(board->arm());
    ASSERT_OK(board->start());
  }
  auto board = connect_patiently();
  ASSERT_OK(board);
  const auto status = board->status();
  ASSERT_OK(status);
  ASSERT_TRUE(status->fault.has_value());
  EXPECT_EQ(status->fault->name, "link_lost");
  EXPECT_EQ(gpio_->outputs(), 0U);
}

TEST_F(DaemonTest, ASecondHostIsTurnedAway) {
  const auto first = connect();
  ASSERT_OK(first);
  const auto second = connect();
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::device_refused);
}

TEST_F(DaemonTest, StoredSafeLevelsHoldFromTheStartAndAtTheEnd) {
  {
    auto board = connect();
    ASSERT_OK(board);
    const std::vector<LineConfig> lines{{.line = "aux1", .safe_level = true}};
    ASSERT_OK(board->configure(lines));
    EXPECT_EQ(gpio_->outputs(), 0x20U);
    ASSERT_OK(board->store_config("left rig"));
    ASSERT_OK(board->configure({}));
    EXPECT_EQ(gpio_->outputs(), 0U);
  }
  end();
  EXPECT_TRUE(ended_.ok());
  begin();
  auto board = connect();
  ASSERT_OK(board);
  EXPECT_EQ(board->info().label, "left rig");
  EXPECT_EQ(gpio_->outputs(), 0x20U);
}

TEST_F(DaemonTest, StartsAnewWhenAsked) {
  auto board = connect();
  ASSERT_OK(board);
  ASSERT_OK(board->reboot(false));
  for (int k = 0; k < kTries; ++k) {
    const auto status = board->status();
    std::this_thread::sleep_for(20ms);
    if (!status || status->reset_cause == ResetCause::request) break;
  }
  board = Error{ErrorCode::device_lost, "hung up"};
  auto again = connect_patiently();
  ASSERT_OK(again);
  const auto status = again->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->reset_cause, ResetCause::request);
}

TEST_F(DaemonTest, EndsWithANameWhenLinesDoNotObey) {
  auto board = connect();
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  gpio_->break_down();
  [[maybe_unused]] const auto unanswered = board->set_line("aux0", true);
  thread_.join();
  ASSERT_FALSE(ended_);
  EXPECT_EQ(ended_.error().code, ErrorCode::device_lost);
  EXPECT_NE(ended_.error().line().find("GPIO line failed"), std::string::npos) << ended_.error().line();
}

}  // namespace
}  // namespace symrig::board_linux::test::daemon_test
