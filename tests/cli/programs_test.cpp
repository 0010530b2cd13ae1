// SPDX-License-Identifier: Apache-2.0
// symrig lint, compile, run and trace, as a person or a script meets them.
#include "command.hpp"
#include "symrig/boards/sim_board.hpp"
#include "unit/board/servers.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <thread>

namespace symrig::test::programs_test {
namespace {

class Programs : public CommandTest {
 protected:
  static constexpr int kDevice = 3;

  void write(const std::string& name, const std::string& text) const { write_text(path(name), text); }
  void write_scan() const {
    write("scan.toml", "symrig = 1\n[program]\npatterns = 8\nbracket = [\"1 ms\", \"4 ms\"]\n");
  }
};

TEST_F(Programs, lint_lists_findings_with_file_line_rule_and_fix) {
  write("scan.toml", "symrig = 1\n[program]\npatterns = 8\nbracket = [\"1 ms\", \"4 ms\"]\ngap = \"1 ms\"\n");
  const Outcome lint = symrig({"lint", "scan.toml", "--json", "lint.json"});
  EXPECT_EQ(lint.code, kBadInput);
  EXPECT_NE(lint.out.find("scan.toml:5: error: camera.readout: 1 ms from an exposure to the next trigger"),
            std::string::npos)
      << lint.out;
  EXPECT_NE(lint.out.find("; gap = \"4 ms\"\n"), std::string::npos) << lint.out;
  EXPECT_NE(lint.err.find("symrig lint: scan.toml: 1 error;"), std::string::npos) << lint.err;
  const auto findings = json("lint.json");
  EXPECT_EQ(findings["ok"], false);
  EXPECT_EQ(findings["findings"].back()["rule"], "camera.readout");
  EXPECT_EQ(findings["findings"].back()["line"], 5);
  EXPECT_EQ(findings["findings"].back()["alternative"], "gap = \"4 ms\"");
}

TEST_F(Programs, lint_explains_its_rules) {
  const Outcome list = symrig({"lint", "--explain"});
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_NE(list.out.find("\ncamera.readout            error    a trigger comes"), std::string::npos)
      << list.out;
  EXPECT_NE(list.out.find("\nmax_on "), std::string::npos) << list.out;
  const Outcome rule = symrig({"lint", "--explain", "camera.readout"});
  EXPECT_EQ(rule.code, 0) << rule.err;
  for (const char* part :
       {"camera.readout: error: ", "This breaks it:\n\n  symrig = 1\n", "  gap = \"4 ms\"\n"})
    EXPECT_NE(rule.out.find(part), std::string::npos) << rule.out;
  expect_refusal({"lint", "--explain", "camera.readuot"}, kUsage, {"did you mean 'camera.readout'?"});
  expect_refusal({"lint", "--explain", ""}, kUsage, {"--explain is empty"});
  expect_refusal({"lint", "scan.toml", "--explain", "camera.readout"}, kUsage,
                 {"--explain reads no program"});
  expect_refusal({"lint", "--explain", "--json", "a.json"}, kUsage, {"--json has no effect with --explain"});
  expect_refusal({"lint"}, kUsage, {"file is required"});
}

TEST_F(Programs, lint_of_a_good_program_ends_well) {
  write_scan();
  const Outcome lint = symrig({"lint", "scan.toml"});
  EXPECT_EQ(lint.code, 0);
  EXPECT_EQ(lint.err, "");
  EXPECT_NE(lint.out.find("scan.toml: no errors for board 'sim'"), std::string::npos) << lint.out;
  EXPECT_EQ(files(), std::set<std::string>{"scan.toml"});
}

TEST_F(Programs, a_board_can_be_described_by_a_file) {
  write_scan();
  ASSERT_EQ(symrig({"info", "--device", "sim:", "--json", "board.json"}).code, 0);
  EXPECT_EQ(symrig({"lint", "scan.toml", "--board", "board.json"}).code, 0);
  write("other.json", "{\"board\": 3}");
  expect_refusal({"lint", "scan.toml", "--board", "other.json"}, kBadInput,
                 {"other.json", "does not describe a board"});
  expect_refusal({"lint", "scan.toml", "--board", "none.json"}, kBadInput, {"none.json"});
}

TEST_F(Programs, files_that_are_none_are_refused_with_their_line) {
  write("scan.toml", "symrig = 1\n[program]\npatern = 8\n");
  for (const std::string command : {"lint", "run", "trace"})
    expect_refusal({command, "scan.toml"}, kBadInput,
                   {"scan.toml:3:", "program.patern; did you mean 'patterns'?"});
  expect_refusal({"compile", "scan.toml", "-o", "scan.symprog"}, kBadInput, {"scan.toml:3:"});
  expect_refusal({"lint", "nowhere.toml"}, kBadInput, {"nowhere.toml"});
  expect_refusal({"run", "nowhere.toml"}, kBadInput, {"nowhere.toml"});
}

TEST_F(Programs, what_does_not_compile_leaves_no_file) {
  write("scan.toml", "symrig = 1\n[program]\npatterns = 8\nbracket = [\"1 us\", \"2 us\"]\n");
  expect_refusal({"compile", "scan.toml", "-o", "scan.symprog", "--json", "c.json"}, kBadInput,
                 {"scan.toml:4:", "camera.min_exposure", "and 1 more: symrig lint scan.toml"});
  expect_refusal({"run", "scan.toml", "--device", "sim:", "-o", "receipt.json"}, kBadInput,
                 {"camera.min_exposure"});
}

TEST_F(Programs, compile_run_and_trace_agree) {
  write_scan();
  const Outcome compiled = symrig({"compile", "scan.toml", "-o", "scan.symprog", "--json", "compile.json"});
  ASSERT_EQ(compiled.code, 0) << compiled.err;
  const auto told = json("compile.json");
  EXPECT_EQ(told["patterns"], 8);
  EXPECT_EQ(told["exposures"], 16);
  EXPECT_LT(told["records"], 100);

  const Outcome run =
      symrig({"run", "scan.symprog", "--device", "sim:", "-o", "receipt.json", "--vcd", "run.vcd"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");  // quiet in a pipe
  EXPECT_NE(run.out.find("16 frames for 16 exposures"), std::string::npos) << run.out;
  const auto receipt = json("receipt.json");
  EXPECT_EQ(receipt["end"], "completed");
  EXPECT_EQ(receipt["hashes"]["program"], told["program_hash"]);
  EXPECT_EQ(receipt["hashes"]["config"], told["config_hash"]);
  EXPECT_EQ(receipt["differences"]["exact"], true);
  EXPECT_NEAR(receipt["time"]["duration_ns"].get<double>(), 1e9 * told["seconds"]["expected"].get<double>(),
              1.7e7);

  // The TOML file makes the same records.
  ASSERT_EQ(symrig({"run", "scan.toml", "--device", "sim:", "-o", "again.json"}).code, 0);
  EXPECT_EQ(json("again.json")["hashes"]["program"], told["program_hash"]);

  const Outcome trace = symrig({"trace", "receipt.json", "--vcd", "trace.vcd", "--wavedrom", "wave.json",
                                "--differences", "edges.csv"});
  ASSERT_EQ(trace.code, 0) << trace.err;
  EXPECT_NE(trace.out.find("48 edges paired: largest difference 0 ns"), std::string::npos) << trace.out;
  EXPECT_EQ(json("wave.json")["signal"].size(), 3U);
  const std::string csv = read_text(path("edges.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 49);
  const std::string vcd = read_text(path("trace.vcd"));
  EXPECT_NE(vcd.find("$scope module plan $end"), std::string::npos);
  EXPECT_NE(vcd.find("$scope module actual $end"), std::string::npos);
}

TEST_F(Programs, trace_draws_plans_without_a_board) {
  write_scan();
  const Outcome plan = symrig({"trace", "scan.toml", "--vcd", "-"});
  EXPECT_EQ(plan.code, 0);
  EXPECT_EQ(plan.out.rfind("$version symrig $end\n", 0), 0U);
  EXPECT_EQ(plan.out.find("actual"), std::string::npos);
  expect_refusal({"trace", "scan.toml", "--actual", "--vcd", "x.vcd"}, kUsage,
                 {"not a receipt", "symrig run"});
  write("other.json", R"({"format": "other"})");
  expect_refusal({"trace", "other.json", "--vcd", "x.vcd"}, kBadInput, {"other.json", "not the receipt"});
}

TEST_F(Programs, a_wait_that_runs_out_leaves_its_receipt) {
  write("wait.toml",
        "symrig = 1\n[program]\nsteps = [{ hold = \"1 ms\" }, { wait = \"camera_strobe\", timeout = \"5 ms\" "
        "}]\n");
  const Outcome run = symrig({"run", "wait.toml", "--device", "sim:", "-o", "receipt.json"});
  EXPECT_EQ(run.code, kDevice);
  EXPECT_NE(run.err.find("an awaited edge did not come in time, 6 ms after the start"), std::string::npos)
      << run.err;
  EXPECT_EQ(json("receipt.json")["end"], "wait_timeout");
}

// Hours of virtual time: the signal comes long before the end.
TEST_F(Programs, interrupts_end_safe_with_a_receipt) {
  for (const int signal : {SIGINT, SIGTERM}) {
    write("long.toml", "symrig = 1\n[program]\npatterns = 1000000\nbracket = [\"1 ms\"]\n");
    Running run(path(""), {"run", "long.toml", "--device", "sim:", "-o", "receipt.json"});
    ASSERT_TRUE(run.works(signal, 0.2));
    run.signal(signal);
    const Outcome outcome = run.wait();
    EXPECT_EQ(outcome.code, kFault) << outcome.err;
    EXPECT_NE(outcome.err.find("outputs are at their safe levels"), std::string::npos) << outcome.err;
    const auto receipt = json("receipt.json");
    EXPECT_EQ(receipt["end"], "aborted");
    EXPECT_EQ(receipt["interrupted"], true);
    EXPECT_EQ(receipt["differences"]["largest_ns"], 0);
    std::filesystem::remove(path("receipt.json"));
  }
}

// What becomes of the lamp when `symrig run` is stopped or dies: a board in wall-clock time behind a socket.

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
}  // namespace symrig::test::programs_test
