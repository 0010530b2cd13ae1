// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_file.hpp"

#include "symrig/base/files.hpp"
#include "tensor/h5_write.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace symrig::tensor::h5 {
namespace {

Error broken(const std::string& what, const std::string& name, const std::string& why) {
  return {ErrorCode::bad_format, what + " '" + name + "' " + why, ""};
}

/// Puts the name before an error.
template <class T>
Result<T> named(Result<T> result, const std::string& what, const std::string& name) {
  if (result) return result;
  Error error = std::move(result).error();
  error.what = what + " '" + name + "' " + error.what;
  return error;
}

Result<Attribute> attribute_of(const Object& object, const std::string& name) {
  SYMRIG_TRY(auto found, named(object.attribute(name), "attribute", name));
  if (!found) return broken("attribute", name, "is missing");
  return *std::move(found);
}

/// `expected` numbers.
template <class T>
Result<std::vector<T>> numbers_of(const Object& object, const std::string& name, std::size_t expected) {
  SYMRIG_TRY(const Attribute attribute, attribute_of(object, name));
  const std::uint64_t stored = attribute.space.empty ? 0 : count(attribute.space.size);
  const bool fit = stored == expected && problem_of(attribute.type, conversion<T>()).empty();
  if (!fit)
    return broken("attribute", name,
                  conversion<T>().to_real ? "is not a number"
                                          : "does not have " + std::to_string(expected) + " integers");
  std::vector<T> values(expected);
  conversion<T>().run(attribute.type, attribute.data.data(), expected, values.data());
  return values;
}

}  // namespace

Result<Object> open_group(const Object& place, const std::string& path) {
  SYMRIG_TRY(auto found, named(place.find(path), "group", path));
  if (!found || found->is_dataset()) return broken("group", path, "is missing");
  return *std::move(found);
}

Result<bool> exists(const Object& place, const std::string& path) {
  SYMRIG_TRY(const auto found, named(place.find(path), "group or dataset", path));
  return found.has_value();
}

Result<std::string> read_text(const Object& object, const std::string& name) {
  SYMRIG_TRY(const Attribute attribute, attribute_of(object, name));
  const bool is_text =
      attribute.type.kind == TypeKind::text || attribute.type.kind == TypeKind::variable_text;
  if (!is_text || attribute.space.empty || count(attribute.space.size) != 1)
    return broken("attribute", name, "is not a text");
  return named(text_of(object.file(), attribute), "attribute", name);
}

Result<std::vector<std::int32_t>> read_integers(const Object& object, const std::string& name,
                                                std::size_t expected) {
  return numbers_of<std::int32_t>(object, name, expected);
}

Result<double> read_number(const Object& object, const std::string& name) {
  SYMRIG_TRY(const auto value, numbers_of<double>(object, name, 1));
  return value.front();
}

Result<Grid> read_grid(const Object& object, const std::string& name) {
  SYMRIG_TRY(const std::vector<std::int32_t> size, read_integers(object, name, 2));
  const Grid grid{size[0], size[1]};
  if (!grid.valid()) return broken("attribute", name, "is not a grid of 1 to 2^30 pixels");
  return grid;
}

Result<Dataset> open_dataset(const Object& place, const std::string& name) {
  SYMRIG_TRY(const auto found, named(place.find(name), "dataset", name));
  if (!found) return broken("dataset", name, "is missing");
  return named(Dataset::open(*found), "dataset", name);
}

Result<Shape> shape_of(const Object& place, const std::string& name, std::size_t rank,
                       std::size_t element_bytes) {
  SYMRIG_TRY(const Dataset dataset, open_dataset(place, name));
  const Shape& shape = dataset.shape();
  if (shape.size() != rank)
    return broken("dataset", name, "does not have " + std::to_string(rank) + " dimensions");
  if (count(shape) > dataset.most_bytes() / element_bytes)
    return broken("dataset", name, "claims more bytes than the file has");
  return shape;
}

Result<void> read_rows(const Object& place, const std::string& name, std::uint64_t first, std::uint64_t rows,
                       const Conversion& conversion, void* to, std::uint64_t values) {
  SYMRIG_TRY(const Dataset dataset, open_dataset(place, name));
  auto done = dataset.read(first, rows, conversion, to, values);
  if (done) return done;
  Error error = done.error();
  error.what = "dataset '" + name + "' " + error.what;
  return error;
}

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

Error not_opened(const fs::path& path, std::string_view why, std::string hint) {
  return {ErrorCode::bad_format, path.string() + ": " + std::string(why), std::move(hint)};
}

/// Programs that write lock a file as long as it is open, and so does reading. Where there are no locks, no
/// program has one.
Result<void> lock(const fs::path& path, const Fd& file) {
  const char* const asked = std::getenv("HDF5_USE_FILE_LOCKING");
  if (asked != nullptr && std::string_view(asked) == "FALSE") return {};
  if (::flock(file.get(), LOCK_SH | LOCK_NB) == 0 || errno != EWOULDBLOCK) return {};
  return Error{ErrorCode::io, path.string() + ": is in use: another program has it open for writing",
               "close it there (h5py: file.close()), and run this again"};
}

/// What a program left that did not close the file.
Error marked(const fs::path& path) {
  return {
      ErrorCode::io,
      path.string() + ": is marked as open for writing: a program has it open, or ended before it closed it",
      "close it there; if no program has it open, h5clear -s removes the mark"};
}

}  // namespace

Result<Object> open_file(const fs::path& path, const FileWords& words) {
  SYMRIG_CHECK(readable(path, words));
  Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat facts {};
  if (!file || ::fstat(file.get(), &facts) != 0)
    return Error{ErrorCode::io, path.string() + ": cannot be opened (" + std::strerror(errno) + ")"};
  SYMRIG_CHECK(lock(path, file));
  const auto size = static_cast<std::uint64_t>(facts.st_size);
  if (size == 0) return not_opened(path, "is empty", std::string(words.make_again));
  const auto bytes = std::make_shared<FileBytes>(std::move(file), size);
  const auto begin = bytes->find_signature();
  if (!begin)
    return not_opened(path, "is not an HDF5 file, so it is not " + std::string(words.content),
                      std::string(words.name_one));
  const auto head = bytes->read_superblock(*begin);
  if (head && bytes->superblock().marked) return marked(path);
  auto root = head ? Object::root(bytes) : Result<Object>(head.error());
  if (root) return root;
  return not_opened(path,
                    "is an HDF5 file, but cut short or damaged (" + std::to_string(size) + " bytes): it " +
                        root.error().what,
                    "copy it again from its source, or " + std::string(words.make_again));
}

Result<void> write_file(const fs::path& path, const std::function<bool(hid_t file)>& fill) {
  // Debian's HDF5 is not thread-safe: one file at a time.
  static std::mutex library;
  const std::scoped_lock alone(library);
  be_quiet();
  SYMRIG_TRY(const fs::path target, replaceable_file(path));
  const fs::path temporary = temporary_name(target);
  // With a full disk, a part of the file may remain, even if HDF5 could not begin. fill() may throw.
  const Leftover leftover{temporary};
  if (const int cause = write_new(temporary, fill); cause != 0) return cannot_be_written(path, cause);
  return replace_file(temporary, target);
}

}  // namespace symrig::tensor::h5
