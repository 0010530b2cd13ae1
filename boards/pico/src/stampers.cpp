// SPDX-License-Identifier: Apache-2.0
#include "stampers.hpp"

#include "board_pins.hpp"

namespace symrig::pico {
namespace {

using hal::Tick;

// X counts down once every two cycles on every path. A stamp is X's lower 31 bits and the level.
constexpr uint16_t kCode[] = {
    0x00c3,  //  0 low:   jmp pin, 3
    0x0040,  //  1        jmp x--, low
    0x0140,  //  2        jmp x--, low [1]   only when X passes 0: two counts in four cycles
    0x403f,  //  3 rise:  in x, 31
    0x4041,  //  4        in y, 1            Y is 1
    0x8000,  //  5        push noblock
    0x0047,  //  6        jmp x--, 7         eight cycles from sample to sample: four counts
    0x0048,  //  7        jmp x--, 8
    0x0049,  //  8        jmp x--, 9
    0x004a,  //  9        jmp x--, high
    0x00d2,  // 10 high:  jmp pin, 18
    0x403f,  // 11 fall:  in x, 31
    0x4061,  // 12        in null, 1
    0x8000,  // 13        push noblock
    0x004f,  // 14        jmp x--, 15
    0x0050,  // 15        jmp x--, 16
    0x0051,  // 16        jmp x--, 17
    0x0040,  // 17        jmp x--, low       and if X passes 0, wrap to low
    0x004a,  // 18        jmp x--, high
    0x014a,  // 19        jmp x--, high [1]  only when X passes 0
};
constexpr uint32_t kWrapBottom = 0;
constexpr uint32_t kWrapTop = 17;

constexpr uint16_t kMovXNotNull = 0xa02b;
constexpr uint16_t kSetY1 = 0xe041;

constexpr uint32_t kRingBits = 11;
constexpr uint32_t kMost = 0xffffffff;

__attribute__((section(".rings.stamps"),
               aligned(1U << kRingBits))) volatile uint32_t stamps[Stampers::kCount][Stampers::kRing];
static_assert(sizeof stamps[0] == 1U << kRingBits);

uint32_t channel(uint32_t index) {
  return dma::channel(kDmaStampers + index);
}

void set_up_machine(uint32_t index) {
  const uint32_t machine = pio::pio1 + pio::machine(index);
  reg(machine + pio::clkdiv) = 1U << 16U;
  reg(machine + pio::execctrl) = (kStampedPins[index] << 24U) | (kWrapTop << 12U) | (kWrapBottom << 7U);
  reg(machine + pio::shiftctrl) = (1U << 31U) | (1U << 19U);  // RX FIFO of 8; ISR shifts left
  reg(machine + pio::instr) = kMovXNotNull;
  reg(machine + pio::instr) = kSetY1;
  reg(machine + pio::instr) = 0;  // jmp low
}

void set_up_channel(uint32_t index) {
  reg(channel(index) + dma::read_addr) = pio::pio1 + pio::rxf0 + 4 * index;
  reg(channel(index) + dma::write_addr) = address_of(stamps[index]);
  reg(channel(index) + dma::trans_count) = kMost;
  reg(channel(index) + dma::ctrl_trig) = dma::enable | dma::word | dma::incr_write | dma::ring(kRingBits) |
                                         dma::ring_on_write | dma::chain(kDmaStampers + index) |
                                         dma::dreq(dma::dreq_pio1_rx0 + index) | dma::irq_quiet;
}

/// Enables the machines. Returns the SysTick value a fixed number of cycles earlier.
SYMRIG_RAM uint32_t enable_machines() {
  const IrqLock lock;
  uint32_t stood = 0;
  asm volatile(
      "ldr %[stood], [%[systick]]\n"
      "str %[enable], [%[control]]\n"
      : [stood] "=&l"(stood)
      : [systick] "l"(core::systick), [control] "l"(pio::pio1 + pio::ctrl),
        [enable] "l"((1U << Stampers::kCount) - 1)
      : "memory");
  return stood;
}

}  // namespace

void Stampers::start(const TickClock& clock) {
  clock_ = &clock;
  for (uint32_t i = 0; i < sizeof kCode / sizeof kCode[0]; ++i)
    reg(pio::pio1 + pio::instr_mem + 4 * i) = kCode[i];
  for (uint32_t i = 0; i < kCount; ++i) {
    set_up_machine(i);
    set_up_channel(i);
  }
  epoch_ = clock.at(enable_machines()) + kStampOffset;
}

SYMRIG_RAM uint32_t Stampers::written(uint32_t index) {
  return kMost - reg(channel(index) + dma::trans_count);
}

/// The count is exact modulo 2^31 (34 s). `now` resolves the ambiguity.
SYMRIG_RAM Tick Stampers::tick_of(uint32_t stamp, Tick now) const {
  const uint32_t count = 0x7fffffffU - (stamp >> 1U);
  const uint64_t present = (now - epoch_) / 2 + 16;  // a stamp may be a little ahead of `now`
  const uint32_t age = (static_cast<uint32_t>(present) - count) & 0x7fffffffU;
  return epoch_ + 2 * (present - age);
}

void Stampers::show(uint32_t index, bool shown) {
  taken_[index] = written(index);
  shown_[index] = shown;
}

SYMRIG_RAM bool Stampers::peek(uint32_t index, Tick& tick, bool& level) const {
  if (!shown_[index]) return false;
  const uint32_t there = written(index);
  if (there - taken_[index] > kRing - 8) {
    taken_[index] = there - kRing / 2;
    overflow_ = true;
  }
  if (there == taken_[index]) return false;
  const uint32_t stamp = stamps[index][taken_[index] % kRing];
  tick = tick_of(stamp, clock_->now());
  level = (stamp & 1U) != 0;
  return true;
}

bool Stampers::pending() const {
  for (uint32_t i = 0; i < kCount; ++i)
    if (shown_[i] && written(i) != taken_[i]) return true;
  return false;
}

void Stampers::service() {
  for (uint32_t i = 0; i < kCount; ++i) {
    if ((reg(channel(i) + dma::al1_ctrl) & dma::busy) != 0 || (shown_[i] && written(i) != taken_[i]))
      continue;
    taken_[i] = 0;
    set_up_channel(i);
  }
}

bool Stampers::take_overflow() {
  const uint32_t stalled = reg(pio::pio1 + pio::fdebug) & ((1U << kCount) - 1);
  if (stalled != 0) reg(pio::pio1 + pio::fdebug) = stalled;
  const bool lost = overflow_ || stalled != 0;
  overflow_ = false;
  return lost;
}

SYMRIG_RAM bool Stampers::find(uint32_t index, bool level, Tick from, Tick& tick) const {
  const Tick now = clock_->now();
  const uint32_t there = written(index);
  bool found = false;
  for (uint32_t back = 1; back <= kRing - 8 && back <= there; ++back) {
    const uint32_t stamp = stamps[index][(there - back) % kRing];
    const Tick at = tick_of(stamp, now);
    if (at < from) break;
    if (((stamp & 1U) != 0) != level) continue;
    tick = at;
    found = true;
  }
  return found;
}

}  // namespace symrig::pico
