// SPDX-License-Identifier: Apache-2.0
// A program that passes rule `refill` against a filler that is as slow as the board says it may be, and that
// comes as late as it may, in a queue written here from the words of hal/board.hpp.
#include "compact_program.hpp"
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

namespace {

using protocol::Op;
using protocol::Record;

constexpr std::size_t kMostItems = 20'000;
constexpr std::uint32_t kMarksInARow = protocol::kMaxMarksInARow;

/// What a program comes to when its loops are gone through; loop and end_loop cost the filler time too.
struct Item {
  Op op;
  std::uint64_t ticks;
};

/// false: too many.
bool write_out(protocol::ProgramView program, std::vector<Item>& items) {
  std::vector<std::pair<std::uint32_t, std::uint64_t>> loops;
  for (std::uint32_t pc = 0; pc < program.size() && items.size() < kMostItems; ++pc) {
    const Record record = program[pc];
    items.push_back({static_cast<Op>(record.op), record.ticks});
    if (record.is(Op::loop)) loops.emplace_back(pc, protocol::loop_rounds(record));
    if (!record.is(Op::end_loop)) continue;
    if (--loops.back().second > 0)
      pc = loops.back().first;
    else
      loops.pop_back();
  }
  return items.size() < kMostItems;
}

struct Costs {
  std::uint32_t queue = 2;
  std::uint32_t refill = 0;
  std::uint32_t poll = 0;
  std::uint32_t latency = 0;
};

/// The filler against the engine. Time 0 is the start, before which all that fits is filled in.
class Race {
 public:
  Race(const Costs& costs, Input& input)
      : costs_(costs), input_(input), mark_room_(std::max(costs.queue, kMarksInARow)) {}

  /// false: the engine found its queue empty.
  bool run(const std::vector<Item>& items) {
    return std::all_of(items.begin(), items.end(), [this](const Item& item) { return take(item); });
  }

 private:
  static constexpr std::int64_t kBefore = -1;  // before the start

  bool take(const Item& item) {
    const std::int64_t room = room_for(item.op);
    if (room > filler_) {
      filler_ = room + input_.byte() % (costs_.poll + 1);  // it had stopped; when does it look again?
      started_ = true;
    }
    if (started_) filler_ += costs_.refill;
    switch (item.op) {
      case Op::mark:
        marks_.push_back(end_);
        return true;
      case Op::loop:
      case Op::end_loop:
        return true;
      case Op::set_word:
      case Op::wait_edge:
      case Op::end:
        return play(item);
    }
    return false;
  }

  /// When there is room, kBefore if from the beginning.
  std::int64_t room_for(Op op) const {
    if (op == Op::mark) return before(marks_, mark_room_);
    if (op == Op::loop || op == Op::end_loop) return kBefore;
    const std::int64_t in_queue = before(begins_, costs_.queue);
    if (op != Op::wait_edge) return in_queue;
    return std::max(in_queue, before(wait_ends_, protocol::kMaxWaitsQueued));
  }
  static std::int64_t before(const std::vector<std::int64_t>& times, std::size_t count) {
    return times.size() < count ? kBefore : times[times.size() - count];
  }

  bool play(const Item& item) {
    if (filler_ > end_) return false;
    begins_.push_back(end_);
    if (item.op == Op::set_word) end_ += static_cast<std::int64_t>(item.ticks);
    if (item.op != Op::wait_edge) return true;
    end_ += static_cast<std::int64_t>(input_.byte() % 4 == 3 ? input_.word() % (item.ticks + 1) : 0);
    end_ += costs_.latency;
    wait_ends_.push_back(end_);
    return true;
  }

  Costs costs_;
  Input& input_;
  std::size_t mark_room_;
  bool started_ = false;           // the queue has been full
  std::int64_t filler_ = kBefore;  // when the filler has done with the last record
  std::int64_t end_ = 0;           // of the last segment filled in
  std::vector<std::int64_t> begins_, wait_ends_, marks_;
};

}  // namespace

void fuzz_refill(const std::uint8_t* data, std::size_t size) {
  Input input({data, size});
  Costs costs;
  costs.queue = 2U + input.byte();
  costs.refill = 1U + input.byte() % 64U;
  costs.poll = input.word() % 2048U;
  costs.latency = input.byte();
  const std::size_t records = input.byte() % 64U;
  const std::vector<std::uint8_t> program = compact_program(input, records, {.word_ticks = 1, .rounds = 200});
  protocol::BoardConfig config;
  for (unsigned k = 0; k < 4; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = k < 3;
  }
  protocol::ProgramRules rules{&config, 1, 0xFFFFFFFF, costs.latency, 1U << 16U, protocol::kMaxLoopDepth};
  rules.queue_segments = costs.queue;
  rules.refill_ticks = costs.refill;
  rules.poll_ticks = costs.poll;
  protocol::ProgramTiming timing;
  const protocol::ProgramView view{{program.data(), program.size()}};
  std::vector<Item> items;
  if (!protocol::check_program(view, rules, timing, [](const protocol::Violation&) { return false; })) return;
  if (!write_out(view, items)) return;
  require(Race(costs, input).run(items), "what the rule passes never runs dry");
}

}  // namespace symrig::fuzz
