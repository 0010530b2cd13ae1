// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/log_head.hpp"

#include "acquisition/log/fast_crc32c.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>
#include <string_view>

namespace symrig::acquisition {
namespace {

constexpr std::array<char, 8> kMagic{'S', 'Y', 'M', 'R', 'L', 'O', 'G', '\n'};
constexpr std::uint32_t kOldest = 1;  // the same, without notes on budgets
constexpr std::uint32_t kVersion = 2;
constexpr std::uint64_t kLongestText = 1 << 20;
constexpr int kMostChannels = 1 << 16;  ///< far beyond any camera

struct Front {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t crc;  ///< of the text
  std::uint64_t text_bytes;
};
static_assert(sizeof(Front) == 24);

/// Without line breaks of its own.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string text_of(const LogIdentity& identity) {
  return "grid " + to_string(identity.grid) + "\nchannels " + std::to_string(identity.channels) + "\nrig " +
         one_line(identity.rig) + "\n" + identity.options;
}

std::uint32_t crc_of(std::string_view text) {
  return fast_crc32c(std::as_bytes(std::span(text)));
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// "it has 'channels 3', this one 'channels 1'": the first line that differs.
std::string difference(const std::string& theirs, const std::string& ours) {
  const auto a = lines_of(theirs), b = lines_of(ours);
  const std::size_t both = std::min(a.size(), b.size());
  std::size_t k = 0;
  while (k < both && a[k] == b[k]) ++k;
  const auto line = [k](const std::vector<std::string>& lines) {
    return k < lines.size() ? "'" + lines[k] + "'" : std::string("nothing");
  };
  return "it has " + line(a) + ", this one " + line(b);
}

Error bad_head(const AppendedFile& file, const std::string& what) {
  return {ErrorCode::bad_format, file.path().string() + ": " + what,
          "delete it to begin anew, or name another output"};
}

Result<std::string> read_text(const AppendedFile& file, const Front& front) {
  std::string text(front.text_bytes, '\0');
  SYMRIG_CHECK(file.read(sizeof front, std::as_writable_bytes(std::span(text))));
  if (crc_of(text) != front.crc) return bad_head(file, "is damaged in its head");
  return text;
}

/// Whether the whole file is a true beginning of `head`.
Result<bool> is_beginning(const AppendedFile& file, std::span<const std::byte> head) {
  if (file.size() >= head.size()) return false;
  std::vector<std::byte> bytes(file.size());
  SYMRIG_CHECK(file.read(0, bytes));
  return std::equal(bytes.begin(), bytes.end(), head.begin());
}

/// Where photographs begin behind a text of so many bytes.
std::size_t padded_head(std::uint64_t text_bytes) {
  return (sizeof(Front) + text_bytes + 7) / 8 * 8;
}

/// Checked but for the text.
Result<Front> read_front(const AppendedFile& file) {
  Front front{};
  if (file.size() < sizeof front) return bad_head(file, "is not a photograph log");
  SYMRIG_CHECK(file.read(0, std::as_writable_bytes(std::span(&front, 1))));
  if (front.magic != kMagic) return bad_head(file, "is not a photograph log");
  if (front.version < kOldest || front.version > kVersion)
    return bad_head(file, "is a photograph log of version " + std::to_string(front.version) +
                              ", this program reads versions " + std::to_string(kOldest) + " to " +
                              std::to_string(kVersion));
  if (front.text_bytes > kLongestText || sizeof front + front.text_bytes > file.size())
    return bad_head(file, "is damaged in its head");
  return front;
}

}  // namespace

std::vector<std::byte> log_head(const LogIdentity& identity) {
  const std::string text = text_of(identity);
  const Front front{kMagic, kVersion, crc_of(text), text.size()};
  std::vector<std::byte> head(padded_head(text.size()));
  std::memcpy(head.data(), &front, sizeof front);
  std::memcpy(head.data() + sizeof front, text.data(), text.size());
  return head;
}

Result<HeadState> check_log_head(const AppendedFile& file, const LogIdentity& identity) {
  SYMRIG_TRY(const bool torn, is_beginning(file, log_head(identity)));
  if (torn) return HeadState::torn;
  SYMRIG_TRY(const Front front, read_front(file));
  SYMRIG_TRY(const std::string theirs, read_text(file, front));
  const std::string ours = text_of(identity);
  if (theirs != ours) return bad_head(file, "is of another capture: " + difference(theirs, ours));
  return front.version == kOldest ? HeadState::whole_of_version_1 : HeadState::whole;
}

Result<FoundHead> read_log_head(const AppendedFile& file) {
  auto found = [&]() -> Result<FoundHead> {
    SYMRIG_TRY(const Front front, read_front(file));
    SYMRIG_TRY(const std::string text, read_text(file, front));
    FoundHead head{{}, 0, padded_head(front.text_bytes)};
    std::istringstream lines(text);
    std::string grid, channels;
    char by = 0;
    lines >> grid >> head.grid.rows >> by >> head.grid.cols >> channels >> head.channels;
    const bool sound = lines && grid == "grid" && by == 'x' && channels == "channels" && head.grid.valid() &&
                       head.channels >= 1 && head.channels <= kMostChannels;
    return sound ? Result<FoundHead>(head) : bad_head(file, "is damaged in its head");
  }();
  if (found) return found;
  Error error = found.error();
  if (error.code == ErrorCode::bad_format) error.hint = "give the log of a capture (capture --keep-log)";
  return error;
}

}  // namespace symrig::acquisition
