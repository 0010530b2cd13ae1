// SPDX-License-Identifier: Apache-2.0
#include "conformance/plan.hpp"

#include "symrig/protocol/line_config.hpp"

#include <utility>

namespace symrig::conformance {

using protocol::Op;
using protocol::Record;

Bytes pack(std::initializer_list<Record> records) {
  Bytes out(records.size() * protocol::kRecordSize);
  std::uint8_t* at = out.data();
  for (const Record& record : records) {
    protocol::put_record(record, at);
    at += protocol::kRecordSize;
  }
  return out;
}

Record word(std::uint32_t levels, std::uint32_t ticks) {
  return protocol::make_record(Op::set_word, levels, ticks);
}
Record mark(std::uint32_t id) {
  return protocol::make_record(Op::mark, id, 0);
}
Record loop(std::uint64_t rounds) {
  return protocol::make_loop(rounds);
}
Record end_loop() {
  return protocol::make_record(Op::end_loop, 0, 0);
}
Record wait(std::uint32_t line, protocol::WaitFor edge, bool abort, std::uint32_t timeout) {
  return protocol::make_wait({static_cast<std::uint8_t>(line), edge, abort}, timeout);
}
Record end(std::uint32_t levels) {
  return protocol::make_record(Op::end, levels, 0);
}

namespace {

class Planner {
 public:
  explicit Planner(const Bytes& program) : program_{{program.data(), program.size()}} {}

  Plan run() {
    for (std::uint32_t pc = 0; pc < program_.size(); ++pc) pc = step(pc);
    return std::move(plan_);
  }

 private:
  /// The index of the next record, minus one.
  std::uint32_t step(std::uint32_t pc) {
    const Record record = program_[pc];
    switch (static_cast<Op>(record.op)) {
      case Op::set_word:
        put(record.arg);
        ++plan_.steps;
        plan_.duration += record.ticks;
        return pc;
      case Op::end:
        put(record.arg);
        return pc;
      case Op::mark:
        plan_.marks.push_back({record.arg, plan_.duration});
        return pc;
      case Op::loop:
        loops_.emplace_back(pc, protocol::loop_rounds(record));
        return pc;
      case Op::end_loop:
        return turn(pc);
      case Op::wait_edge:
        return pc;
    }
    return pc;
  }

  std::uint32_t turn(std::uint32_t pc) {
    if (--loops_.back().second > 0) return loops_.back().first;
    loops_.pop_back();
    return pc;
  }

  void put(std::uint32_t levels) {
    for (std::uint32_t k = 0; k < protocol::kMaxOutputs; ++k)
      if ((((levels ^ levels_) >> k) & 1U) != 0)
        plan_.edges.push_back({k, ((levels >> k) & 1U) != 0, plan_.duration});
    levels_ = levels;
  }

  protocol::ProgramView program_;
  Plan plan_;
  std::uint32_t levels_ = 0;
  std::vector<std::pair<std::uint32_t, std::uint64_t>> loops_;
};

}  // namespace

Plan plan_of(const Bytes& program) {
  return Planner(program).run();
}

}  // namespace symrig::conformance
