// SPDX-License-Identifier: Apache-2.0
#include "line_request.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include <linux/gpio.h>
#include <sys/ioctl.h>

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

}  // namespace symrig::board_linux
