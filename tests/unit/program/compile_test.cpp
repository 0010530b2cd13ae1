// SPDX-License-Identifier: Apache-2.0
// The compiler against a slow oracle: random programs by hand, timed in real numbers.
#include "symrig/base/statistics.hpp"
#include "symrig/program/timeline.hpp"
#include "workshop.hpp"

#include <cmath>
#include <map>

namespace symrig::compile_test {
namespace {

using namespace std::chrono_literals;

/// An edge as asked for: when, in nanoseconds, and after how many durations since the beginning.
struct AskedEdge {
  double time;
  bool level;
  std::size_t durations;
};
using AskedEdges = std::map<std::string, std::vector<AskedEdge>>;

/// Walks the steps as a person reads them.
class Oracle {
 public:
  explicit Oracle(const RigSetup& rig) : rig_(rig) {}

  void walk(const std::vector<FileStep>& steps) {
    for (const FileStep& step : steps) walk(step);
  }
  const AskedEdges& edges() const { return edges_; }
  double now() const { return now_; }
  std::size_t durations() const { return durations_; }

 private:
  void walk(const FileStep& step) {
    switch (step.kind) {
      case FileStep::Kind::set:
        return set(step.line, step.on);
      case FileStep::Kind::hold:
        return pass(step.time);
      case FileStep::Kind::pulse:
        set(step.line, true);
        pass(step.time);
        return set(step.line, false);
      case FileStep::Kind::loop:
        for (std::uint64_t k = 0; k < step.count; ++k) walk(step.steps);
        return;
      default:
        return;
    }
  }
  void pass(Nanoseconds time) {
    now_ += static_cast<double>(time.count());
    ++durations_;
  }
  void set(const std::string& line, bool on) {
    const RigLine* rig_line = rig_.find(line);
    const bool level = on != rig_line->active_low;
    if (!levels_.contains(line)) levels_[line] = rig_line->active_low;
    if (levels_[line] == level) return;
    levels_[line] = level;
    edges_[line].push_back({now_ + static_cast<double>(rig_line->delay.count()), level, durations_ + 1});
  }

  const RigSetup& rig_;
  AskedEdges edges_;
  std::map<std::string, bool> levels_;
  double now_ = 0;
  std::size_t durations_ = 0;
};

class RandomProgram {
 public:
  explicit RandomProgram(std::uint64_t seed) : random_(seed) {}

  ProgramFile file() {
    ProgramFile file = test::parse("symrig = 1\n[program]\nsteps = [{ hold = \"1 us\" }]\n");
    file.rig.lines.clear();
    for (const char* name : kLines) {
      RigLine line;
      line.config.line = name;
      line.active_low = below(2) == 0;
      line.config.safe_level = line.active_low;
      // None, or longer than the board's shortest word: an edge that a stretch begins with is delayed so far.
      line.delay = Nanoseconds(below(4) == 0 ? 0 : static_cast<std::int64_t>(50 + below(650)));
      line.place = 1;
      file.rig.lines.push_back(line);
    }
    file.steps = body(3);
    return file;
  }

 private:
  static constexpr std::array<const char*, 3> kLines{"projector_trigger", "camera_trigger", "lamp_enable"};

  std::uint64_t below(std::uint64_t bound) { return random_.bits() % bound; }

  /// Times apart by more than a microsecond: no two edges of different lines come closer than 1 us - 0.7 us
  /// of delay, which leaves every word above the board's 40 ns.
  Nanoseconds time() { return Nanoseconds(static_cast<std::int64_t>(1500 + below(3'000'000))); }

  std::vector<FileStep> body(int depth) {
    std::vector<FileStep> steps;
    const std::uint64_t count = 1 + below(5);
    for (std::uint64_t k = 0; k < count; ++k) add(steps, depth);
    // Ends as it began, with all edges out.
    for (const char* line : kLines) {
      steps.push_back(off(line));
      steps.push_back(hold());
    }
    return steps;
  }

  static FileStep off(const char* line) {
    FileStep step;
    step.kind = FileStep::Kind::set;
    step.line = line;
    step.place = 1;
    return step;
  }

  FileStep hold() {
    FileStep step;
    step.kind = FileStep::Kind::hold;
    step.time = time();
    step.place = 1;
    return step;
  }

