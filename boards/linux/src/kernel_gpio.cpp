// SPDX-License-Identifier: Apache-2.0
#include "kernel_gpio.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace symrig::board_linux {
namespace {

constexpr char kConsumer[] = "symrigd";
constexpr std::uint32_t kEdgesKept = 1024;  // edges buffered by the kernel per request; it may buffer fewer

Result<LineRequest> ask(int chip, const std::vector<ChipLine>& lines, gpio_v2_line_request& request) {
  LineRequest made;
  made.lines = lines;
  for (const ChipLine& line : lines) {
    request.offsets[request.num_lines++] = line.offset;
    made.mask |= 1U << line.line;
  }
  std::memcpy(request.consumer, kConsumer, sizeof kConsumer);
  if (::ioctl(chip, GPIO_V2_GET_LINE_IOCTL, &request) != 0) return Error{ErrorCode::io, std::strerror(errno)};
  made.fd = Fd(request.fd);
  return made;
}

}  // namespace

Result<LineRequest> request_outputs(int chip, const std::vector<ChipLine>& lines, std::uint32_t levels) {
  gpio_v2_line_request request{};
  request.config.flags = GPIO_V2_LINE_FLAG_OUTPUT;
  request.config.num_attrs = 1;
  gpio_v2_line_config_attribute& values = request.config.attrs[0];
  values.attr.id = GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    values.mask |= std::uint64_t{1} << k;
    values.attr.values |= std::uint64_t{levels >> lines[k].line & 1U} << k;
  }
  return ask(chip, lines, request);
}

namespace {

/// One attribute for each kind of bias that a line asks for: it replaces the flags of these lines.
void add_biases(const std::vector<ChipLine>& lines, gpio_v2_line_config& config) {
  constexpr std::pair<Bias, std::uint64_t> kFlags[] = {{Bias::up, GPIO_V2_LINE_FLAG_BIAS_PULL_UP},
                                                       {Bias::down, GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN},
                                                       {Bias::off, GPIO_V2_LINE_FLAG_BIAS_DISABLED}};
  for (const auto& [bias, flag] : kFlags) {
    std::uint64_t mask = 0;
    for (std::size_t k = 0; k < lines.size(); ++k)
      if (lines[k].bias == bias) mask |= std::uint64_t{1} << k;
    if (mask == 0) continue;
    gpio_v2_line_config_attribute& one = config.attrs[config.num_attrs++];
    one.mask = mask;
    one.attr.id = GPIO_V2_LINE_ATTR_ID_FLAGS;
    one.attr.flags = config.flags | flag;
  }
}

}  // namespace

Result<LineRequest> request_inputs(int chip, const std::vector<ChipLine>& lines) {
  gpio_v2_line_request request{};
  request.config.flags =
      GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_EDGE_RISING | GPIO_V2_LINE_FLAG_EDGE_FALLING;
  add_biases(lines, request.config);
  request.event_buffer_size = kEdgesKept;
  return ask(chip, lines, request);
}

namespace {

constexpr std::size_t kEventsAtOnce = 64;

/// Converts the board's word to the bits of a request.
gpio_v2_line_values to_values(const LineRequest& request, std::uint32_t levels,
                              std::uint32_t lines) noexcept {
  gpio_v2_line_values values{};
  for (std::size_t k = 0; k < request.lines.size(); ++k) {
    values.mask |= std::uint64_t{lines >> request.lines[k].line & 1U} << k;
    values.bits |= std::uint64_t{levels >> request.lines[k].line & 1U} << k;
  }
  return values;
}

hal::CapturedEdge to_edge(const LineRequest& request, const gpio_v2_line_event& event) {
  const auto named = std::find_if(request.lines.begin(), request.lines.end(),
                                  [&](const ChipLine& line) { return line.offset == event.offset; });
  return {event.timestamp_ns, named->line, event.id == GPIO_V2_LINE_EVENT_RISING_EDGE};
}

}  // namespace

KernelGpio::KernelGpio(std::vector<LineRequest> outputs, std::vector<LineRequest> inputs)
    : outputs_(std::move(outputs)), inputs_(std::move(inputs)) {
  for (const LineRequest& request : inputs_) {
    ::fcntl(request.fd.get(), F_SETFL, O_NONBLOCK);
    edge_fds_.push_back(request.fd.get());
  }
}

bool KernelGpio::put(std::uint32_t levels, std::uint32_t lines) noexcept {
  bool sound = true;
  for (const LineRequest& request : outputs_) {
    gpio_v2_line_values values = to_values(request, levels, lines);
    if (values.mask == 0) continue;
    sound = ::ioctl(request.fd.get(), GPIO_V2_LINE_SET_VALUES_IOCTL, &values) == 0 && sound;
  }
  return sound;
}

bool KernelGpio::inputs(std::uint32_t& levels) const noexcept {
  levels = 0;
  for (const LineRequest& request : inputs_) {
    gpio_v2_line_values values = to_values(request, 0, UINT32_MAX);
    if (::ioctl(request.fd.get(), GPIO_V2_LINE_GET_VALUES_IOCTL, &values) != 0) return false;
    for (std::size_t k = 0; k < request.lines.size(); ++k)
      if ((values.bits >> k & 1U) != 0) levels |= 1U << request.lines[k].line;
  }
  return true;
}

/// Edges of one chip are in order. PinLog sorts the edges of several chips.
std::size_t KernelGpio::read_edges(std::span<hal::CapturedEdge> out, bool& lost) {
  std::array<gpio_v2_line_event, kEventsAtOnce> events{};
  std::size_t count = 0;
  for (LineRequest& request : inputs_) {
    while (count < out.size()) {
      const std::size_t room = std::min(events.size(), out.size() - count);
      const ssize_t got = ::read(request.fd.get(), events.data(), room * sizeof events[0]);
      if (got <= 0) break;
      const std::size_t taken = static_cast<std::size_t>(got) / sizeof events[0];
      for (std::size_t k = 0; k < taken; ++k) {
        lost = lost || events.at(k).seqno != request.seqno + 1;
        request.seqno = events.at(k).seqno;
        out[count++] = to_edge(request, events.at(k));
      }
      if (taken < room) break;
    }
  }
  return count;
}

}  // namespace symrig::board_linux
