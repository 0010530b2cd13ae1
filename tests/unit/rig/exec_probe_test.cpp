// SPDX-License-Identifier: Apache-2.0
// Rigs that are child processes: the framing, and each way to break it.
#include "symrig/rig/exec_probe.hpp"

#include "assert_ok.hpp"
#include "scratch.hpp"
#include "symrig/base/time.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

namespace symrig::exec_probe_test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kAnswer = "version=1 cells=3x4 channels=2 name=tiny";

/// The command of exec_child.py.
std::string child(const std::string& fault = "none", const std::string& argument = "",
                  const std::string& answer = kAnswer) {
  return fmt::format("exec {} -B {} '{}' {} {}", SYMRIG_PYTHON, SYMRIG_EXEC_CHILD, answer, fault, argument);
}

std::unique_ptr<ExecProbe> open(const std::string& command, ExecOptions options = {}) {
  auto probe = ExecProbe::open(command, std::move(options));
  if (probe) return *std::move(probe);
  ADD_FAILURE() << probe.error().line();
  return nullptr;
}

void expect_line(const Error& error, ErrorCode code, const std::vector<std::string>& words) {
  EXPECT_EQ(error.code, code) << error.line();
  EXPECT_FALSE(error.hint.empty()) << error.line();
  EXPECT_EQ(error.line().find('\n'), std::string::npos) << error.line();
  for (const std::string& word : words)
    EXPECT_NE(error.line().find(word), std::string::npos) << word << " in: " << error.line();
}

void expect_not_opened(const std::string& command, ErrorCode code, const std::vector<std::string>& words,
                       ExecOptions options = {}) {
  const auto probe = ExecProbe::open(command, std::move(options));
  ASSERT_FALSE(probe.ok()) << command;
  expect_line(probe.error(), code, words);
}

std::vector<Pattern> patterns_on(Grid grid, int count) {
  std::vector<Pattern> patterns(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < patterns.size(); ++i) patterns[i] = probe_laws::law_pattern(grid, i);
  return patterns;
}

/// Opens, measures two patterns, and expects this error, now and from then on.
void expect_broken(const std::string& command, ErrorCode code, const std::vector<std::string>& words,
                   ExecOptions options = {}) {
  const auto probe = open(command, std::move(options));
  ASSERT_NE(probe, nullptr);
  const auto patterns = patterns_on(probe->grid(), 2);
  const auto first = probe->measure(patterns);
  ASSERT_FALSE(first.ok()) << command;
  expect_line(first.error(), code, words);
  const auto again = probe->measure(patterns);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().line(), first.error().line());
  EXPECT_EQ(probe->cost().photographs, 0);
}

void expect_twice_the_pattern(const std::vector<Pattern>& patterns,
                              const std::vector<Radiance>& photographs) {
  ASSERT_EQ(photographs.size(), patterns.size());
  for (std::size_t k = 0; k < patterns.size(); ++k)
    for (int c = 0; c < photographs[k].mean.channels(); ++c)
      for (std::size_t i = 0; i < patterns[k].values().size(); ++i)
        ASSERT_EQ(photographs[k].mean.plane(c)[i], 2 * patterns[k].values()[i]) << k << ", " << i;
}

/// The process has ended. Whoever is its parent may not have waited for it yet.
bool has_ended(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string line;
  std::getline(file, line);
  return line.empty() || line.substr(line.rfind(')')).starts_with(") Z");
}

TEST(ExecProbe, photographs_arrive_as_sent) {
  const auto probe = open(child());
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->grid(), (Grid{3, 4}));
  EXPECT_EQ(probe->camera_grid(), (Grid{3, 4}));
  EXPECT_EQ(probe->channels(), 2);
  const auto patterns = patterns_on(probe->grid(), 2 * kExecBatch + 3);  // three batches
  const auto photographs = probe->measure(patterns);
  ASSERT_OK(photographs);
  expect_twice_the_pattern(patterns, *photographs);
  EXPECT_EQ(probe->cost().photographs, static_cast<std::int64_t>(patterns.size()));
  EXPECT_EQ(probe->cost().frames, static_cast<std::int64_t>(patterns.size()));
  EXPECT_EQ(probe->cost().simulate_seconds, 0);
}

TEST(ExecProbe, describes_itself_on_one_line) {
  const auto probe = open(child("none", "\ntrue"));
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->describe(), "exec:" + child("none", " true") + " (tiny)");
  EXPECT_EQ(probe->identity(), probe->describe());
}

