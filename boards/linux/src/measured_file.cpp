// SPDX-License-Identifier: Apache-2.0
// Measured times as text, for people and for the next start.
#include "measure.hpp"
#include "symrig/base/atomic_file.hpp"

#include <array>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <sys/utsname.h>

namespace symrig::board_linux {
namespace {

struct Row {
  const char* name;
  Spread Measured::*spread;
  const char* what;
};
constexpr std::array<Row, 5> kRows{{{"wake", &Measured::wake, "a sleep ends late by"},
                                    {"word", &Measured::word, "a word is late by"},
                                    {"set", &Measured::set, "setting all outputs takes"},
                                    {"nudge", &Measured::nudge, "from an event to its thread"},
                                    {"push", &Measured::push, "queueing one word takes"}}};

std::string kernel() {
  utsname about{};
  return ::uname(&about) == 0 ? about.release : "unknown";
}

double us(std::uint64_t ticks) {
  return static_cast<double>(ticks) / 1000;
}

}  // namespace

std::string measured_text(const Measured& measured, const Abilities& abilities) {
  std::string text = fmt::format("{} sleeps of 0.5 ms, kernel {} (us)      least    median      most\n",
                                 measured.wakes, kernel());
  for (const Row& row : kRows) {
    const Spread& spread = measured.*row.spread;
    text += fmt::format("  {:<42} {:>10.1f}{:>10.1f}{:>10.1f}\n", row.what, us(spread.least),
                        us(spread.median), us(spread.most));
  }
  const board_common::Promise& promise = abilities.promise;
  return text + fmt::format(
                    "so the board promises (us)\n"
                    "  words of at least {:.1f}, each at most {:.1f} late\n"
                    "  the next word {:.1f} after an awaited edge\n"
                    "  stamps of outputs to {:.1f}, of inputs to {:.1f}\n"
                    "  {:.1f} to refill a word, after at most {:.1f}\n",
                    us(promise.min_dwell), us(promise.lateness), us(promise.wait_latency),
                    us(abilities.output_stamp), us(abilities.input_stamp), us(abilities.refill_ticks),
                    us(abilities.poll_ticks));
}

Result<void> save_measured(const std::filesystem::path& path, const Measured& measured) {
  std::string text = fmt::format("{}\n{}\n", kernel(), measured.wakes);
  for (const Row& row : kRows) {
    const Spread& spread = measured.*row.spread;
    text += fmt::format("{} {} {} {}\n", row.name, spread.least, spread.median, spread.most);
  }
  return write_file_atomically(path, text);
}

Measured load_measured(const std::filesystem::path& path) {
  const auto bytes = read_file(path, 4096);
  if (!bytes) return {};
  std::string text;
  for (const std::byte one : *bytes) text.push_back(static_cast<char>(one));
  std::istringstream in(text);
  std::string word;
  Measured out;
  if (!std::getline(in, word) || word != kernel() || !(in >> out.wakes)) return {};
  for (const Row& row : kRows) {
    Spread& spread = out.*row.spread;
    if (!(in >> word >> spread.least >> spread.median >> spread.most) || word != row.name) return {};
  }
  return out;
}

}  // namespace symrig::board_linux
