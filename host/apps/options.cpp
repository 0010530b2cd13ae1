// SPDX-License-Identifier: Apache-2.0

#include "options.hpp"

#include "symrig/base/text.hpp"
#include "symrig/board/link.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {

namespace {

/// CLI11 has no place for it: a check with a list would write the list into the help, and refuse without the
/// nearest word. An option lives as long as the process, so its address names it.
std::map<const CLI::Option*, std::vector<std::string>>& recorded() {
  static std::map<const CLI::Option*, std::vector<std::string>> words;
  return words;
}

}  // namespace

CLI::Option* takes_words(CLI::Option* option, std::span<const std::string_view> words) {
  std::vector<std::string>& known = recorded()[option];
  known.assign(words.begin(), words.end());
  return option;
}

const std::vector<std::string>& words_of(const CLI::Option& option) {
  static const std::vector<std::string> none;
  const auto found = recorded().find(&option);
  return found == recorded().end() ? none : found->second;
}

namespace {

/// Removes a leading plus sign, which from_chars does not accept.
std::string_view unsigned_text(std::string_view text) {
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  return plus ? text.substr(1) : text;
}

template <class T>
std::from_chars_result parse(std::string_view text, T& value) {
  return std::from_chars(text.data(), text.data() + text.size(), value);
}

}  // namespace

std::string whole_number_fault(const std::string& text, long long least, long long most) {
  const std::string_view digits = unsigned_text(text);
  long long value = 0;
  const auto [stop, error] = parse(digits, value);
  const bool whole = stop == digits.data() + digits.size() && error != std::errc::invalid_argument;
  if (!whole) return fmt::format("'{}' is not a whole number", text);
  // The conversion later may read 010 as eight.
  const std::string_view figures = digits.substr(digits[0] == '-' ? 1 : 0);
  if (figures.size() > 1 && figures[0] == '0')
    return fmt::format("'{}' begins with a zero; remove the zero", text);
  if (error == std::errc{} && value >= least && value <= most) return {};
  const bool small = error == std::errc{} ? value < least : text[0] == '-';
  return fmt::format("'{}' is too {}; give {} to {}", text, small ? "small" : "large", least, most);
}

std::string real_number_fault(const std::string& text) {
  const std::string_view digits = unsigned_text(text);
  double value = 0;
  const auto [stop, error] = parse(digits, value);
  if (stop != digits.data() + digits.size() || error == std::errc::invalid_argument)
    return fmt::format("'{}' is not a number", text);
  if (error == std::errc::result_out_of_range) return fmt::format("'{}' does not fit a 64-bit number", text);
  return std::isfinite(value) ? std::string() : fmt::format("'{}' is not a finite number", text);
}

std::optional<int> plain_number(std::string_view text) {
  int number = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<std::pair<int, int>> two_numbers(std::string_view text, char between) {
  const std::size_t at = text.find(between);
  if (at == std::string_view::npos) return std::nullopt;
  const auto first = plain_number(text.substr(0, at));
  const auto second = plain_number(text.substr(at + 1));
  if (!first || !second) return std::nullopt;
  return std::pair(*first, *second);
}

Result<void> check_effects(const CLI::App& command, std::span<const Idle> options) {
  for (const Idle& one : options)
    if (one.idle && command.count(one.option) > 0)
      return Error{ErrorCode::bad_argument, fmt::format("{} has no effect {}", one.option, one.why),
                   "remove it"};
  return {};
}

void add_device(CLI::App& command, std::string& device) {
  command.add_option("--device", device, "The board: a serial number or its beginning, or a URI (see below)")
      ->type_name("URI|SERIAL");
}

Result<DeviceUri> choose_board(const std::string& device) {
  auto uri = symrig::choose_board(device);
  if (uri || uri.error().code != ErrorCode::device_lost) return uri;
  Error error = uri.error();
  error.hint += "; sim: is the simulated board";
  return error;
}

Result<Board> open_board(const DeviceUri& uri, const BoardOptions& options) {
  SYMRIG_TRY(auto link, open_link(uri));
  return Board::connect(std::move(link), options);
}

Result<Board> open_board(const std::string& device, const BoardOptions& options) {
  SYMRIG_TRY(const auto uri, choose_board(device));
  return open_board(uri, options);
}

void add_memory(CLI::App& command, std::string& memory) {
  command
      .add_option(
          "--memory", memory,
          "Memory to use, such as 4G; what needs more stays on the disk (default: half of what is free)")
      ->type_name("SIZE");
}

Result<std::int64_t> memory_of(const std::string& memory) {
  if (memory.empty()) return std::int64_t{0};
  auto bytes = parse_byte_size(memory);
  if (bytes) return bytes;
  return Error{bytes.error().code, "--memory: " + bytes.error().what, bytes.error().hint};
}

void add_port(CLI::App& command, std::optional<int>& port) {
  takes_number<int>(
      command.add_option("--port", port, "Serve the page on this port of 127.0.0.1 (default: a free one)")
          ->type_name("PORT"));
}

Result<void> check_port(int port) {
  if (port >= 1 && port <= 65535) return {};
  return Error{ErrorCode::bad_argument, fmt::format("--port {} is not in 1 to 65535", port),
               "remove it for a free port"};
}

namespace {

/// Names of the library's options, and of the command's options. No sentence has these otherwise.
constexpr std::array<std::pair<const char*, const char*>, 7> kNames{{
    {"dual_threshold", "--dual-threshold"},
    {"dual_subtracts", "--dual-subtract"},
    {"max_patterns", "--max-patterns"},
    {"max_seconds", "--max-seconds"},
    {"target_error", "--target-error"},
    {"photograph_seconds", "--photograph-seconds"},
    {"fit_seconds", "--fit-seconds"},
}};

/// The same of names that are also plain words.
constexpr std::array<std::pair<const char*, const char*>, 4> kWordNames{{
    {"tolerance", "--tolerance"},
    {"polish", "--polish"},
    {"split", "--split"},
    {"algorithm", "--algorithm"},
}};

/// Names in the next step of an error.
constexpr std::array<std::pair<const char*, const char*>, 5> kHintNames{{
    {"channel", "--channel"},
    {"resume", "--resume"},
    {"check_axis", "--check-axis"},
    {"algorithm", "--algorithm"},
    {"mosaic", "--mosaic"},
}};

std::string in_command_words(const std::string& text,
                             std::span<const std::pair<const char*, const char*>> names) {
  std::string words;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" ,", begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const auto found =
        std::find_if(names.begin(), names.end(), [&word](const auto& name) { return name.first == word; });
    words += found == names.end() ? word : found->second;
    if (end < text.size()) words += text[end];
    begin = end + 1;
  }
  return words;
}

}  // namespace

Error in_command_words(Error error) {
  error.what = in_command_words(in_command_words(error.what, kNames), kWordNames);
  return error;
}

Error hint_in_command_words(Error error) {
  error.what = in_command_words(error.what, kNames);
  error.hint = in_command_words(error.hint, kHintNames);
  return error;
}

Result<void> check_tolerance(const char* option, double value) {
  const auto settings = settings_of({.tolerance = value});
  if (settings) return {};
  Error error = settings.error();
  error.what.replace(0, std::string("tolerance").size(), option);
  return error;
}

}  // namespace symrig::apps
