// SPDX-License-Identifier: Apache-2.0
#include "kept_files.hpp"

#include "symrig/base/files.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

namespace symrig::board_linux {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kRunning = "running\n";
constexpr std::string_view kEnded = "ended\n";

/// "" if the file cannot be read.
std::string text_of(const fs::path& path) {
  const auto bytes = read_file(path, 4096);
  if (!bytes) return {};
  std::string text(bytes->size(), '\0');
  std::transform(bytes->begin(), bytes->end(), text.begin(),
                 [](std::byte one) { return static_cast<char>(one); });
  return text;
}

}  // namespace

std::size_t SettingsFile::load(std::uint8_t* out, std::size_t room) const {
  const auto bytes = read_file(path_, kRoom);
  if (!bytes || bytes->size() > room) return 0;
  std::transform(bytes->begin(), bytes->end(), out,
                 [](std::byte one) { return static_cast<std::uint8_t>(one); });
  return bytes->size();
}

bool SettingsFile::save(const std::uint8_t* bytes, std::size_t size) {
  if (before_) before_();
  const bool kept = size <= kRoom && write_file_atomically(path_, std::as_bytes(std::span(bytes, size))).ok();
  if (after_) after_();
  return kept;
}

hal::FaultRecord FaultFile::load() const {
  hal::FaultRecord record;
  const std::string text = text_of(path_);
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto number = [&](auto& out) {
    const auto [next, error] = std::from_chars(at, end, out);
    at = next != end ? next + 1 : end;
    return error == std::errc();
  };
  if (number(record.code) && number(record.tick) && number(record.arg)) return record;
  return {};
}

void FaultFile::save(const hal::FaultRecord& record) {
  std::error_code ignored;
  if (record.code == 0 && !fs::exists(path_, ignored)) return;
  // An error here is ignored: the host still gets the fault.
  [[maybe_unused]] const auto kept =
      write_file_atomically(path_, fmt::format("{} {} {}\n", record.code, record.tick, record.arg));
}

hal::ResetCause RunMark::begin() {
  const bool cut_off = text_of(path_) == kRunning;
  [[maybe_unused]] const auto noted = write_file_atomically(path_, kRunning);
  return cut_off ? hal::ResetCause::watchdog : hal::ResetCause::power;
}

void RunMark::end_well() {
  [[maybe_unused]] const auto noted = write_file_atomically(path_, kEnded);
}

std::optional<std::uint32_t> SafeLevelsFile::load() const {
  const std::string text = text_of(path_);
  std::uint32_t levels = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), levels, 16);
  if (error != std::errc() || end == text.data()) return std::nullopt;
  return levels;
}

bool SafeLevelsFile::save(std::uint32_t levels) const {
  return write_file_atomically(path_, fmt::format("{:08x}\n", levels)).ok();
}

}  // namespace symrig::board_linux
