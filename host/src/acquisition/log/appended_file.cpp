// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/appended_file.hpp"

#include <array>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
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

}  // namespace symrig::acquisition
