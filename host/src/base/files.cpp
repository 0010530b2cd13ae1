// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/files.hpp"

#include "base/descriptors.hpp"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace symrig {

Fd::Fd(Fd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

Fd& Fd::operator=(Fd&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

Fd::~Fd() {
  close();
}

bool Fd::close() {
  const int fd = std::exchange(fd_, -1);
  return fd < 0 || ::close(fd) == 0;
}

namespace {

namespace fs = std::filesystem;

Error io_error(const fs::path& path, std::string_view what, int error) {
  return {ErrorCode::io,
          path.string() + ": " + std::string(what) + " (" + std::generic_category().message(error) + ")",
          "check the folder, its permissions and the free space"};
}

/// Owns a temporary file and its descriptor. The destructor closes both, and deletes the file unless commit()
/// succeeded.
class TemporaryFile {
 public:
  explicit TemporaryFile(fs::path path)
      : path_(std::move(path)), fd_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (!fd_) return;
    fd_.close();
    if (!committed_) ::unlink(path_.c_str());
  }

  bool is_open() const { return static_cast<bool>(fd_); }

  bool write(std::span<const std::byte> bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_.get(), bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      bytes = bytes.subspan(written);
    }
    return true;
  }

  /// asked: the target as the user named it, for messages.
  Result<void> commit(const fs::path& asked, const fs::path& target) {
    if (::fsync(fd_.get()) != 0) return io_error(asked, "cannot be written", errno);
    SYMRIG_CHECK(replace_file(path_, target));
    committed_ = true;
    return {};
  }

 private:
  fs::path path_;
  Fd fd_;
  bool committed_ = false;
};

/// Makes the rename durable. It is no error if the file system cannot do that.
void sync_folder(const fs::path& target) {
  const Fd folder(::open(base::folder_of(target).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder) ::fsync(folder.get());
}

Error read_error(const fs::path& path, int error) {
  const bool denied = error == EACCES || error == EPERM;
  return {ErrorCode::io, path.string() + ": cannot be read (" + std::generic_category().message(error) + ")",
          denied ? "get permission to read it" : "check the path and the disk"};
}

/// Neither a regular file nor a folder. Such a path is not opened: opening a pipe waits for its other end,
/// and opening a serial port may reset the device behind it.
bool is_special(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

/// Opens a file for reading, unless it is special.
class OpenFile {
 public:
  explicit OpenFile(const fs::path& path)
      : special_(is_special(path)),
        fd_(special_ ? -1 : ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {}

  int fd() const { return fd_.get(); }
  bool special() const { return special_; }

 private:
  bool special_;
  Fd fd_;
};

/// Size in bytes of a file that was just opened. errno must still be that of open().
Result<std::uint64_t> size_of(const fs::path& path, const OpenFile& file) {
  if (file.special())
    return Error{ErrorCode::io, path.string() + ": is not a regular file", "give the name of a file"};
  const int fd = file.fd();
  if (fd < 0 && (errno == ENOENT || errno == ENOTDIR))
    return Error{ErrorCode::not_found, path.string() + ": no such file", "check the path"};
  struct stat status {};
  if (fd < 0 || ::fstat(fd, &status) != 0) return read_error(path, errno);
  if (S_ISDIR(status.st_mode))
    return Error{ErrorCode::io, path.string() + ": is a folder, not a file", "give the name of a file"};
  if (!S_ISREG(status.st_mode))
    return Error{ErrorCode::io, path.string() + ": is not a regular file", "give the name of a file"};
  return static_cast<std::uint64_t>(status.st_size);
}

/// Reads until the end of the file or until `bytes` is full. Returns the number of bytes, or −1.
std::ptrdiff_t read_all(int fd, std::span<std::byte> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(fd, bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return -1;
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return static_cast<std::ptrdiff_t>(done);
}

}  // namespace

Result<fs::path> replaceable_file(const fs::path& path) {
  std::error_code error;
  const fs::path target = base::link_target(path);
  if (target.filename().empty() || fs::is_directory(target, error))
    return Error{ErrorCode::io, path.string() + ": is a folder, not a file", "give the name of a file"};
  const fs::path folder = base::folder_of(target);
  if (!fs::is_directory(folder, error))
    return Error{ErrorCode::not_found, path.string() + ": there is no folder " + folder.string(),
                 "make the folder first"};
  if (fs::exists(fs::symlink_status(target, error)) && !fs::is_regular_file(target, error))
    return Error{ErrorCode::io, path.string() + ": is not a regular file", "give the name of a file"};
  return target;
}

Result<void> replace_file(const fs::path& temporary, const fs::path& target) {
  SYMRIG_TRY(const fs::path file, replaceable_file(target));
  if (::rename(temporary.c_str(), file.c_str()) != 0)
    return io_error(target, "cannot be put in place", errno);
  sync_folder(file);
  return {};
}

fs::path temporary_name(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  return target.parent_path() /
         fmt::format(".{}.{}-{}.tmp", target.filename().string(), ::getpid(), counter++);
}

Result<void> write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  SYMRIG_TRY(const fs::path target, replaceable_file(path));
  TemporaryFile file(temporary_name(target));
  if (!file.is_open() || !file.write(bytes)) return io_error(path, "cannot be written", errno);
  return file.commit(path, target);
}

Result<void> write_file_atomically(const fs::path& path, std::string_view text) {
  return write_file_atomically(path, std::as_bytes(std::span(text)));
}

Result<void> check_readable(const fs::path& path) {
  const OpenFile file(path);
  SYMRIG_TRY([[maybe_unused]] const std::uint64_t size, size_of(path, file));
  return {};
}

Result<std::vector<std::byte>> read_file(const fs::path& path, std::uint64_t max_bytes) {
  const OpenFile file(path);
  SYMRIG_TRY(const std::uint64_t size, size_of(path, file));
  if (size > max_bytes)
    return Error{ErrorCode::limit, path.string() + ": has " + std::to_string(size) + " bytes; at most " +
                                       std::to_string(max_bytes) + " are read"};
  std::vector<std::byte> bytes(size);
  const std::ptrdiff_t got = read_all(file.fd(), bytes);
  if (got < 0) return read_error(path, errno);
  bytes.resize(got);
  return bytes;
}

}  // namespace symrig
