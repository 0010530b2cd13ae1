// SPDX-License-Identifier: Apache-2.0
// The board: its parts, the main loop, the interrupts.
#include "board_pins.hpp"
#include "edge_engine.hpp"
#include "edge_log.hpp"
#include "peripherals.hpp"
#include "symrig/firmware/core.hpp"
#include "tick_clock.hpp"
#include "uart.hpp"

#include <avr/eeprom.h>

namespace symrig::mega2560 {
namespace {

uint8_t program_store[kProgramRecords * protocol::kRecordSize];
symrig_wire_Event events[kEvents];
firmware::QueuedMark marks[kMarks];
uint8_t unique_id[8];

TickClock tick_clock;
InputGate input_gate;
EdgeLog edge_log(tick_clock, input_gate);
MegaEngine engine(tick_clock, edge_log);
Uart uart(engine);
MegaFaultStore fault_store;
MegaWatchdog board_watchdog(tick_clock);
MegaIndicator indicator;
MegaSettings settings;
MegaSystem board_system;

constexpr hal::BoardTraits kTraits = {
    kBoardName, unique_id,    sizeof unique_id, kLineTable,   kLines,     kTickHz,  kMinDwell,
    kMaxDwell,  kWaitLatency, kQueueSegments,   kRefillTicks, kPollTicks, kLateness};
const hal::Board board = {kTraits,     tick_clock,     engine,    edge_log, uart,
                          fault_store, board_watchdog, indicator, settings, board_system};
firmware::Core core(board, {{program_store, sizeof program_store}, events, kEvents, {marks, kMarks}});

/// The ATmega2560 has no serial number. The maker writes one into the last eight bytes of the EEPROM.
void read_unique_id() {
  eeprom_read_block(unique_id, reinterpret_cast<const void*>(E2END - 7), sizeof unique_id);
}

void set_up() {
  board_system.begin();
  MegaIndicator::begin();
  read_unique_id();
  TickClock::begin();
  board_watchdog.begin();
  MegaEngine::begin();
  InputGate::begin();
  Uart::begin();
  sei();
  core.boot();
}

/// The interrupt of an input, line - kOutputs. The chip has cleared its own flag. Those of others may be set:
/// an interlock among them acts first, so no other input can delay it by being first in the order of vectors.
template <uint8_t input>
inline __attribute__((always_inline)) void input_edge() {
  engine.look_for_trips(static_cast<uint8_t>(EIFR | (1U << input)));
  const bool level = input_level<input>();
  const ShortTick tick = tick_clock.now_locked();
  input_gate.count<input>(tick);
  edge_log.add(tick, kOutputs + input, level);
  engine.input(tick, input, level);
}

}  // namespace
}  // namespace symrig::mega2560

// Vectors of the ATmega2560 (data sheet table 14-1; the names are avr-libc's).
#define SYMRIG_INTERRUPT(vector) extern "C" __attribute__((signal, used)) void vector()
SYMRIG_INTERRUPT(__vector_1);
SYMRIG_INTERRUPT(__vector_2);
SYMRIG_INTERRUPT(__vector_3);
SYMRIG_INTERRUPT(__vector_4);
SYMRIG_INTERRUPT(__vector_5);
SYMRIG_INTERRUPT(__vector_6);
SYMRIG_INTERRUPT(__vector_17);
SYMRIG_INTERRUPT(__vector_25);
SYMRIG_INTERRUPT(__vector_26);
SYMRIG_INTERRUPT(__vector_35);

void __vector_1() {
  symrig::mega2560::input_edge<0>();
}
void __vector_2() {
  symrig::mega2560::input_edge<1>();
}
void __vector_3() {
  symrig::mega2560::input_edge<2>();
}
void __vector_4() {
  symrig::mega2560::input_edge<3>();
}
void __vector_5() {
  symrig::mega2560::input_edge<4>();
}
void __vector_6() {
  symrig::mega2560::input_edge<5>();
}
void __vector_17() {
  symrig::mega2560::engine.time_is_up();
}  // TIMER1 COMPA
void __vector_35() {
  symrig::mega2560::tick_clock.overflowed();
  symrig::mega2560::input_gate.open();
  symrig::mega2560::engine.age_edges();
}  // TIMER3 OVF
void __vector_25() {
  symrig::mega2560::uart.received(UDR0);
}  // USART0 RX
void __vector_26() {
  symrig::mega2560::uart.may_send();
}  // USART0 UDRE

extern "C" int main() {  // freestanding: an ordinary name to the compiler
  symrig::mega2560::set_up();
  for (;;) symrig::mega2560::core.poll();
}
