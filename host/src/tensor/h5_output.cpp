// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_write.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <type_traits>

#include <fcntl.h>
#include <unistd.h>

#if H5_VERS_MAJOR > 1 || H5_VERS_MINOR > 12
#include <H5FDdevelop.h>
#endif

namespace symrig::tensor::h5 {
namespace {

/// The library's part comes first, so that a pointer to it is one to the whole.
struct OutputFile {
  H5FD_t library;
  Output* output;
  int file;
  haddr_t allocated;  ///< end of what the library has given to its objects
  haddr_t written;    ///< end of the file
};
static_assert(std::is_standard_layout_v<OutputFile>);

OutputFile& of(H5FD_t* file) {
  return *reinterpret_cast<OutputFile*>(file);
}
const OutputFile& of(const H5FD_t* file) {
  return *reinterpret_cast<const OutputFile*>(file);
}

/// true: the file may be wrong from now on.
bool failed(const OutputFile& one) {
  return one.output->cause != 0;
}

void fail(OutputFile& one) {
  if (!failed(one)) one.output->cause = errno;
}

H5FD_t* open_output(const char* name, unsigned flags, hid_t access, haddr_t /*most*/) {
  if ((flags & H5F_ACC_CREAT) == 0) return nullptr;  // the library first asks whether the file exists
  Output* const output = *static_cast<Output* const*>(H5Pget_driver_info(access));
  const int file = ::open(name, O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0666);
  if (file >= 0) return &(new OutputFile{{}, output, file, 0, 0})->library;
  output->cause = errno;
  return nullptr;
}

herr_t close_output(H5FD_t* file) {
  const std::unique_ptr<OutputFile> one(&of(file));
  if (::close(one->file) != 0) fail(*one);
  return 0;
}

herr_t write_output(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t at, std::size_t size,
                    const void* from) {
  OutputFile& one = of(file);
  for (std::size_t done = 0; done < size && !failed(one);) {
    const ::ssize_t count = ::pwrite(one.file, static_cast<const char*>(from) + done, size - done,
                                     static_cast<::off_t>(at + done));
    if (count < 0 && errno != EINTR) fail(one);
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  one.written = std::max(one.written, at + size);
  return 0;
}

/// What was never written reads as zeros.
herr_t read_output(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t at, std::size_t size,
                   void* to) {
  const OutputFile& one = of(file);
  if (failed(one)) return -1;
  for (std::size_t done = 0; done < size;) {
    char* const rest = static_cast<char*>(to) + done;
    const ::ssize_t count = ::pread(one.file, rest, size - done, static_cast<::off_t>(at + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return -1;
    if (count == 0) std::memset(rest, 0, size - done);
    done = count == 0 ? size : done + static_cast<std::size_t>(count);
  }
  return 0;
}

/// The file ends where the objects end.
herr_t truncate_output(H5FD_t* file, hid_t /*transfer*/, hbool_t /*closing*/) {
  OutputFile& one = of(file);
  if (one.written == one.allocated) return 0;
  if (!failed(one) && ::ftruncate(one.file, static_cast<::off_t>(one.allocated)) != 0) fail(one);
  one.written = one.allocated;
  return 0;
}

herr_t features(const H5FD_t* /*file*/, unsigned long* flags) {
  // No reading of metadata: it is in memory.
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA_WRITE | H5FD_FEAT_DATA_SIEVE |
           H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
  return 0;
}

int compare(const H5FD_t* a, const H5FD_t* b) {
  return of(a).file < of(b).file ? -1 : of(a).file > of(b).file ? 1 : 0;
}

H5FD_class_t driver_class() {
  constexpr haddr_t kMostBytes = (haddr_t{1} << 63) - 1;
  constexpr H5FD_mem_t kOneKind[] = H5FD_FLMAP_DICHOTOMY;
  H5FD_class_t driver{};
#if H5_VERS_MAJOR > 1 || H5_VERS_MINOR > 12
  driver.version = H5FD_CLASS_VERSION;
  driver.value = static_cast<H5FD_class_value_t>(0x5359);  // any number from 512 on that no other driver has
#endif
  driver.name = "symrig_output";
  driver.maxaddr = kMostBytes;
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.fapl_size = sizeof(void*);  // of the pointer to Output
  driver.open = open_output;
  driver.close = close_output;
  driver.cmp = compare;
  driver.query = features;
  driver.get_eoa = [](const H5FD_t* file, H5FD_mem_t) { return of(file).allocated; };
  driver.set_eoa = [](H5FD_t* file, H5FD_mem_t, haddr_t end) -> herr_t {
    of(file).allocated = end;
    return 0;
  };
  driver.get_eof = [](const H5FD_t* file, H5FD_mem_t) { return of(file).written; };
  driver.read = read_output;
  driver.write = write_output;
  driver.truncate = truncate_output;
  std::copy(std::begin(kOneKind), std::end(kOneKind), std::begin(driver.fl_map));
  return driver;
}

/// Nothing is written and read again before the file is closed.
void keep_metadata(hid_t access) {
  H5AC_cache_config_t cache{};
  cache.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  if (H5Pget_mdc_config(access, &cache) < 0) return;
  cache.evictions_enabled = false;
  cache.incr_mode = H5C_incr__off;
  cache.flash_incr_mode = H5C_flash_incr__off;
  cache.decr_mode = H5C_decr__off;
  H5Pset_mdc_config(access, &cache);
}

}  // namespace

Handle create_file(const std::filesystem::path& path, Output& output) {
  static const H5FD_class_t how = driver_class();
  const Handle driver(H5FDregister(&how), H5FDunregister);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Metadata with checksums needs the library's newer file layout (HDF5 ≥ 1.10).
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  keep_metadata(access.id());
  Output* const at = &output;
  H5Pset_driver(access.id(), driver.id(), static_cast<const void*>(&at));
  return {H5Fcreate(path.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, access.id()), H5Fclose};
}

}  // namespace symrig::tensor::h5