TEST(ExecProbe, a_camera_may_have_pixels_of_its_own) {
  const auto probe = open(child("none", "", "version=1 cells=3x4 camera=5x7 channels=1"));
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->grid(), (Grid{3, 4}));
  EXPECT_EQ(probe->camera_grid(), (Grid{5, 7}));
  expect_probe_laws(*probe);
}

TEST(ExecProbe, views_are_as_stated) {
  const auto views_of = [](const std::string& words) {
    const auto probe = open(child("none", "", "version=1 cells=3x4 channels=1" + words));
    return probe == nullptr ? ViewLayout{0, 0} : probe->views();
  };
  EXPECT_EQ(views_of(" views=2x3"), (ViewLayout{2, 3}));
  EXPECT_EQ(views_of(" views=3x4"), (ViewLayout{3, 4}));  // a pixel each
  EXPECT_EQ(views_of(" views=1x1"), ViewLayout{});
  EXPECT_EQ(views_of(""), ViewLayout{});                             // a child that knows no views
  EXPECT_EQ(views_of(" camera=2x2 views=3x1"), (ViewLayout{3, 1}));  // they tile the cells
}

TEST(ExecProbe, keeps_the_laws) {
  expect_probe_laws(*open(child()));
}

TEST(ExecProbe, the_example_keeps_the_laws) {
  const auto probe = open(std::string("exec ") + SYMRIG_PYTHON + " -B " + SYMRIG_EXEC_EXAMPLE + " 1");
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->grid(), (Grid{16, 16}));
  expect_probe_laws(*probe);
}

TEST(ExecProbe, time_passes_on_the_wall) {
  const auto probe = open(child("slow", "0.02"));
  ASSERT_NE(probe, nullptr);
  const Stopwatch watch;
  ASSERT_OK(probe->measure(patterns_on(probe->grid(), 3)));
  EXPECT_GE(probe->cost().rig_seconds, 0.06);
  EXPECT_LE(probe->cost().rig_seconds, watch.seconds());
}

// A pattern of 512 KiB and a photograph of 1.1 MiB are larger than a pipe, which holds 64 KiB or 1 MiB.
TEST(ExecProbe, full_pipes_are_no_deadlock) {
  const std::string answer = "version=1 cells=256x512 channels=1";
  for (const char* order : {"none", "whole", "early"}) {
    const auto probe = open(child(order, "", answer));
    ASSERT_NE(probe, nullptr);
    const auto patterns = patterns_on(probe->grid(), 3);
    const auto photographs = probe->measure(patterns);
    ASSERT_OK(photographs);
    if (std::string(order) != "early") expect_twice_the_pattern(patterns, *photographs);
    ASSERT_OK(probe->measure(patterns));
  }
}

TEST(ExecProbe, an_invalid_value_may_hold_anything) {
  const auto probe = open(child("invalid"));
  ASSERT_NE(probe, nullptr);
  const auto photographs = probe->measure(patterns_on(probe->grid(), 1));
  ASSERT_OK(photographs);
  EXPECT_EQ(photographs->front().valid.values()[0], 0);
  EXPECT_EQ(photographs->front().mean.values()[0], 0.F);
  EXPECT_EQ(photographs->front().variance.values()[0], 0.F);
  EXPECT_EQ(photographs->front().valid.values()[1], 1);
}

TEST(ExecProbe, a_command_that_cannot_run_is_named) {
  expect_not_opened("", ErrorCode::bad_argument, {"exec:", "no command"});
  expect_not_opened(" \n", ErrorCode::bad_argument, {"no command"});
  expect_not_opened("symrig-no-such-command 2>/dev/null", ErrorCode::not_found,
                    {"exec:symrig-no-such-command", "no such command"});
  expect_not_opened("/dev/null 2>/dev/null", ErrorCode::not_found, {"cannot run"});
}

TEST(ExecProbe, a_child_that_ends_before_its_answer_is_told_with_its_status) {
  expect_not_opened("exit 3", ErrorCode::device_lost, {"status 3", "greeting"});
  expect_not_opened("true", ErrorCode::device_lost, {"status 0"});
  expect_not_opened("kill -9 $$", ErrorCode::device_lost, {"signal 9"});
  expect_not_opened("printf 'version=1 cells=3x4'", ErrorCode::device_lost, {"status 0", "greeting"});
}

