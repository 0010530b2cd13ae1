// SPDX-License-Identifier: Apache-2.0
#include "pin_capture.hpp"

#include "board_pins.hpp"

namespace symrig::pico {

using hal::CapturedEdge;
using hal::Tick;

namespace {

constexpr uint32_t kNoLine = 0xff;
constexpr uint32_t kInterruptDelay = 24;  // ticks from an edge to its stamp, typical

constexpr uint32_t line_of(uint32_t pin) {
  if (pin < kOutputs) return pin;
  for (uint32_t line = kOutputs; line < kLines; ++line)
    if (kLinePins[line] == pin) return line;
  return kNoLine;
}

struct LineTable {
  uint8_t of_pin[24];
};
constexpr LineTable make_table() {
  LineTable table{};
  for (uint32_t pin = 0; pin < 24; ++pin) table.of_pin[pin] = static_cast<uint8_t>(line_of(pin));
  return table;
}
// In RAM, like the code that uses it.
__attribute__((section(".data.lines"))) LineTable lines = make_table();

constexpr bool stamped(uint32_t line) {
  return line - kFirstStampedLine < kStampedLines;
}

}  // namespace

SYMRIG_RAM uint32_t line_levels() {
  const uint32_t in = reg(sio::gpio_in);
  static_assert(kLinePins[kOutputs] == 16 && kLinePins[kLines - 1] == 16 + kLines - kOutputs - 1);
  constexpr uint32_t inputs = (1U << (kLines - kOutputs)) - 1;
  return (in & kOutputMask) | (((in >> 16U) & inputs) << kOutputs);
}

void PinCapture::begin() {
  for (uint32_t line = kOutputs; line < kLines; ++line) {
    reg(pads::pin(kLinePins[line])) = pads::input_enable | pads::drive_4ma | pads::pull_down | pads::schmitt;
    reg(io::ctrl(kLinePins[line])) = io::function_sio;
  }
  for (uint32_t group = 0; group < kGroups; ++group) reg(io::intr(group)) = 0xffffffff;
  watch((1U << kLines) - 1);
  enable_irq(irq::gpio, 0);
}

void PinCapture::watch(uint32_t wanted) {
  uint32_t flags[kGroups] = {};
  for (uint32_t pin = 0; pin < sizeof lines.of_pin; ++pin) {
    const uint32_t line = lines.of_pin[pin];
    if (line == kNoLine || stamped(line) || ((wanted >> line) & 1U) == 0) continue;
    flags[pin / 8] |= (io::edge_low | io::edge_high) << (4 * (pin % 8));
  }
  for (uint32_t index = 0; index < Stampers::kCount; ++index)
    stampers_.show(index, ((wanted >> (kFirstStampedLine + index)) & 1U) != 0);
  const IrqLock lock;
  for (uint32_t group = 0; group < kGroups; ++group) {
    // The chip keeps edges from unwatched times. They would come now, with the wrong time.
    const uint32_t already = watch_flags_[group] | (group == kInputGroup ? trip_flags_ : 0);
    reg(io::intr(group)) = flags[group] & ~already;
    watch_flags_[group] = flags[group];
  }
  enable_interrupts(true);
}

void PinCapture::watch_trips(uint32_t wanted, uint32_t trip_levels) {
  uint32_t flags = 0;
  for (uint32_t line = kOutputs; line < kLines; ++line) {
    if (((wanted >> line) & 1U) == 0 || !kLineTable[line].trips) continue;
    const bool high = ((trip_levels >> line) & 1U) != 0;
    flags |= (high ? io::edge_high : io::edge_low) << (4 * (kLinePins[line] % 8U));
  }
  const IrqLock lock;
  // Edges from unwatched times are no trips. Edges of watched lines are handled at once. The caller then
  // reads the levels, so a line that trips from now on is not missed.
  reg(io::intr(kInputGroup)) = flags & ~watch_flags_[kInputGroup];
  trip_flags_ = flags;
  enable_interrupts(true);
}

/// watched: false enables only the trips.
SYMRIG_RAM void PinCapture::enable_interrupts(bool watched) {
  for (uint32_t group = 0; group < kGroups; ++group) {
    const uint32_t trips = group == kInputGroup ? trip_flags_ : 0;
    reg(io::inte(group)) = trips | (watched ? watch_flags_[group] : 0);
  }
}

SYMRIG_RAM void PinCapture::handle() {
  for (uint32_t left = kGroups; left > 0; --left) {
    const uint32_t group = left - 1;  // the inputs' group first
    const uint32_t flags = reg(io::ints(group));
    if (flags == 0) continue;
    // Clears exactly the flags that were judged. A later edge interrupts again.
    if (group == kInputGroup && (flags & trip_flags_) != 0) judge_trips(flags & trip_flags_);
    reg(io::intr(group)) = flags;
    record(group, flags);
    look_for_trips();
  }
  if (in_this_millisecond_ > kMostPerMillisecond) {
    overflow_ = true;
    enable_interrupts(false);
  }
}

SYMRIG_RAM void PinCapture::judge_trips(uint32_t hit) {
  engine_.trip(0);  // outputs first, then the line's number
  uint32_t tripped = 0;
  for (uint32_t pin = 0; pin < 8; ++pin)
    if (((hit >> (4 * pin)) & 0xfU) != 0) tripped |= 1U << lines.of_pin[8 * kInputGroup + pin];
  engine_.trip(tripped);
  // The outputs stay safe until the next watch_trips(). More edges of these lines would only take time.
  trip_flags_ = trip_flags_ & ~hit;
  reg(io::inte(kInputGroup)) = reg(io::inte(kInputGroup)) & (trip_flags_ | watch_flags_[kInputGroup]);
}

/// A pulse shorter than the interrupt gives two edges with the same stamp.
SYMRIG_RAM void PinCapture::record(uint32_t group, uint32_t flags) {
  const Tick tick = clock_.now() - kInterruptDelay;
  look_for_trips();
  const uint32_t levels = line_levels();
  for (uint32_t pin = 8 * group; flags != 0; ++pin, flags >>= 4U) {
    if ((flags & 0xfU) == 0) continue;
    look_for_trips();
    in_this_millisecond_ = in_this_millisecond_ + 1;
    const uint32_t line = lines.of_pin[pin];
    const bool both = (flags & 0xfU) == (io::edge_low | io::edge_high);
    const bool level = both ? ((levels >> line) & 1U) != 0 : (flags & io::edge_high) != 0;
    if (both) add(line, !level, tick);
    add(line, level, tick);
  }
}

SYMRIG_RAM void PinCapture::add(uint32_t line, bool level, Tick tick) {
  if (next_ - first_ == kRing) {
    overflow_ = true;
    return;
  }
  edges_[next_ % kRing] = {tick, static_cast<uint8_t>(line), level};
  next_ = next_ + 1;
}

bool PinCapture::peek(uint32_t source, CapturedEdge& edge) {
  if (source < Stampers::kCount) {
    edge.line = static_cast<uint8_t>(kFirstStampedLine + source);
    return stampers_.peek(source, edge.tick, edge.level);
  }
  if (first_ == next_) return false;
  edge = edges_[first_ % kRing];
  return true;
}

bool PinCapture::pop(CapturedEdge& edge) {
  if (round_left_ == 0) return false;
  uint32_t oldest = kSources;
  for (uint32_t source = 0; source < kSources; ++source) {
    CapturedEdge candidate;
    if (!peek(source, candidate) || (oldest != kSources && candidate.tick >= edge.tick)) continue;
    edge = candidate;
    oldest = source;
  }
  const Tick settled = clock_.now() - kOutOfTurn;
  if (oldest == kSources || edge.tick > settled) {
    caught_up_ = settled;
    return false;
  }
  caught_up_ = edge.tick;
  --round_left_;
  if (oldest < Stampers::kCount) {
    stampers_.drop(oldest);
  } else {
    first_ = first_ + 1;
  }
  return true;
}

bool PinCapture::pending() const {
  return first_ != next_ || stampers_.pending();
}

bool PinCapture::take_overflow() {
  const bool lost = stampers_.take_overflow() || overflow_;
  overflow_ = false;
  return lost;
}

void PinCapture::service() {
  const uint64_t now = microseconds();
  if (now < millisecond_end_) return;
  millisecond_end_ = now + 1000;
  stampers_.service();
  const IrqLock lock;
  const bool held_back = in_this_millisecond_ > kMostPerMillisecond;
  in_this_millisecond_ = 0;
  if (held_back) enable_interrupts(true);
}

}  // namespace symrig::pico
