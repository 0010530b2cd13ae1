// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/appended_file.hpp"

#include "symrig/acquisition/internal/fast_crc32c.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

namespace symrig::acquisition {
namespace {

namespace fs = std::filesystem;

Error io_error(const fs::path& path, const char* what, int error) {
  return {ErrorCode::io, path.string() + ": " + what + " (" + std::generic_category().message(error) + ")",
          "check the folder, its permissions and the free space"};
}

Error open_error(const fs::path& path, int error) {
  if (error == EEXIST)
    return {ErrorCode::bad_argument, path.string() + " is there already", "continue from it, or delete it"};
  if (error == ENOENT || error == ENOTDIR)
    return {ErrorCode::not_found, path.string() + ": no such file or folder", "check the path"};
  if (error == EISDIR)
    return {ErrorCode::io, path.string() + ": is a folder, not a file", "give the name of a file"};
  return io_error(path, "cannot be opened", error);
}

/// Takes what was written off the front.
void advance(std::array<iovec, 2>& parts, std::size_t written) {
  for (iovec& part : parts) {
    const std::size_t step = std::min(written, part.iov_len);
    part.iov_base = static_cast<std::byte*>(part.iov_base) + step;
    part.iov_len -= step;
    written -= step;
  }
}

bool write_all(int fd, std::uint64_t offset, std::array<iovec, 2> parts) {
  while (parts[0].iov_len + parts[1].iov_len > 0) {
    const ssize_t written = ::pwritev(fd, parts.data(), 2, static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    advance(parts, static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
  return true;
}

/// For reading only, whatever its type says.
iovec part_of(std::span<const std::byte> bytes) {
  return {const_cast<std::byte*>(bytes.data()), bytes.size()};  // NOLINT: iovec serves readers and writers
}

}  // namespace

Result<AppendedFile> AppendedFile::create(const fs::path& path) {
  AppendedFile file(path, ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file.fd_) return open_error(path, errno);
  return locked(std::move(file), LOCK_EX);
}

Result<AppendedFile> AppendedFile::open(const fs::path& path) {
  return open_as(path, O_RDWR, LOCK_EX);
}

Result<AppendedFile> AppendedFile::open_to_read(const fs::path& path) {
  return open_as(path, O_RDONLY, LOCK_SH);
}

Result<AppendedFile> AppendedFile::open_as(const fs::path& path, int access, int lock) {
  AppendedFile file(path, ::open(path.c_str(), access | O_CLOEXEC | O_NONBLOCK));
  if (!file.fd_) return open_error(path, errno);
  struct stat status {};
  if (::fstat(file.fd_.get(), &status) != 0) return file.failure("cannot be read");
  if (!S_ISREG(status.st_mode))
    return Error{ErrorCode::io, path.string() + ": is not a regular file", "give the name of a file"};
  SYMRIG_TRY(AppendedFile mine, locked(std::move(file), lock));
  // Only now: another process may have written to it until it let go of the lock.
  if (::fstat(mine.fd_.get(), &status) != 0) return mine.failure("cannot be read");
  mine.size_ = static_cast<std::uint64_t>(status.st_size);
  return mine;
}

Result<AppendedFile> AppendedFile::locked(AppendedFile file, int lock) {
  if (::flock(file.fd_.get(), lock | LOCK_NB) == 0) return file;
  if (errno == EWOULDBLOCK)
    return Error{ErrorCode::io,
                 file.path_.string() + (lock == LOCK_SH ? ": another process is writing to it"
                                                        : ": another process has it open"),
                 "wait until it has finished"};
  return file.failure("cannot be locked");
}

Error AppendedFile::failure(const char* what) const {
  return io_error(path_, what, errno);
}

Result<void> AppendedFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got = ::pread(fd_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure("cannot be read");
    if (got == 0) return Error{ErrorCode::io, path_.string() + ": ends too early", "it was cut by someone"};
    bytes = bytes.subspan(got);
    offset += static_cast<std::uint64_t>(got);
  }
  return {};
}

Result<void> AppendedFile::append(std::span<const std::byte> first, std::span<const std::byte> second) {
  if (!write_all(fd_.get(), size_, {part_of(first), part_of(second)})) {
    const Error error = failure("cannot be written");
    SYMRIG_CHECK(cut(size_));
    return error;
  }
  size_ += first.size() + second.size();
  return {};
}

Result<void> AppendedFile::cut(std::uint64_t size) {
  if (::ftruncate(fd_.get(), static_cast<off_t>(size)) != 0) return failure("cannot be cut");
  size_ = size;
  return {};
}

Result<void> AppendedFile::sync() const {
  if (::fdatasync(fd_.get()) != 0) return failure("cannot be synced to the disk");
  return {};
}

namespace {

constexpr std::array<char, 8> kMagic{'S', 'Y', 'M', 'R', 'L', 'O', 'G', '\n'};
constexpr std::uint32_t kOldest = 1;  // the same, without notes on budgets
constexpr std::uint32_t kCells = 2;   // photographs are floats on the grid of patterns
constexpr std::uint32_t kPacked = 3;  // photographs are a camera's own, and steps follow the text
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

std::uint32_t crc_of(std::string_view text) {
  return fast_crc32c(std::as_bytes(std::span(text)));
}

/// Says which steps they are.
std::string line_of(const Image<float>& steps) {
  return fmt::format("steps {:08x}", fast_crc32c(std::as_bytes(steps.values())));
}

std::string text_of(const LogIdentity& identity) {
  std::string camera, steps;
  if (identity.steps) {
    camera = fmt::format("\ncamera {}", to_string(identity.camera()));
    steps = fmt::format("\n{}", line_of(*identity.steps));
  }
  return fmt::format("grid {}\nchannels {}{}\nrig {}{}\n{}", to_string(identity.grid), identity.channels,
                     camera, one_line(identity.rig), steps, identity.options);
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

/// Bytes of the steps, in which a log of version 3 keeps its photographs.
std::size_t steps_bytes(const Image<float>& steps) {
  return (steps.values().size_bytes() + 7) / 8 * 8;
}

/// Checked but for the text.
Result<Front> read_front(const AppendedFile& file) {
  Front front{};
  if (file.size() < sizeof front) return bad_head(file, "is not a photograph log");
  SYMRIG_CHECK(file.read(0, std::as_writable_bytes(std::span(&front, 1))));
  if (front.magic != kMagic) return bad_head(file, "is not a photograph log");
  if (front.version < kOldest || front.version > kPacked)
    return bad_head(file, "is a photograph log of version " + std::to_string(front.version) +
                              ", this program reads versions " + std::to_string(kOldest) + " to " +
                              std::to_string(kPacked));
  if (front.text_bytes > kLongestText || sizeof front + front.text_bytes > file.size())
    return bad_head(file, "is damaged in its head");
  return front;
}

/// The steps behind the text.
Result<std::shared_ptr<const Image<float>>> read_steps(const AppendedFile& file, const Front& front,
                                                       Grid camera, int channels) {
  const std::uint64_t at = padded_head(front.text_bytes);
  const std::uint64_t bytes = std::uint64_t{4} * static_cast<std::uint64_t>(camera.size()) * channels;
  if (at + bytes > file.size()) return bad_head(file, "is damaged in its head");
  Image<float> steps(camera, channels);
  SYMRIG_CHECK(file.read(at, std::as_writable_bytes(steps.values())));
  const bool sound = std::ranges::all_of(steps.values(), [](float v) { return v > 0 && std::isfinite(v); });
  if (!sound) return bad_head(file, "is damaged in its head");
  return std::make_shared<const Image<float>>(std::move(steps));
}

}  // namespace

std::vector<std::byte> log_head(const LogIdentity& identity) {
  const std::string text = text_of(identity);
  const std::uint32_t version = identity.steps ? kPacked : kCells;
  const Front front{kMagic, version, crc_of(text), text.size()};
  const std::size_t steps_at = padded_head(text.size());
  std::vector<std::byte> head(steps_at + (identity.steps ? steps_bytes(*identity.steps) : 0));
  std::memcpy(head.data(), &front, sizeof front);
  std::memcpy(head.data() + sizeof front, text.data(), text.size());
  if (identity.steps)
    std::memcpy(head.data() + steps_at, identity.steps->values().data(),
                identity.steps->values().size_bytes());
  return head;
}

Result<HeadState> check_log_head(const AppendedFile& file, const LogIdentity& identity) {
  SYMRIG_TRY(const bool torn, is_beginning(file, log_head(identity)));
  if (torn) return HeadState::torn;
  SYMRIG_TRY(const Front front, read_front(file));
  SYMRIG_TRY(const std::string theirs, read_text(file, front));
  const std::string ours = text_of(identity);
  if (theirs != ours) return bad_head(file, "is of another capture: " + difference(theirs, ours));
  if (identity.steps) {
    SYMRIG_TRY(const auto steps, read_steps(file, front, identity.camera(), identity.channels));
    if (*steps != *identity.steps) return bad_head(file, "is damaged in its head");
  }
  return front.version == kOldest ? HeadState::whole_of_version_1 : HeadState::whole;
}

Result<FoundHead> read_log_head(const AppendedFile& file) {
  auto found = [&]() -> Result<FoundHead> {
    SYMRIG_TRY(const Front front, read_front(file));
    SYMRIG_TRY(const std::string text, read_text(file, front));
    FoundHead head{{}, 0, padded_head(front.text_bytes)};
    std::istringstream lines(text);
    std::string grid, channels, camera;
    char by = 0;
    lines >> grid >> head.grid.rows >> by >> head.grid.cols >> channels >> head.channels;
    const bool sound = lines && grid == "grid" && by == 'x' && channels == "channels" && head.grid.valid() &&
                       head.channels >= 1 && head.channels <= kMostChannels;
    if (!sound) return bad_head(file, "is damaged in its head");
    if (front.version != kPacked) return head;
    Grid pixels;
    lines >> camera >> pixels.rows >> by >> pixels.cols;
    if (!lines || camera != "camera" || by != 'x' || !pixels.valid())
      return bad_head(file, "is damaged in its head");
    SYMRIG_TRY(head.steps, read_steps(file, front, pixels, head.channels));
    head.bytes += steps_bytes(*head.steps);
    const std::vector<std::string> facts = lines_of(text);
    if (std::ranges::find(facts, line_of(*head.steps)) == facts.end())
      return bad_head(file, "is damaged in its head");
    return head;
  }();
  if (found) return found;
  Error error = found.error();
  if (error.code == ErrorCode::bad_format) error.hint = "give the log of a capture (capture --keep-log)";
  return error;
}

}  // namespace symrig::acquisition
