// SPDX-License-Identifier: Apache-2.0
#include "emergency.hpp"

#include <array>
#include <atomic>
#include <csignal>

namespace symrig::board_linux {
namespace {

constexpr std::array<int, 5> kBreakdowns{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

// A signal handler can only use globals.
std::atomic<Gpio*> emergency_gpio = nullptr;
std::atomic<std::uint32_t> emergency_levels = 0;
static_assert(std::atomic<Gpio*>::is_always_lock_free && std::atomic<std::uint32_t>::is_always_lock_free);

extern "C" void on_breakdown(int number) {
  Gpio* const gpio = emergency_gpio;
  if (gpio != nullptr) gpio->put(emergency_levels, UINT32_MAX);
  static_cast<void>(std::signal(number, SIG_DFL));
  static_cast<void>(std::raise(number));
}

}  // namespace

Emergency::Emergency(Gpio& gpio) {
  emergency_gpio = &gpio;
  struct sigaction action {};
  action.sa_handler = on_breakdown;
  action.sa_flags = SA_NODEFER;
  for (const int number : kBreakdowns) ::sigaction(number, &action, nullptr);
}

Emergency::~Emergency() {
  for (const int number : kBreakdowns) static_cast<void>(std::signal(number, SIG_DFL));
  emergency_gpio = nullptr;
}

void Emergency::set_safe(std::uint32_t levels) {
  emergency_levels = levels;
}

}  // namespace symrig::board_linux
