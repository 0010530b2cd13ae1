// SPDX-License-Identifier: Apache-2.0
// HDF5 files of symrig: written atomically, and opened with errors that say what to do.
#pragma once

#include "symrig/base/result.hpp"
#include "tensor/h5.hpp"
#include "tensor/h5_read.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace symrig::tensor::h5 {

/// What messages say of a kind of file.
struct FileWords {
  std::string_view content;     ///< "a scene"
  std::string_view name_one;    ///< what to do if another file was named
  std::string_view make_one;    ///< what to do if there is none
  std::string_view make_again;  ///< what to do if it is damaged
};

/// Opens a file to read it: its root. A lock keeps other programs from writing as long as it is open.
/// fails: not_found; io (also: another program has it open for writing); bad_format (not HDF5, or damaged).
Result<Object> open_file(const std::filesystem::path& path, const FileWords& words);

/// Fills a new file, syncs it to the disk, and puts it in the place of the old one. `fill` returns false if
/// the library failed. After a failure, the old file is as it was.
/// fails: io, not_found.
Result<void> write_file(const std::filesystem::path& path, const std::function<bool(hid_t file)>& fill);

/// Opens a file, reads it with `read`, and puts its path before each error of that. An error without a hint
/// gets one.
template <class Read>
auto read_file(const std::filesystem::path& path, const FileWords& words, Read read)
    -> decltype(read(std::declval<const Object&>())) {
  SYMRIG_TRY(const Object root, open_file(path, words));
  auto content = read(root);
  if (content) return content;
  Error error = std::move(content).error();
  error.what = path.string() + ": " + error.what;
  if (error.hint.empty())
    error.hint = std::string("the file is damaged or not ")
                     .append(words.content)
                     .append("; ")
                     .append(words.make_again);
  return error;
}

}  // namespace symrig::tensor::h5
