// SPDX-License-Identifier: Apache-2.0
// A rig that is a child process, by the command: capture, evaluate, calibrate, and what goes wrong.
#include "command.hpp"

#include <csignal>
#include <fstream>
#include <thread>

namespace symrig::test::exec_rig_test {
namespace {

using ExecRig = CommandTest;

const std::string kExample = std::string("exec:exec ") + SYMRIG_PYTHON + " -B " + SYMRIG_EXEC_EXAMPLE + " 1";

/// A rig of 24x24 cells. Its camera sees each cell with 4x4 pixels.
constexpr const char* kOwnPixels = R"(
import sys
from array import array
read, write = sys.stdin.buffer, sys.stdout.buffer
read.readline()
write.write(b"version=1 cells=24x24 camera=96x96 channels=1\n")
write.flush()
while line := read.readline():
    for number in range(1, int(line.split()[1]) + 1):
        cells = array("f", read.read(4 * 576))
        mean = array("f", [0.5 * cells[i // 384 * 24 + i % 96 // 4] for i in range(9216)])
        variance = array("f", [1e-8] * 9216)
        write.write(b"photograph %d %d\n" % (number, 9 * 9216))
        write.write(mean.tobytes() + variance.tobytes() + bytes([1]) * 9216)
        write.flush()
)";

TEST_F(ExecRig, is_captured_and_evaluated) {
  const Outcome captured = symrig({"capture", "--rig", kExample, "-o", "scene.h5", "--json", "capture.json"});
  ASSERT_EQ(captured.code, 0) << captured.err;
  EXPECT_EQ(captured.err, "");
  const nlohmann::json capture = json("capture.json");
  EXPECT_EQ(capture.at("noise"), "camera");
  EXPECT_EQ(capture.at("grid"), nlohmann::json::array({16, 16}));
  EXPECT_EQ(capture.at("scene"), kExample + " (python-example)");
  EXPECT_EQ(capture.at("frames"), capture.at("patterns"));
  EXPECT_GT(capture.at("rig_seconds").get<double>(), 0);
  EXPECT_EQ(capture.at("trouble").at("photographs_retaken"), 0);
  EXPECT_TRUE(capture.at("noise_check").at("findings").empty()) << capture.at("noise_check");

  const Outcome evaluated = symrig({"evaluate", "scene.h5", "--rig", kExample, "--json", "e.json"});
  ASSERT_EQ(evaluated.code, 0) << evaluated.err;
  EXPECT_EQ(evaluated.err, "");  // the same rig: no warning
  // The noise of a flood-lit pixel is 1 % of it; the tensor averages over many photographs.
  EXPECT_LT(json("e.json").at("error").at("frobenius").get<double>(), 0.02);
}

TEST_F(ExecRig, is_calibrated) {
  ASSERT_EQ(symrig({"calibrate", "--rig", kExample, "-o", "map.exr", "--json", "map.json"}).code, 0);
  EXPECT_EQ(json("map.json").at("camera_grid"), nlohmann::json::array({16, 16}));
  ASSERT_EQ(symrig({"calibrate", "--rig", kExample, "--levels", "levels.toml", "--json", "levels.json"}).code,
            0);
  EXPECT_NEAR(json("levels.json").at("gamma_at_half").get<double>(), 1, 0.02);
}

TEST_F(ExecRig, a_camera_with_its_own_pixels_is_registered) {
  write_text(path("rig.py"), kOwnPixels);
  const std::string rig = std::string("exec:exec ") + SYMRIG_PYTHON + " -B rig.py";
  expect_refusal({"capture", "--rig", rig, "-o", "scene.h5"}, kBadInput,
                 {"24x24", "96x96", "symrig calibrate"});
  const Outcome calibrated = symrig({"calibrate", "--rig", rig, "-o", "registration.h5", "--json", "r.json"});
  ASSERT_EQ(calibrated.code, 0) << calibrated.err;
  EXPECT_NEAR(json("r.json").at("pixels_per_cell").get<double>(), 4, 0.02);
  const Outcome captured = symrig({"capture", "--rig", rig, "--registration", "registration.h5", "-o",
                                   "scene.h5", "--max-patterns", "30"});
  EXPECT_EQ(captured.code, 0) << captured.err;
}

TEST_F(ExecRig, a_capture_goes_on_with_the_same_command_only) {
  ASSERT_EQ(
      symrig({"capture", "--rig", kExample, "-o", "scene.h5", "--keep-log", "--max-patterns", "12"}).code, 0);
  expect_refusal({"capture", "--rig", kExample + "2", "-o", "scene.h5", "--resume"}, kBadInput, {"exec:"});
  const Outcome resumed =
      symrig({"capture", "--rig", kExample, "-o", "scene.h5", "--resume", "--json", "c.json"});
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_NE(resumed.out.find("came from the log"), std::string::npos) << resumed.out;
}

TEST_F(ExecRig, what_fails_is_one_line_with_an_exit_code) {
  constexpr int kDevice = 3;
  const auto refused = [this](const std::string& command, int code, const std::vector<std::string>& words) {
    for (const char* job : {"capture", "calibrate"}) {
      const std::string output = std::string(job) == "capture" ? "scene.h5" : "map.exr";
      expect_refusal({job, "--rig", "exec:" + command, "-o", output}, code, words);
    }
  };
  refused("", kUsage, {"exec:", "no command"});
  refused("no-such-command 2>/dev/null", kBadInput, {"no such command"});
  refused("exit 6", kDevice, {"status 6"});
  refused("echo hello", kDevice, {"'hello'", "docs/howto-own-rig.md"});
  refused("head -c 100000 /dev/urandom", kDevice, {"version=1"});
  refused("echo version=1 cells=2x2 channels=1000", kFault, {"channels=1000"});
  refused("echo version=1 cells=2x2 channels=1; read a; read b; echo photograph 1 36; echo short", kDevice,
          {"status 0", "photograph 1 of 1"});
  refused("echo version=1 cells=2x2 channels=1; read a; read b; echo photograph 1 35", kDevice,
          {"35 bytes", "36"});
}

TEST_F(ExecRig, the_childs_messages_pass_through) {
  const Outcome outcome =
      symrig({"capture", "--rig", "exec:echo the lamp is cold >&2; exit 6", "-o", "scene.h5"});
  EXPECT_TRUE(outcome.err.starts_with("the lamp is cold\nsymrig capture: exec:")) << outcome.err;
}

// The child ignores what it can. Ctrl-C ends symrig and the child all the same.
TEST_F(ExecRig, a_wait_ends_with_ctrl_c) {
  const std::string child =
      "trap '' INT TERM HUP; echo $$ >number.new; mv number.new number; while :; do sleep 600; done";
  Running running(path("."), {"capture", "--rig", "exec:" + child, "-o", "scene.h5"});
  while (!std::filesystem::exists(path("number"))) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  running.signal(SIGINT);
  const Outcome outcome = running.wait();
  EXPECT_EQ(outcome.code, kFault) << outcome.err;
  EXPECT_NE(outcome.err.find("stopped"), std::string::npos) << outcome.err;
  EXPECT_EQ(files(), std::set<std::string>{"number"});
  EXPECT_EQ(kill(std::stoi(read_text(path("number"))), 0), -1);
}

using RigFileCommand = CommandTest;

constexpr const char* kSensor =
    "[camera]\nbits = 12\nfull_well = 20000\nread_noise = 6\npedestal = 64\n[projector]\n";

TEST_F(RigFileCommand, a_file_that_is_not_there_is_bad_input) {
  const Outcome outcome = symrig({"capture", "--rig", "rig.toml", "-o", "scene.h5"});
  EXPECT_EQ(outcome.code, 4);
  EXPECT_EQ(outcome.err, "symrig capture: there is no rig file rig.toml; check the path\n");
  EXPECT_EQ(symrig({"capture", "--rig", "gummy", "-o", "scene.h5"}).code, 2);
}

TEST_F(RigFileCommand, a_mistake_in_it_is_named_with_its_line) {
  std::ofstream(path("rig.toml")) << "symrig = 1\n[board]\nurl = \"usb:\"\n" << kSensor;
  for (const char* command : {"capture", "calibrate"}) {
    const std::string output = std::string(command) == "capture" ? "scene.h5" : "out.exr";
    const Outcome outcome = symrig({command, "--rig", "rig.toml", "-o", output});
    EXPECT_EQ(outcome.code, 4) << command;
    EXPECT_NE(outcome.err.find("rig.toml:3: there is no key board.url; did you mean 'uri'?"),
              std::string::npos)
        << outcome.err;
  }
  EXPECT_EQ(files(), std::set<std::string>{"rig.toml"});
}

TEST_F(RigFileCommand, a_board_that_is_not_there_is_a_device_error) {
  std::ofstream(path("rig.toml")) << "symrig = 1\n[board]\nuri = \"unix:no-board.sock\"\n" << kSensor;
  const Outcome outcome = symrig({"capture", "--rig", "rig.toml", "-o", "scene.h5"});
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_NE(outcome.err.find("no-board.sock"), std::string::npos) << outcome.err;
  EXPECT_EQ(files(), std::set<std::string>{"rig.toml"});
}

TEST_F(RigFileCommand, trouble_is_told_and_a_missing_rig_named) {
  ASSERT_EQ(symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--json", "capture.json"}).code, 0);
  const nlohmann::json trouble = json("capture.json").at("trouble");
  EXPECT_EQ(trouble.at("photographs_retaken"), 0);
  EXPECT_EQ(trouble.at("frames").at("missing"), 0);
  EXPECT_GT(trouble.at("frames").at("certain").get<std::int64_t>(), 0);
  const Outcome outcome = symrig({"evaluate", "scene.h5", "--rig", "nothing.toml"});
  EXPECT_EQ(outcome.code, 4) << outcome.err;
}

}  // namespace
}  // namespace symrig::test::exec_rig_test