TEST(ExecProbe, an_answer_that_is_none_is_refused) {
  const auto answers = [](const std::string& text, ErrorCode code, const std::vector<std::string>& words) {
    expect_not_opened("printf '" + text + "\\n'; cat >/dev/null", code, words);
  };
  constexpr auto kWrong = ErrorCode::protocol;
  answers("hello", kWrong, {"'hello'", "version=1", "docs/howto-own-rig.md"});
  answers("", kWrong, {"''"});
  answers("< M A T L A B >", kWrong, {"M A T L A B"});
  answers("version=2 cells=3x4 channels=1", kWrong, {"version=2", "version 1"});
  answers("version= cells=3x4 channels=1", kWrong, {"'version='"});
  answers("version=1 channels=1", kWrong, {"cells"});
  answers("version=1 cells=3x4", kWrong, {"channels"});
  answers("version=1 cells=3by4 channels=1", kWrong, {"cells=3by4"});
  answers("version=1 cells=0x4 channels=1", kWrong, {"cells=0x4"});
  answers("version=1 cells=-3x4 channels=1", kWrong, {"cells=-3x4"});
  answers("version=1 cells=3x4 channels=0", kWrong, {"channels=0"});
  answers("version=1 cells=3x4 channels=1 channels=2", kWrong, {"channels twice"});
  answers("version=1 cells=3x4 channel=1", kWrong, {"'channel'", "did you mean 'channels'"});
  answers("version=1 cells=3x4 channels=1 quick", kWrong, {"'quick'", "key=value"});
  answers("version=1 cells=3x4 channels=1 name=a\\033b", kWrong, {"\\x1b"});
  answers("version=1 cells=3x4 channels=1 patience=0", kWrong, {"patience=0"});
  for (const char* views : {"0x1", "1x0", "-1x1", "2", "2x", "x2", "2x2x2", "2.5x1", "2by2", "two"})
    answers(fmt::format("version=1 cells=3x4 channels=1 views={}", views), kWrong,
            {fmt::format("views={}", views), "ROWSxCOLUMNS"});
  for (const char* views : {"4x1", "1x5", "99999999999999999999x1"})
    answers(fmt::format("version=1 views={} cells=3x4 channels=1", views), kWrong, {"views=", "cells=3x4"});
  answers("version=1 cells=3x4 channels=1 views=", kWrong, {"'views='"});
  answers("version=1 cells=3x4 channels=1 views=1x2 views=1x2", kWrong, {"views twice"});
  answers("version=1 cells=3x4 channels=65", ErrorCode::limit, {"channels=65", "64"});
  answers("version=1 cells=99999x99999 channels=1", ErrorCode::limit, {"99999x99999"});
  answers("version=1 cells=99999999999999999999x1 channels=1", ErrorCode::limit, {"cells="});
  answers("version=1 cells=3x4 camera=32768x32767 channels=1", ErrorCode::limit, {"bytes", "1073741824"});
  expect_not_opened("printf 'version=1 '; yes aaaaaaaa | tr -d '\\n'", kWrong, {"version=1 aaaaaaaa"});
}

TEST(ExecProbe, blanks_and_a_carriage_return_do_no_harm) {
  const auto probe = open("printf 'version=1  channels=1 cells=2x2  \\r\\n'; cat >/dev/null");
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->grid(), (Grid{2, 2}));
}

TEST(ExecProbe, a_child_that_ends_during_a_batch_is_told) {
  expect_broken(child("exit", "7"), ErrorCode::device_lost, {"status 7", "photograph 1 of 2"});
  expect_broken(child("exit", "0"), ErrorCode::device_lost, {"status 0", "photograph 1 of 2"});
  expect_broken(child("killed"), ErrorCode::device_lost, {"signal 9", "photograph 1 of 2"});
  expect_broken(child("deaf", "", "version=1 cells=300x300 channels=1"), ErrorCode::device_lost,
                {"closed its input"});  // a pipe does not hold these patterns
  expect_broken(child("closed"), ErrorCode::device_lost, {"closed its output", "photograph 1 of 2"});
}

// "photograph 1 216\n" has 17 bytes, and 3 x 4 x 2 values are 216 bytes.
TEST(ExecProbe, a_truncated_record_is_told) {
  for (const char* bytes : {"0", "1", "11", "16", "17", "18", "112", "232"})
    expect_broken(child("truncated", bytes), ErrorCode::device_lost, {"status 4", "photograph 1 of 2"});
}

TEST(ExecProbe, a_record_of_another_size_or_number_is_refused) {
  expect_broken(child("size", "1"), ErrorCode::protocol, {"217 bytes", "216"});
  expect_broken(child("number", "1"), ErrorCode::protocol, {"photograph 2 instead of 1"});
  expect_broken(child("chatter"), ErrorCode::protocol, {"done!", "'photograph 2 216'"});
}

