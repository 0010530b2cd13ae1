// SPDX-License-Identifier: Apache-2.0
// The board: its parts, the main loop, the interrupts.
#include "board_pins.hpp"
#include "chip.hpp"
#include "edge_engine.hpp"
#include "peripherals.hpp"
#include "pin_capture.hpp"
#include "symrig/firmware/core.hpp"
#include "usb_device.hpp"

namespace symrig::pico {
namespace {

__attribute__((section(".store"))) uint8_t program_store[kProgramRecords * protocol::kRecordSize];
symrig_wire_Event events[kEvents];
firmware::QueuedMark marks[kQueueSegments];

uint8_t unique_id[8];
char serial[17];

TickClock tick_clock;
Stampers stampers;
PicoEngine engine(tick_clock, stampers);
PinCapture capture(tick_clock, stampers, engine);
UsbDevice usb_device(engine);
MainLoopWatch loop_watch;
PicoFaultStore fault_store;
PicoWatchdog board_watchdog;
PicoIndicator indicator;
PicoSettings settings;
PicoSystem board_system(engine);

constexpr hal::BoardTraits kTraits = {kBoardName,   unique_id,      sizeof unique_id, kLineTable,
                                      kLines,       kTickHz,        kMinDwell,        kMaxDwell,
                                      kWaitLatency, kQueueSegments, kRefillTicks,     kPollTicks};
const hal::Board board = {kTraits,     tick_clock,     engine,    capture,  usb_device,
                          fault_store, board_watchdog, indicator, settings, board_system};
firmware::Core core(board, {{program_store, sizeof program_store}, events, kEvents, {marks, kQueueSegments}});
Console console(usb_device, core);

// Counts interrupts. Before it sleeps, the main loop checks whether one has come.
volatile uint32_t wakes = 0;

void write_serial() {
  read_unique_id(unique_id);
  for (uint32_t i = 0; i < sizeof unique_id; ++i) {
    serial[2 * i] = "0123456789ABCDEF"[unique_id[i] >> 4U];
    serial[2 * i + 1] = "0123456789ABCDEF"[unique_id[i] & 15U];
  }
}

void restart() {
  engine.force(core.safe_levels());
  board_system.reboot(usb_device.reset_asked() == UsbDevice::Reset::bootloader);
}

SYMRIG_RAM void set_up() {
  board_system.begin();
  write_serial();
  tick_clock.start();
  engine.begin(capture);
  PicoWatchdog::begin();
  PicoIndicator::begin();
  stampers.start(tick_clock);
  capture.begin();
  enable_irq(irq::pio0_0, 1);
  reg(dma::inte0) = 1U << kDmaEngineControl;
  enable_irq(irq::dma0, 3);
  reg(timer::inte) = 3;
  enable_irq(irq::timer0, 1);
  enable_irq(irq::timer1, 3);
  core.boot();
  reg(xip::accesses) = 0;  // from here on nothing reads flash, except for the settings
  reg(xip::hits) = 0;
  usb_device.begin(serial);
  console.greet(board_system.reset_cause());
}

/// Sleeps until an interrupt, until tick `until`, or for a millisecond, whichever is first. Does not sleep if
/// an interrupt has come since `wakes` had the value `seen`.
void sleep(hal::Tick until, uint32_t seen) {
  constexpr uint32_t kMost = 1000 * kTicksPerMicrosecond;
  constexpr uint32_t kNotWorthIt = 10 * kTicksPerMicrosecond;
  const hal::Tick now = tick_clock.now();
  uint32_t ticks = kMost;
  if (until < now + kMost) ticks = until > now ? static_cast<uint32_t>(until - now) : 0;
  if (ticks < kNotWorthIt) return;
  const IrqLock lock;
  if (wakes != seen) return;
  // ticks / 125, as a product that fits into 32 bits (33,554 / 2^22 is a little less than 1 / 125)
  const uint32_t wake = reg(timer::raw_low) + ((ticks * 33'554U) >> 22U);
  reg(timer::alarm1) = wake;
  if (static_cast<int32_t>(wake - reg(timer::raw_low)) <= 0) return;  // an alarm in the past never comes
  const uint32_t asleep = read_systick();
  asm volatile("wfi");
  core.slept((asleep - read_systick()) & kSystickMask);
}

[[noreturn]] SYMRIG_RAM void run() {
  for (;;) {
    const uint32_t seen = wakes;
    usb_device.begin_round(engine.playing());
    capture.begin_round();
    core.poll();
    engine.service();
    board_watchdog.pass(PicoWatchdog::engine);
    capture.service();
    board_watchdog.pass(PicoWatchdog::pins);
    if (!tick_clock.sound()) stop_board();
    board_watchdog.pass(PicoWatchdog::clock);
    console.service();
    loop_watch.end_round();
    if (usb_device.reset_asked() != UsbDevice::Reset::none) restart();
    if (engine.hungry() || engine.ending() || capture.pending() || usb_device.waiting()) continue;
    const hal::Tick deadline = core.next_deadline();
    const hal::Tick engines = engine.next_deadline();
    sleep(deadline < engines ? deadline : engines, seen);
  }
}

}  // namespace
}  // namespace symrig::pico

extern "C" {

/// SysTick counts the processor's clock, TIMER and the watchdog count the crystal's. So this notices a
/// crystal that stops, which the watchdog cannot. It also keeps the place where a main loop hangs, before the
/// watchdog resets it.
__attribute__((used)) void systick_body(const symrig::pico::ExceptionFrame* frame) {
  using namespace symrig::pico;
  wakes = wakes + 1;
  if (!tick_clock.moves()) stop_board();
  loop_watch.look(*frame);
}

SYMRIG_RAM void usb_handler() {
  symrig::pico::wakes = symrig::pico::wakes + 1;
  symrig::pico::usb_device.handle();
}

SYMRIG_RAM void gpio_handler() {
  symrig::pico::wakes = symrig::pico::wakes + 1;
  symrig::pico::capture.handle();
}

SYMRIG_RAM void pio0_handler() {
  symrig::pico::wakes = symrig::pico::wakes + 1;
  symrig::pico::engine.program_stopped();
}

SYMRIG_RAM void dma0_handler() {
  symrig::pico::wakes = symrig::pico::wakes + 1;
  symrig::pico::reg(symrig::pico::dma::ints0) = 1U << symrig::pico::kDmaEngineControl;
}

SYMRIG_RAM void timer0_handler() {
  symrig::pico::wakes = symrig::pico::wakes + 1;
  symrig::pico::reg(symrig::pico::timer::intr) = 1;
  symrig::pico::engine.time_is_up();
}

SYMRIG_RAM void timer1_handler() {
  symrig::pico::wakes = symrig::pico::wakes + 1;
  symrig::pico::reg(symrig::pico::timer::intr) = 2;
}
}

int main() {
  symrig::pico::set_up();
  symrig::pico::run();
}
