// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/check_program.hpp"
#include "targets.hpp"
#include "unit/firmware/raw_host.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace symrig::fuzz {
namespace {

constexpr std::uint64_t kLongestRun = 200'000;  // ticks; longer programs are only judged
constexpr std::uint64_t kMostSteps = 5'000;

/// Limits on line 2 taken from the first byte.
protocol::BoardConfig config_of(std::uint8_t byte) {
  protocol::BoardConfig config = test::plain_config();
  config.lines[2].safe_level = (byte & 1U) != 0;
  config.lines[2].max_on = (byte & 2U) != 0 ? 100U + byte : 0U;
  config.lines[2].min_off = (byte & 4U) != 0 ? byte : 0U;
  config.lines[2].max_duty_permille = (byte & 8U) != 0 ? 500 : 0;
  return config;
}

void expect_run(const std::vector<std::uint8_t>& program, const protocol::BoardConfig& config,
                const protocol::ProgramTiming& timing) {
  board_sim::SimBoardConfig small;
  small.program_records = static_cast<std::uint32_t>(program.size() / protocol::kRecordSize);
  board_sim::SimBoard board(small);
  test::RawHost host(board);
  host.hello();
  require(host.configure(config) == 0, "the configuration is sound");
  require(host.upload(program) == 0, "the board accepts what the rules accept");
  require(host.arm() == 0 && host.start() == 0, "what was accepted starts");
  require(host.run_out(timing.max + 1'000'000), "a run ends in time");
  const symrig_wire_RunDone done = host.last(symrig_wire_Event_run_done_tag)->body.run_done;
  require(done.duration <= timing.max, "a run takes no longer than foretold");
  const bool completed = done.end == symrig_wire_RunEnd_RUN_END_COMPLETED;
  require(completed || done.end == symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT, "a sound program does not fault");
  require(!completed || (done.steps == timing.steps && done.duration >= timing.min), "all words went out");
  require(done.underruns == 0 && done.late == 0, "no edge is late");
}

}  // namespace

void fuzz_program(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return;
  const protocol::BoardConfig config = config_of(data[0]);
  const std::vector<std::uint8_t> program(data + 1, data + size);
  const protocol::ProgramRules rules{&config, 5, 0xFFFFFFFF, 125, 24'576 * 8, protocol::kMaxLoopDepth};
  protocol::ProgramTiming timing;
  std::size_t found = 0;
  const bool sound = protocol::check_program(
      {{program.data(), program.size()}}, rules, timing, [&](const protocol::Violation& violation) {
        require(violation.rule != protocol::Rule::none, "a finding has a rule");
        return ++found < 100;
      });
  require(sound == (found == 0), "a program is sound if nothing was found");
  if (!sound) return;
  require(timing.min <= timing.max && timing.max < protocol::kMaxDuration, "times are in order");
  if (timing.max <= kLongestRun && timing.steps <= kMostSteps && timing.marks <= kMostSteps)
    expect_run(program, config, timing);
}

}  // namespace symrig::fuzz
