// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/ports.hpp"

#include "bench-vm/modules/testcam/testcam.h"
#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <pthread.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace symrig::bench_vm {

namespace {

constexpr std::uint32_t kTriggerIsPulse = 2;

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> all;
  for (std::string word; in >> word;) all.push_back(word);
  return all;
}

Result<Fd> open_to_write(const std::string& path) {
  Fd file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));  // NOLINT(cppcoreguidelines-pro-type-vararg)
  if (!file) return system_error(fmt::format("cannot open {}", path), "needs root in the guest");
  return file;
}

}  // namespace

Result<std::string> bench_variable(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before any thread is started
  if (value != nullptr && *value != '\0') return std::string(value);
  return Error{ErrorCode::not_found, fmt::format("{} is not set", name),
               "run it in the guest: tests/bench-vm/run --with gpio,usb,camera,vkms -- COMMAND"};
}

Error system_error(std::string_view what, std::string_view hint) {
  std::array<char, 128> text{};
  return {ErrorCode::io, fmt::format("{} ({})", what, strerror_r(errno, text.data(), text.size())),
          std::string(hint)};
}

Result<BenchPlaces> BenchPlaces::from_environment() {
  BenchPlaces places;
  SYMRIG_TRY(places.gpio_sysfs, bench_variable("BENCH_GPIO_SYSFS"));
  SYMRIG_TRY(places.tracefs, bench_variable("BENCH_TRACEFS"));
  SYMRIG_TRY(places.screen, bench_variable("BENCH_VKMS"));
  SYMRIG_TRY(const std::string lines, bench_variable("BENCH_GPIO_LINES"));
  places.gpio_lines = words(lines);
  SYMRIG_TRY(const std::string base, bench_variable("BENCH_GPIO_BASE"));
  const auto [stop, error] = std::from_chars(base.data(), base.data() + base.size(), places.gpio_base);
  if (error != std::errc{} || stop != base.data() + base.size())
    return Error{ErrorCode::bad_argument, fmt::format("BENCH_GPIO_BASE is '{}', not a number", base), ""};
  return places;
}

Result<std::string> BenchPlaces::screen_of(std::size_t number) const {
  if (number == 0) return screen;
  return bench_variable("BENCH_VKMS_B");
}

Result<int> BenchPlaces::line(std::string_view name) const {
  const auto at = std::find(gpio_lines.begin(), gpio_lines.end(), name);
  if (at != gpio_lines.end()) return static_cast<int>(at - gpio_lines.begin());
  return Error{ErrorCode::unknown_name, fmt::format("no line of the chip is called '{}'", name),
               "see BENCH_GPIO_LINES"};
}

Result<InputWire> InputWire::open(const BenchPlaces& places, std::string_view line) {
  SYMRIG_TRY(const int offset, places.line(line));
  SYMRIG_TRY(Fd file, open_to_write(fmt::format("{}/sim_gpio{}/pull", places.gpio_sysfs, offset)));
  return InputWire(std::move(file), std::string(line));
}

Result<Moment> InputWire::pull(bool high) const {
  const std::string_view word = high ? "pull-up" : "pull-down";
  const Nanoseconds before = steady_now();
  const ssize_t written = ::pwrite(file_.get(), word.data(), word.size(), 0);
  const Nanoseconds after = steady_now();
  if (written != static_cast<ssize_t>(word.size()))
    return system_error(fmt::format("cannot set the line {}", name_), "");
  return Moment{before + (after - before) / 2, (after - before + Nanoseconds{1}) / 2};
}

Result<CameraPort> CameraPort::open(const std::string& path) {
  SYMRIG_TRY(Fd file, open_to_write(path));
  return CameraPort(std::move(file));
}

Result<CameraPort::Taken> CameraPort::deliver(const Head& head, std::span<const std::uint8_t> pixels) {
  const testcam_frame injected{static_cast<std::uint64_t>(head.stamp.count()), head.skip,
                               head.damaged ? TESTCAM_DAMAGED : 0};
  buffer_.resize(sizeof injected + pixels.size());
  std::memcpy(buffer_.data(), &injected, sizeof injected);
  std::ranges::copy(pixels, buffer_.begin() + sizeof injected);
  if (::write(file_.get(), buffer_.data(), buffer_.size()) == static_cast<ssize_t>(buffer_.size()))
    return Taken::yes;
  if (errno == EPIPE) return Taken::not_streaming;
  if (errno == ENODEV) return Taken::unplugged;
  if (errno == EMSGSIZE)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the host has set a format whose frames are not {} bytes", pixels.size()),
                 "make --picture and camera.size of the rig file equal"};
  return system_error("the test camera refuses a frame", "");
}

Result<CameraState> CameraPort::state() const {
  testcam_state state{};
  if (::ioctl(file_.get(), TESTCAM_GET_STATE, &state) != 0)  // NOLINT(cppcoreguidelines-pro-type-vararg)
    return system_error("cannot read the test camera's state", "check that its module is from this tree");
  return CameraState{state.plugged != 0, state.streaming != 0, state.stamp_is_start != 0,
                     state.trigger == kTriggerIsPulse, state.pixelformat == V4L2_PIX_FMT_Y12};
}

Result<void> CameraPort::plug(bool in) const {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-vararg)
  if (::ioctl(file_.get(), in ? TESTCAM_PLUG : TESTCAM_UNPLUG) == 0) return {};
  return system_error(in ? "cannot plug in the test camera" : "cannot unplug the test camera", "");
}

Result<void> set_priority(int priority) {
  sched_param parameter{};
  parameter.sched_priority = priority;
  errno = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  if (errno != 0) return system_error("no real-time priority", "needs root in the guest");
  return {};
}

Result<Moment> pull_undisturbed(const InputWire& wire, bool high, int usual) {
  constexpr int kAboveAll = 60;  // the kernel's threaded interrupts and the board's player have 50
  SYMRIG_CHECK(set_priority(kAboveAll));
  auto moment = wire.pull(high);
  SYMRIG_CHECK(set_priority(usual));
  return moment;
}

}  // namespace symrig::bench_vm
