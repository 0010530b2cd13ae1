// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/raw_matrix.hpp"
#include "tensor/h5_file.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

namespace symrig::sim {
namespace {

namespace h5 = tensor::h5;

using h5::Dataset;
using h5::Object;

/// A data set of the file's root that may be T.
struct DataSet {
  std::string name;
  Dataset values;
  std::vector<std::int64_t> shape;  ///< as stored

  bool numeric() const {
    return values.type().kind == h5::TypeKind::real || values.type().kind == h5::TypeKind::integer;
  }
  /// 64-bit floats, or integers.
  bool wide() const {
    return values.type().kind == h5::TypeKind::integer || values.type().size > sizeof(float);
  }
};

/// What a file has in its root.
struct Content {
  std::vector<DataSet> data_sets;  ///< of two or four dimensions
  /// Why one that could be T is none: a group of MATLAB (sparse matrices, cells and structures), or stored in
  /// a way that is not read here.
  std::vector<std::pair<std::string, Error>> others;
};

std::optional<DataSet> data_set(const std::string& name, Dataset values) {
  const std::size_t rank = values.shape().size();
  if (rank != 2 && rank != 4) return std::nullopt;
  DataSet found{.name = name, .values = std::move(values), .shape = {}};
  for (const std::uint64_t size : found.values.shape())
    found.shape.push_back(static_cast<std::int64_t>(std::min(size, std::uint64_t{1} << 40)));
  return found;
}

Error is_no_matrix(const std::string& name, const std::string& why, std::string hint) {
  return {ErrorCode::bad_format, name + " " + why, std::move(hint)};
}

Result<void> add(const std::string& name, const Object& object, Content& content) {
  static const std::string kHint = "give a file whose data set T is a matrix of floats";
  if (!object.is_dataset()) {
    SYMRIG_TRY(const auto sparse, object.attribute("MATLAB_sparse"));
    content.others.emplace_back(
        name, is_no_matrix(name, sparse ? "is sparse: give full(T)" : "is a group, no matrix", kHint));
    return {};
  }
  auto opened = Dataset::open(object);
  if (!opened) {
    content.others.emplace_back(name, is_no_matrix(name, opened.error().what, opened.error().hint));
  } else if (auto found = data_set(name, *std::move(opened))) {
    content.data_sets.push_back(*std::move(found));
  }
  return {};
}

/// Links to other files are left out, and so is what MATLAB keeps for itself.
Result<Content> content_of_root(const Object& file) {
  SYMRIG_TRY(const auto names, file.names());
  Content content;
  for (const std::string& name : names) {
    if (name.starts_with('#')) continue;
    auto object = file.find(name);
    if (!object) {
      content.others.emplace_back(name, is_no_matrix(name, object.error().what, object.error().hint));
    } else if (*object) {
      SYMRIG_CHECK(add(name, **object, content));
    }
  }
  return content;
}

/// T, or the only one with the shape of a matrix. Errors get the file's name from h5::read_file.
Result<DataSet> matrix_of(const Content& content) {
  const auto is_t = [](const auto& name) { return name == "T"; };
  for (const DataSet& one : content.data_sets)
    if (is_t(one.name)) return one;
  for (const auto& [name, why] : content.others)
    if (is_t(name)) return why;
  std::vector<DataSet> found;
  std::copy_if(content.data_sets.begin(), content.data_sets.end(), std::back_inserter(found),
               [](const DataSet& one) { return one.numeric() && is_matrix_shape(one.shape); });
  if (found.size() == 1) return found.front();
  if (found.empty() && !content.others.empty()) return content.others.front().second;
  return Error{ErrorCode::bad_format,
               found.empty() ? "it holds no matrix" : "it holds several matrices, none of the name T",
               "give a file whose data set T is a matrix of floats"};
}

template <class T>
Result<std::vector<std::byte>> read_numbers(const DataSet& found, std::size_t count) {
  std::vector<std::byte> bytes(count * sizeof(T));
  const auto rows = static_cast<std::uint64_t>(found.shape.front());
  auto read = found.values.read(0, rows, h5::conversion<T>(), bytes.data(), count);
  if (!read) return is_no_matrix(found.name, read.error().what, read.error().hint);
  return bytes;
}

/// The picture's size that a MAT file states; 0x0: none.
Result<Grid> stated_in(const Content& content) {
  for (const char* name : {"light_size", "photo_size"})
    for (const DataSet& one : content.data_sets) {
      if (one.name != name || !one.numeric() || one.shape.size() != 2 || one.shape[0] * one.shape[1] != 2)
        continue;
      std::array<double, 2> size{};
      SYMRIG_TRY(const auto bytes, read_numbers<double>(one, size.size()));
      std::memcpy(size.data(), bytes.data(), bytes.size());
      return stated_size(size[0], size[1], name);
    }
  return Grid{};
}

Result<RawMatrix> read_root(const Object& file, bool matlab) {
  SYMRIG_TRY(const Content content, content_of_root(file));
  SYMRIG_TRY(const DataSet found, matrix_of(content));
  if (!found.numeric()) return Error{ErrorCode::bad_format, found.name + " holds no real numbers"};
  if (!is_matrix_shape(found.shape))
    return RawMatrix{.shape = found.shape};  // the caller says what is wrong with it
  const std::uint64_t count = h5::count(found.values.shape());
  // Filters make at most about a thousand bytes of one, and zeros may not be stored at all.
  constexpr std::uint64_t kMostRatio = 1100, kSlack = 1 << 16;
  if (count > kMostRatio * (file.file().size() + kSlack))
    return Error{ErrorCode::bad_format, found.name + " claims more numbers than the file can hold"};
  RawMatrix raw{.type = found.wide() ? NumberType::f64 : NumberType::f32,
                .shape = found.shape,
                .columns_first = matlab,
                .matlab_pixels = matlab};
  if (matlab) {
    std::reverse(raw.shape.begin(), raw.shape.end());
    SYMRIG_TRY(raw.grid, stated_in(content));
  }
  SYMRIG_TRY(raw.bytes,
             found.wide() ? read_numbers<double>(found, count) : read_numbers<float>(found, count));
  return raw;
}

}  // namespace

Result<RawMatrix> read_hdf(const std::filesystem::path& file, bool matlab) {
  static constexpr h5::FileWords kWords{.content = "a matrix",
                                        .name_one = "give an HDF5 file with a data set T",
                                        .make_one = "give an HDF5 file with a data set T",
                                        .make_again = "write it again"};
  return h5::read_file(file, kWords, [matlab](const Object& root) { return read_root(root, matlab); });
}

}  // namespace symrig::sim
