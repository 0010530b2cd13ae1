// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_read.hpp"

#include <utility>

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

}  // namespace symrig::tensor::h5
