// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/version.hpp"
#include "usb_device.hpp"

namespace symrig::pico {
namespace {

using firmware::State;

const char* name_of(State state) {
  constexpr const char* names[firmware::kStates] = {"BOOT",  "SAFE",    "CONFIGURED", "LOADED",
                                                    "ARMED", "RUNNING", "DONE",       "FAULT"};
  return names[static_cast<uint8_t>(state)];
}

const char* cause_of(hal::ResetCause cause) {
  switch (cause) {
    case hal::ResetCause::power:
      return "power came on";
    case hal::ResetCause::pin:
      return "the reset pin was pulled";
    case hal::ResetCause::watchdog:
      return "the watchdog expired: the firmware was blocked";
    case hal::ResetCause::request:
      return "a host requested it";
  }
  return "";
}

const char* words_for(uint32_t fault) {
  switch (fault) {
    case symrig_wire_FaultCode_FAULT_UNDERRUN:
      return "the edge engine ran out of words; outputs are safe";
    case symrig_wire_FaultCode_FAULT_MAX_ON:
      return "a line was on for longer than its max_on; outputs are safe";
    case symrig_wire_FaultCode_FAULT_MIN_OFF:
      return "a line came on again before its min_off; outputs are safe";
    case symrig_wire_FaultCode_FAULT_DUTY:
      return "a line was on for more than its share; outputs are safe";
    case symrig_wire_FaultCode_FAULT_KEEP_ALIVE:
      return "the host's keep-alive stopped; outputs are safe";
    case symrig_wire_FaultCode_FAULT_LINK_LOST:
      return "the USB connection was lost; outputs are safe";
    case symrig_wire_FaultCode_FAULT_CAPTURE_OVERFLOW:
      return "edges came too fast to be watched; outputs are safe";
    case symrig_wire_FaultCode_FAULT_INTERLOCK:
      return "an interlock tripped; outputs are safe";
    case symrig_wire_FaultCode_FAULT_CHATTER:
      return "an input changed too fast; outputs are safe";
    case symrig_wire_FaultCode_FAULT_WATCHDOG:
      return "the firmware was blocked and was restarted; outputs are safe";
    default:
      return "the firmware found an internal error; outputs are safe";
  }
}

}  // namespace

void Console::greet(hal::ResetCause cause) {
  line("symrig trigger board, firmware ", firmware::kVersion);
  line("started because ", cause_of(cause));
}

void Console::service() {
  if (core_.state() != told_state_) {
    told_state_ = core_.state();
    line("state ", name_of(told_state_));
  }
  const hal::FaultRecord& fault = core_.fault();
  if (fault.code != told_fault_) {
    told_fault_ = fault.code;
    if (fault.code == 0) {
      line("fault cleared", "");
    } else {
      line("fault: ", words_for(fault.code));
      line("  code ", fault.code);
      line("  argument ", fault.arg);
      line("  tick ", fault.tick);
    }
  }
}

void Console::line(const char* first, const char* second) {
  if (lost_ != 0 && usb_.console_open()) {
    lost_ = 0;
    print("... some lines were lost\r\n");
  }
  print(first);
  print(second);
  print("\r\n");
}

void Console::line(const char* text, uint64_t number) {
  char digits[21];
  size_t at = sizeof digits - 1;
  digits[at] = 0;
  do {
    digits[--at] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  line(text, digits + at);
}

void Console::print(const char* text) {
  size_t size = 0;
  while (text[size] != 0) ++size;
  lost_ += static_cast<uint32_t>(size - usb_.print(text, size));
}

}  // namespace symrig::pico
