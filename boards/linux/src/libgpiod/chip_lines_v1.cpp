// SPDX-License-Identifier: Apache-2.0
#include "chip_lines.hpp"

#include <memory>

#include <gpiod.h>

namespace symrig::board_linux {
namespace {

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

std::string text(const char* words) {
  return words != nullptr ? words : "";
}

}  // namespace

std::optional<std::vector<LineInfo>> chip_lines(const std::string& path) {
  const std::unique_ptr<gpiod_chip, CloseChip> chip(gpiod_chip_open(path.c_str()));
  if (!chip) return std::nullopt;
  std::vector<LineInfo> lines;
  for (unsigned offset = 0; offset < gpiod_chip_num_lines(chip.get()); ++offset) {
    gpiod_line* line = gpiod_chip_get_line(chip.get(), offset);  // the chip owns it
    if (line == nullptr) return std::nullopt;
    lines.push_back({text(gpiod_line_name(line)), text(gpiod_line_consumer(line)), gpiod_line_is_used(line)});
  }
  return lines;
}

}  // namespace symrig::board_linux