  void add(std::vector<FileStep>& steps, int depth) {
    FileStep step = hold();
    const std::uint64_t kind = below(depth > 0 ? 4 : 3);
    step.line = kLines[below(kLines.size())];
    step.on = below(2) == 0;
    if (kind == 1) step.kind = FileStep::Kind::set;
    if (kind == 2) step.kind = FileStep::Kind::pulse;
    if (kind == 3) {
      all_off(steps);
      step.kind = FileStep::Kind::loop;
      step.count = 1 + below(4);
      step.steps = body(depth - 1);
    }
    steps.push_back(step);
    if (kind != 3) steps.push_back(hold());
  }

  void all_off(std::vector<FileStep>& steps) {
    for (const char* line : kLines) {
      steps.push_back(off(line));
      steps.push_back(hold());
    }
  }

  Random random_;
};

// Every duration is rounded to the nearest tick, so after n of them (a delay is one more) an edge is off by
// at most n half ticks.
TEST(Compile, edges_are_those_asked_for_within_half_a_tick_a_duration) {
  const BoardInfo board = test::board();
  const double half_tick = 0.5e9 / static_cast<double>(board.rate.hz);
  std::size_t edges = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const ProgramFile file = RandomProgram(seed).file();
    const Compilation out = compile_program(file, board);
    ASSERT_TRUE(out.ok()) << seed << ": "
                          << (out.findings.empty() ? "" : out.findings.front().text("random"));
    Oracle oracle(file.rig);
    oracle.walk(file.steps);
    TimelineOptions options;
    for (const RigLine& line : file.rig.lines)
      if (line.active_low)
        options.initial_levels |= 1U << static_cast<unsigned>(board.line(line.config.line));
    const auto timeline = expand(out.program->program, board, options);
    ASSERT_TRUE(timeline.ok());
    ASSERT_TRUE(timeline->complete);
    std::map<std::string, std::vector<PlannedEdge>> planned;
    for (const PlannedEdge& edge : timeline->edges) planned[board.lines[edge.line].name].push_back(edge);
    for (const auto& [line, asked] : oracle.edges()) {
      ASSERT_EQ(planned[line].size(), asked.size()) << "seed " << seed << ", " << line;
      for (std::size_t k = 0; k < asked.size(); ++k) {
        const double time = static_cast<double>(planned[line][k].tick.count) * 2 * half_tick;
        EXPECT_LE(std::abs(time - asked[k].time), half_tick * static_cast<double>(asked[k].durations) + 1e-6)
            << "seed " << seed << ", " << line << " edge " << k;
        EXPECT_EQ(planned[line][k].level, asked[k].level);
        ++edges;
      }
    }
    EXPECT_LE(std::abs(static_cast<double>(timeline->end.count) * 2 * half_tick - oracle.now()),
              half_tick * static_cast<double>(oracle.durations()));
  }
  EXPECT_GT(edges, 10'000U);
}

TEST(Compile, tells_durations_and_counts) {
  const auto program = test::compiled(
      "symrig = 1\n[program]\npatterns = 8\nrepeat = 3\nbracket = [\"1 ms\", \"3 ms\"]\nsettle = \"2 ms\"\n");
  EXPECT_EQ(program.patterns, 24U);
  EXPECT_EQ(program.exposures, 48U);
  EXPECT_TRUE(program.is_scan);
  // A photograph: 100 us + 5 ticks, wait, latency of 1 us, 2 ms, 1 + 4 + 3 + 4 ms.
  EXPECT_EQ(program.shortest, 24 * (100us + 40ns + 1us + 2ms + 12ms));
  EXPECT_EQ(program.longest - program.shortest, 24 * 50ms);
  // 14.1 ms of work fit one refresh of 16.67 ms; the first is waited for from the start on.
  EXPECT_NEAR(seconds(program.expected), 24 * 0.016'666'667 + 0.014, 1e-4);
}

TEST(Compile, a_triggered_projector_is_told_how_long_to_show_each_pattern) {
  const auto program = test::compiled(
      "symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[program]\npatterns = 4\nbracket = [\"1 ms\", \"2 "
      "ms\"]\n");
  // 10 us settle, 1 ms, 4 ms readout, 2 ms, and 105 us of black.
  EXPECT_EQ(program.on_time, 7115us);
  EXPECT_EQ(program.expected, program.shortest);
}

TEST(Compile, lines_in_use_are_captured_and_the_rest_not) {
  const auto program = test::compiled(
      "symrig = 1\n[rig.lines.lamp_enable]\nmax_on = \"1 s\"\n[rig.lines.projector_trigger]\ncapture = "
      "false\n"
      "[program]\npatterns = 1\nbracket = [\"1 ms\"]\n");
  std::map<std::string, bool> captured;
  for (const LineConfig& line : program.lines) captured[line.line] = line.capture;
  EXPECT_EQ(captured, (std::map<std::string, bool>{{"camera_strobe", true},
                                                   {"camera_trigger", true},
                                                   {"lamp_enable", false},
                                                   {"projector_trigger", false},
                                                   {"vsync", true}}));
}

/// The pulses of the camera's trigger.
std::vector<std::pair<Ticks, Ticks>> camera_pulses(const CompiledProgram& program) {
  const BoardInfo board = test::board();
  TimelineOptions options;
  options.edge_at = [](const PlannedWait& wait) -> std::optional<Ticks> { return wait.begin + Ticks{1000}; };
  const auto timeline = expand(program.program, board, options);
  EXPECT_TRUE(timeline.ok());
  if (!timeline) return {};
  std::vector<std::pair<Ticks, Ticks>> pulses;
  for (const PlannedEdge& edge : timeline->edges) {
    if (edge.line != board.line("camera_trigger")) continue;
    if (edge.level) pulses.emplace_back(edge.tick, Ticks{0});
    if (!edge.level) pulses.back().second = edge.tick;
  }
  return pulses;
}

// The camera is ready as soon as an exposure ends. Without a time between them, two pulses would be one.
TEST(Compile, pulses_of_two_exposures_are_two) {
  constexpr const char* kReady =
      "symrig = 1\n[rig.camera]\nreadout = \"3 ms\"\noverlap = true\n"
      "overlap_time_max = \"3 ms\"\n[program]\n";
  for (const char* scan : {"patterns = 2\nbracket = [\"3 ms\", \"5 ms\"]\n",
                           "steps = [{ expose = \"3 ms\" }, { expose = \"5 ms\" }, { expose = \"3 ms\" }, "
                           "{ expose = \"5 ms\" }]\n"}) {
    const auto pulses = camera_pulses(test::compiled(std::string(kReady) + scan));
    ASSERT_EQ(pulses.size(), 4U) << scan;
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_EQ(pulses[k].second - pulses[k].first, test::board().rate.ticks(k % 2 == 0 ? 3ms : 5ms)) << k;
  }
  const Compilation none =
      test::compile(std::string(kReady) + "patterns = 2\nbracket = [\"3 ms\"]\ngap = \"0 us\"\n");
  EXPECT_EQ(test::finding_of(none, "camera.readout").severity, Severity::error);
}

// The camera exposes 0.4 ms after an edge of its trigger: the trigger comes 0.4 ms earlier, and nothing else
// changes before the exposure has ended.
TEST(Compile, a_late_camera_is_triggered_earlier) {
  const auto scan = [](const std::string& key) {
    return test::compiled("symrig = 1\n[rig.camera]\nreadout = \"2 ms\"\n" + key +
                          "[program]\npatterns = 3\nbracket = [\"1 ms\", \"3 ms\"]\n");
  };
  const auto prompt = scan(""), late = scan("trigger_delay = \"400 us\"\n");
  const auto asked = camera_pulses(prompt), earlier = camera_pulses(late);
  ASSERT_EQ(asked.size(), 6U);
  ASSERT_EQ(earlier.size(), 6U);
  const Ticks delay = test::board().rate.ticks(400us);
  // A second exposure of a pattern waits for its gap from the end of the first one.
  Ticks more{0};
  for (std::size_t k = 0; k < 6; ++k) {
    if (k % 2 == 1) more = more + delay;
    EXPECT_EQ(earlier[k].first + delay, asked[k].first + more) << k;
    EXPECT_EQ(earlier[k].second - earlier[k].first, asked[k].second - asked[k].first) << k;
  }
}

// Stamps of 2 us come from interrupts: nobody asks for them by accident.
TEST(Compile, lines_that_are_stamped_coarsely_are_captured_only_if_asked_for) {
  BoardInfo board = test::board();
  board.lines[0].stamp_ticks = 250;
  board.lines[1].stamp_ticks = 250;
  const ProgramFile file = test::parse(
      "symrig = 1\n[rig.lines.camera_trigger]\ncapture = true\n[program]\npatterns = 1\nbracket = [\"1 "
      "ms\"]\n");
  const Compilation out = compile_program(file, board);
  ASSERT_TRUE(out.ok());
  for (const LineConfig& line : out.program->lines)
    EXPECT_EQ(line.capture, line.line != "projector_trigger") << line.line;
}

}  // namespace
}  // namespace symrig::compile_test
