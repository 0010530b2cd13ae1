// SPDX-License-Identifier: Apache-2.0
#include "chip_lines.hpp"

#include <memory>

#include <gpiod.h>

namespace symrig::board_linux {
namespace {

struct Close {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
  void operator()(gpiod_chip_info* info) const { gpiod_chip_info_free(info); }
  void operator()(gpiod_line_info* info) const { gpiod_line_info_free(info); }
};

std::string text(const char* words) {
  return words != nullptr ? words : "";
}

}  // namespace

std::optional<std::vector<LineInfo>> chip_lines(const std::string& path) {
  const std::unique_ptr<gpiod_chip, Close> chip(gpiod_chip_open(path.c_str()));
  if (!chip) return std::nullopt;
  const std::unique_ptr<gpiod_chip_info, Close> about(gpiod_chip_get_info(chip.get()));
  if (!about) return std::nullopt;
  std::vector<LineInfo> lines;
  for (unsigned offset = 0; offset < gpiod_chip_info_get_num_lines(about.get()); ++offset) {
    const std::unique_ptr<gpiod_line_info, Close> line(gpiod_chip_get_line_info(chip.get(), offset));
    if (!line) return std::nullopt;
    lines.push_back({text(gpiod_line_info_get_name(line.get())),
                     text(gpiod_line_info_get_consumer(line.get())), gpiod_line_info_is_used(line.get())});
  }
  return lines;
}

}  // namespace symrig::board_linux