TEST(ExecProbe, chatter_after_the_last_photograph_is_refused) {
  const auto probe = open(child("chatter"));
  ASSERT_NE(probe, nullptr);
  const auto one = patterns_on(probe->grid(), 1);
  auto measured = probe->measure(one);
  if (measured) measured = probe->measure(one);  // it may come late
  ASSERT_FALSE(measured.ok());
  expect_line(measured.error(), ErrorCode::protocol, {"done!"});
}

TEST(ExecProbe, a_value_that_no_photograph_has_is_refused) {
  const std::string place = "at row 2, column 3, channel 1";
  for (const char* value : {"nan", "inf", "-inf"}) {
    expect_broken(child("mean", value), ErrorCode::protocol, {"the mean", value, place});
    expect_broken(child("variance", value), ErrorCode::protocol, {"the variance", value, place});
  }
  expect_broken(child("variance", "-0.5"), ErrorCode::protocol, {"the variance -0.5", place});
  expect_broken(child("valid", "2"), ErrorCode::protocol, {"valid 2", place});
}

TEST(ExecProbe, random_bytes_are_refused) {
  for (const char* bytes : {"1", "100", "100000"}) {
    const auto probe = open(child("random", bytes));
    ASSERT_NE(probe, nullptr);
    const auto measured = probe->measure(patterns_on(probe->grid(), 2));
    ASSERT_FALSE(measured.ok());
    const Error& error = measured.error();  // one byte may begin as a header does
    EXPECT_TRUE(error.code == ErrorCode::protocol || error.code == ErrorCode::device_lost) << error.line();
  }
}

// The child reads all and answers nothing, so no byte moves once it has. Any positive patience must end this.
TEST(ExecProbe, a_child_that_never_answers_ends_the_patience) {
  expect_not_opened("sleep 600", ErrorCode::timeout, {"0.05 s", "greeting", "patience=SECONDS"},
                    {.patience = 50ms, .grace = 0ms});
  expect_broken(child("hangs", "", std::string(kAnswer) + " patience=1"), ErrorCode::timeout,
                {"1 s", "photograph 1 of 2"});
}

TEST(ExecProbe, a_wait_can_be_stopped) {
  int asked = 0;
  expect_not_opened("sleep 600", ErrorCode::interrupted, {"stopped", "greeting"},
                    {.keep_waiting = [&asked] { return ++asked < 3; }});
  EXPECT_EQ(asked, 3);
}

TEST(ExecProbe, nothing_of_the_child_is_left) {
  const test::Scratch scratch;
  const std::string file = (scratch / "group").string();
  auto probe = open(child("leaves", file));
  ASSERT_NE(probe, nullptr);
  pid_t leader = 0, other = 0;
  std::ifstream(file) >> leader >> other;
  ASSERT_GT(leader, 1);
  ASSERT_GT(other, 1);
  ASSERT_FALSE(has_ended(leader));
  ASSERT_FALSE(has_ended(other));
  probe.reset();
  EXPECT_EQ(::kill(leader, 0), -1) << "a zombie";
  while (!has_ended(other)) std::this_thread::sleep_for(1ms);  // the signal is on its way
}

TEST(ExecProbe, a_child_that_does_not_end_is_killed) {
  const auto probe =
      open("trap '' TERM; printf 'version=1 cells=2x2 channels=1\\n'; while :; do sleep 600; done",
           {.grace = 0ms});
  EXPECT_NE(probe, nullptr);  // the destructor returns
}

TEST(ExecProbe, a_broken_pipe_sends_no_signal) {
  ASSERT_EQ(std::signal(SIGPIPE, SIG_DFL), SIG_DFL);
  const auto probe = open("read greeting; printf 'version=1 cells=300x300 channels=1\\n'; exec <&-; exit 5");
  ASSERT_NE(probe, nullptr);
  const auto measured = probe->measure(patterns_on(probe->grid(), 2));
  ASSERT_FALSE(measured.ok());
  expect_line(measured.error(), ErrorCode::device_lost, {"status 5"});
}

TEST(ExecProbe, patterns_that_it_may_not_show_do_not_break_it) {
  const auto probe = open(child());
  ASSERT_NE(probe, nullptr);
  probe_laws::expect_refusals(*probe);
  ASSERT_OK(probe->measure(patterns_on(probe->grid(), 1)));
}

}  // namespace
}  // namespace symrig::exec_probe_test
