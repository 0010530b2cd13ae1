// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_file.hpp"

#include "symrig/base/atomic_file.hpp"
#include "symrig/base/fd.hpp"

#include <cerrno>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <unistd.h>

namespace symrig::tensor::h5 {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kGrowBy = std::size_t{1} << 16;

Error cannot_be_written(const fs::path& path) {
  return {ErrorCode::io, path.string() + ": cannot be written (" + std::strerror(errno) + ")",
          "check the folder, its permissions and the free space"};
}

/// The file is built in memory and written when it is closed: otherwise a full disk would end the process
/// inside the library. Metadata with checksums needs the library's newer file layout (HDF5 ≥ 1.10).
Handle file_access() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  H5Pset_fapl_core(access.id(), kGrowBy, true);
  return access;
}

bool sync_file(const fs::path& path) {
  Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return false;
  const bool ok = ::fsync(file.get()) == 0;
  return file.close() && ok;
}

/// Writes a complete file and syncs it to the disk.
bool write_new(const fs::path& path, const std::function<bool(hid_t file)>& fill) {
  const Handle access = file_access();
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, access.id()), H5Fclose);
  const bool written = file.ok() && fill(file.id());
  return file.close() && written && sync_file(path);
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

/// The reason why HDF5 did not open a readable file.
Error not_opened(const fs::path& path, std::uint64_t bytes, const FileWords& words) {
  if (bytes == 0) return {ErrorCode::bad_format, path.string() + ": is empty", std::string(words.make_again)};
  if (H5Fis_hdf5(path.c_str()) <= 0)
    return {ErrorCode::bad_format,
            path.string() + ": is not an HDF5 file, so it is not " + std::string(words.content),
            std::string(words.name_one)};
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
  Result<void> done =
      write_new(temporary, fill) ? replace_file(temporary, target) : Result<void>(cannot_be_written(path));
  // With a full disk, a part of the file may remain, even if HDF5 could not begin.
  std::error_code ignored;
  if (!done) fs::remove(temporary, ignored);
  return done;
}

}  // namespace symrig::tensor::h5
