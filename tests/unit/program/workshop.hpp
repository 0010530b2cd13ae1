// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "assert_ok.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/program_file.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace symrig::test {

/// What a simulated board says of itself: 8 ns ticks, the default lines.
inline BoardInfo board() {
  BoardInfo info;
  info.board = "sim";
  info.rate = {125'000'000};
  info.lines = {{"projector_trigger", true},
                {"camera_trigger", true},
                {"lamp_enable", true},
                {"vsync", false},
                {"camera_strobe", false}};
  for (LineInfo& line : info.lines) line.stamp_ticks = 1;
  info.lines[3].trips = true;
  info.min_dwell = {5};
  info.max_dwell = {0xFFFFFFFF};
  info.wait_latency = {125};
  info.program_bytes = 196'608;
  info.loop_depth = 4;
  return info;
}

inline ProgramFile parse(std::string_view text) {
  auto file = parse_program_file(text, "scan.toml", "");
  EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().line());
  return file.ok() ? *std::move(file) : ProgramFile{};
}

inline Compilation compile(std::string_view text) {
  return compile_program(parse(text), board());
}

/// The program of a text that must compile.
inline CompiledProgram compiled(std::string_view text) {
  auto out = compile(text);
  std::string all;
  for (const FileFinding& finding : out.findings) all += finding.text("scan.toml") + "\n";
  EXPECT_TRUE(out.ok()) << all;
  return out.ok() ? *std::move(out.program) : CompiledProgram{};
}

/// The first finding of a rule; none: an empty one.
inline FileFinding finding_of(const Compilation& compilation, std::string_view rule) {
  const auto found = std::find_if(compilation.findings.begin(), compilation.findings.end(),
                                  [rule](const FileFinding& finding) { return finding.rule == rule; });
  return found == compilation.findings.end() ? FileFinding{} : *found;
}

}  // namespace symrig::test
