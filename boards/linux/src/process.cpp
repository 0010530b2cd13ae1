// SPDX-License-Identifier: Apache-2.0
#include "process.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace symrig::board_linux {

PriorityMutex::PriorityMutex() {
  pthread_mutexattr_t attributes{};
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
}

std::string run_first(int priority) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  if (error == 0) return {};
  return fmt::format("no real-time priority ({}); give the service LimitRTPRIO={} or CAP_SYS_NICE",
                     std::strerror(error), priority);
}

Result<Fd> stay_awake() {
  constexpr const char* kPath = "/dev/cpu_dma_latency";
  constexpr std::int32_t kMicroseconds = 0;
  Fd file(::open(kPath, O_WRONLY | O_CLOEXEC));
  if (file && ::write(file.get(), &kMicroseconds, sizeof kMicroseconds) == sizeof kMicroseconds) return file;
  return Error{ErrorCode::device_refused,
               fmt::format("the processors may sleep deeply ({}: {})", kPath, std::strerror(errno)),
               "give the service this device (62-symrig-gpio.rules, DeviceAllow=)"};
}

std::string lock_memory() {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return fmt::format("memory is not locked ({}); give the service LimitMEMLOCK=infinity",
                     std::strerror(errno));
}

void notify_manager(std::string_view state) {
  const char* place = std::getenv("NOTIFY_SOCKET");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  sockaddr_un address{};
  if (place == nullptr || *place == '\0' || std::strlen(place) >= sizeof address.sun_path) return;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, place, std::strlen(place));
  if (address.sun_path[0] == '@') address.sun_path[0] = '\0';  // an abstract socket
  const Fd fd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + std::strlen(place));
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  ::sendto(fd.get(), state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address),
           size);
}

void log_line(std::string_view text) {
  write_standard_error("symrigd: " + printable_line(text) + "\n");
}

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
