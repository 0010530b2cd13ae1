// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_file.hpp"

#include "symrig/base/atomic_file.hpp"
#include "symrig/base/fd.hpp"
#include "tensor/h5_output.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace symrig::tensor::h5 {
namespace {

namespace fs = std::filesystem;

Error cannot_be_written(const fs::path& path, int cause) {
  return {ErrorCode::io, path.string() + ": cannot be written (" + std::strerror(cause) + ")",
          "check the folder, its permissions and the free space"};
}

/// Returns 0, or the errno of what failed.
int sync_file(const fs::path& path) {
  Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  const bool synced = file && ::fsync(file.get()) == 0;
  return synced && file.close() ? 0 : errno;
}

/// Deletes what is left of a file.
struct Leftover {
  fs::path path;
  explicit Leftover(fs::path of) : path(std::move(of)) {}
  Leftover(const Leftover&) = delete;
  Leftover& operator=(const Leftover&) = delete;
  ~Leftover() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

/// Writes a complete file and syncs it to the disk. Returns 0, or the errno of what failed.
int write_new(const fs::path& path, const std::function<bool(hid_t file)>& fill) {
  Output output;
  Handle file = create_file(path, output);
  const bool filled = file.ok() && fill(file.id());
  const bool closed = file.close();
  if (output.cause != 0) return output.cause;
  return filled && closed ? sync_file(path) : EIO;
}

Result<void> readable(const fs::path& path, const FileWords& words) {
  auto can = check_readable(path);
  if (can) return can;
  std::error_code unknown;
  if (can.error().code == ErrorCode::not_found)
    return Error{ErrorCode::not_found, can.error().what, std::string(words.make_one)};
  if (fs::exists(path, unknown) && !fs::is_regular_file(path, unknown))
    return Error{ErrorCode::bad_format, can.error().what, std::string(words.name_one)};
  return can;
}

/// Whether an error of the library, which has just failed, contains these words.
bool library_says(std::string_view words) {
  std::pair<std::string_view, bool> search{words, false};
  const auto look = [](unsigned, const H5E_error2_t* error, void* found) -> herr_t {
    auto& [sought, is_there] = *static_cast<std::pair<std::string_view, bool>*>(found);
    if (error->desc != nullptr && std::string_view(error->desc).find(sought) != std::string_view::npos)
      is_there = true;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look, &search);
  return search.second;
}

/// Why the system refuses the lock that reading needs: an errno; 0 if it grants it.
int refusal_of_lock(const fs::path& path) {
  const Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return !file || ::flock(file.get(), LOCK_SH | LOCK_NB) == 0 ? 0 : errno;
}

/// The library locks a file while it is open. A lock that has just gone was another program's too.
Error not_locked(const fs::path& path) {
  const int cause = refusal_of_lock(path);
  if (cause == 0 || cause == EWOULDBLOCK)
    return {ErrorCode::io, path.string() + ": is in use: another program has it open for writing",
            "close it there (h5py: file.close()), and run this again"};
  return {ErrorCode::io, path.string() + ": cannot be locked for reading (" + std::strerror(cause) + ")",
          "copy it to a local disk, or set HDF5_USE_FILE_LOCKING=FALSE if no program writes to it"};
}

/// The reason why HDF5 did not open a readable file. It is called right after that.
Error not_opened(const fs::path& path, std::uint64_t bytes, const FileWords& words) {
  const bool no_lock = library_says("unable to lock file");
  if (library_says("already open for write"))
    return {ErrorCode::io,
            path.string() +
                ": is marked as open for writing: a program has it open, or ended before it closed it",
            "close it there; if no program has it open, h5clear -s removes the mark"};
  if (bytes == 0) return {ErrorCode::bad_format, path.string() + ": is empty", std::string(words.make_again)};
  if (H5Fis_hdf5(path.c_str()) <= 0)
    return {ErrorCode::bad_format,
            path.string() + ": is not an HDF5 file, so it is not " + std::string(words.content),
            std::string(words.name_one)};
  if (no_lock) return not_locked(path);
  return {ErrorCode::bad_format,
          path.string() + ": is an HDF5 file, but cut short or damaged (" + std::to_string(bytes) + " bytes)",
          "copy it again from its source, or " + std::string(words.make_again)};
}

}  // namespace

std::recursive_mutex& library_mutex() {
  static std::recursive_mutex mutex;
  return mutex;
}

Result<Source> open_file(const fs::path& path, const FileWords& words) {
  be_quiet();
  SYMRIG_CHECK(readable(path, words));
  std::error_code failed;
  const std::uint64_t bytes = fs::file_size(path, failed);
  Source source{Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose), bytes};
  if (!source.file.ok()) return not_opened(path, bytes, words);
  return source;
}

Result<void> write_file(const fs::path& path, const std::function<bool(hid_t file)>& fill) {
  const std::scoped_lock lock(library_mutex());
  be_quiet();
  SYMRIG_TRY(const fs::path target, replaceable_file(path));
  const fs::path temporary = temporary_name(target);
  // With a full disk, a part of the file may remain, even if HDF5 could not begin. fill() may throw.
  const Leftover leftover{temporary};
  if (const int cause = write_new(temporary, fill); cause != 0) return cannot_be_written(path, cause);
  return replace_file(temporary, target);
}

}  // namespace symrig::tensor::h5
