// SPDX-License-Identifier: Apache-2.0
#include "mutators.hpp"

#include <cstdint>
#include <cstring>
#include <vector>

#include <fmt/format.h>
#include <hdf5.h>

namespace symrig::structured {
namespace {

/// A number or a text of the file.
struct Place {
  std::string object;     ///< path of the group or dataset
  std::string attribute;  ///< empty: the dataset itself
};

herr_t note_attribute(hid_t, const char* name, const H5A_info_t*, void* to) {
  static_cast<std::vector<std::string>*>(to)->emplace_back(name);
  return 0;
}

herr_t note_object(hid_t file, const char* name, const H5O_info_t* info, void* to) {
  auto& places = *static_cast<std::vector<Place>*>(to);
  if (info->type == H5O_TYPE_DATASET) places.push_back({name, ""});
  std::vector<std::string> attributes;
  const hid_t object = H5Oopen(file, name, H5P_DEFAULT);
  H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, note_attribute, &attributes);
  H5Oclose(object);
  for (const std::string& attribute : attributes) places.push_back({name, attribute});
  return 0;
}

std::vector<Place> places_of(hid_t file) {
  std::vector<Place> places;
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, note_object, &places, H5O_INFO_BASIC);
  return places;
}

/// The values of a dataset or an attribute as the file's own type, and how they lie.
struct Values {
  hid_t type = -1;
  std::vector<hsize_t> shape;
  std::vector<std::uint8_t> bytes;

  std::size_t size() const { return H5Tget_size(type); }
  std::size_t count() const { return bytes.size() / size(); }
  hid_t space() const {
    return shape.empty() ? H5Screate(H5S_SCALAR)
                         : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  }
};

std::vector<hsize_t> shape_of(hid_t space) {
  std::vector<hsize_t> shape(std::max(H5Sget_simple_extent_ndims(space), 0));
  H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  return shape;
}

class Mutator {
 public:
  Mutator(hid_t file, Random& random) : file_(file), random_(random) {}

  std::string one() {
    const std::vector<Place> places = places_of(file_);
    if (places.empty()) return "nothing is left";
    const Place& place = any_of(random_, places);
    const std::string what = fmt::format("{}@{}", place.object, place.attribute);
    if (below(random_, 24) == 0) return remove(place, what);
    if (below(random_, 24) == 0) return double_or_link(place);
    Values values = read(place);
    const std::string did = H5Tget_class(values.type) == H5T_STRING ? text(values) : numbers(values);
    remove(place, what);
    write(place, values);
    H5Tclose(values.type);
    return fmt::format("{} {}", what, did);
  }

 private:
  Values read(const Place& place) const {
    Values values;
    const bool is_dataset = place.attribute.empty();
    const hid_t object = is_dataset ? H5Dopen2(file_, place.object.c_str(), H5P_DEFAULT)
                                    : H5Aopen_by_name(file_, place.object.c_str(), place.attribute.c_str(),
                                                      H5P_DEFAULT, H5P_DEFAULT);
    const hid_t space = is_dataset ? H5Dget_space(object) : H5Aget_space(object);
    values.type = is_dataset ? H5Dget_type(object) : H5Aget_type(object);
    values.shape = shape_of(space);
    values.bytes.resize(values.size() * static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    if (H5Tis_variable_str(values.type) > 0) {  // mutated before: begin anew with an empty text
      H5Tclose(values.type);
      values.type = H5Tcopy(H5T_C_S1);
      values.bytes.assign(1, 0);
    } else if (is_dataset) {
      H5Dread(object, values.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.bytes.data());
    } else {
      H5Aread(object, values.type, values.bytes.data());
    }
    H5Sclose(space);
    is_dataset ? H5Dclose(object) : H5Aclose(object);
    return values;
  }

  std::string remove(const Place& place, const std::string& what) const {
    if (place.attribute.empty())
      H5Ldelete(file_, place.object.c_str(), H5P_DEFAULT);
    else
      H5Adelete_by_name(file_, place.object.c_str(), place.attribute.c_str(), H5P_DEFAULT);
    return fmt::format("without {}", what);
  }

  void write(const Place& place, const Values& values) const {
    const hid_t space = values.space();
    if (place.attribute.empty()) {
      const hid_t made =
          H5Dcreate2(file_, place.object.c_str(), values.type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      if (!values.bytes.empty())
        H5Dwrite(made, values.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.bytes.data());
      H5Dclose(made);
    } else {
      const hid_t made = H5Acreate_by_name(file_, place.object.c_str(), place.attribute.c_str(), values.type,
                                           space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      if (H5Tis_variable_str(values.type) > 0) {
        const char* pointer = reinterpret_cast<const char*>(values.bytes.data());
        H5Awrite(made, values.type, static_cast<const void*>(&pointer));
      } else if (!values.bytes.empty()) {
        H5Awrite(made, values.type, values.bytes.data());
      }
      H5Aclose(made);
    }
    H5Sclose(space);
  }

  std::string numbers(Values& values) {
    switch (below(random_, 10)) {
      case 0:
        return reshape(values);
      case 1:
        return retype(values);
      case 2:
        return copy_value(values);
      default:
        return change_values(values);
    }
  }

  std::string change_values(Values& values) {
    if (values.count() == 0) return "is empty";
    std::string did;
    for (std::uint64_t k = 1 + below(random_, 2); k > 0; --k) did += change_value(values);
    return did;
  }

  std::string change_value(Values& values) {
    const auto at = static_cast<std::size_t>(below(random_, values.count()));
    std::uint8_t* const place = values.bytes.data() + at * values.size();
    const bool whole = H5Tget_class(values.type) == H5T_INTEGER;
    const hid_t native = whole ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE;
    std::uint64_t buffer[4] = {};  // conversion goes on in place
    std::memcpy(buffer, place, values.size());
    H5Tconvert(values.type, native, 1, buffer, nullptr, H5P_DEFAULT);
    std::string told;
    if (whole) {
      std::int64_t value = 0;
      std::memcpy(&value, buffer, sizeof value);
      value = other_integer(random_, value);
      std::memcpy(buffer, &value, sizeof value);
      told = std::to_string(value);
    } else {
      double value = 0;
      std::memcpy(&value, buffer, sizeof value);
      value = other_real(random_, value);
      std::memcpy(buffer, &value, sizeof value);
      told = std::to_string(value);
    }
    H5Tconvert(native, values.type, 1, buffer, nullptr, H5P_DEFAULT);
    std::memcpy(place, buffer, values.size());
    return fmt::format("[{}] = {} ", at, told);
  }

  std::string copy_value(Values& values) {
    if (values.count() < 2) return "has one value";
    const auto from = static_cast<std::size_t>(below(random_, values.count())),
               to = static_cast<std::size_t>(below(random_, values.count()));
    std::memmove(values.bytes.data() + to * values.size(), values.bytes.data() + from * values.size(),
                 values.size());
    return fmt::format("[{}] = [{}]", to, from);
  }

  std::string reshape(Values& values) {
    const std::vector<std::uint8_t> old = values.bytes;
    if (values.shape.empty() || below(random_, 6) == 0)
      values.shape.push_back(1 + below(random_, 2));
    else if (below(random_, 6) == 0)
      values.shape.pop_back();
    else
      values.shape[below(random_, values.shape.size())] +=
          any_of(random_, std::vector<hsize_t>{1, 2, ~hsize_t{0}});
    std::size_t count = 1;
    for (hsize_t& n : values.shape) count *= static_cast<std::size_t>(n = std::min<hsize_t>(n, 4096));
    values.bytes.resize(std::min<std::size_t>(count, 1U << 20U) * values.size());
    if (count > 1U << 20U) values.shape.assign(1, 1U << 20U);
    for (std::size_t k = 0; k < values.bytes.size(); ++k)
      values.bytes[k] = old.empty() ? std::uint8_t{0} : old[k % old.size()];
    return "has another shape";
  }

  std::string retype(Values& values) {
    static const std::vector<hid_t> types{H5T_STD_I8LE,   H5T_STD_U8LE,  H5T_STD_I64LE,
                                          H5T_STD_U64LE,  H5T_STD_I32BE, H5T_IEEE_F32LE,
                                          H5T_IEEE_F64LE, H5T_STD_B32LE, H5T_UNIX_D32LE};
    const hid_t type = H5Tcopy(any_of(random_, types));
    const std::size_t count = values.count();
    std::vector<std::uint8_t> wide(count * std::max<std::size_t>(values.size(), 8));
    std::copy(values.bytes.begin(), values.bytes.end(), wide.begin());
    if (H5Tconvert(values.type, type, count, wide.data(), nullptr, H5P_DEFAULT) < 0)
      std::fill(wide.begin(), wide.end(), std::uint8_t{1});
    wide.resize(count * H5Tget_size(type));
    H5Tclose(values.type);
    values.type = type;
    values.bytes = std::move(wide);
    return fmt::format("has another type {}", below(random_, 2) == 0 ? change_values(values) : "");
  }

  std::string text(Values& values) {
    const std::string old(values.bytes.begin(), values.bytes.end());
    const std::string changed = mutate_text(old.substr(0, old.find('\0')), random_);
    H5Tclose(values.type);
    values.type = H5Tcopy(H5T_C_S1);
    const bool variable = below(random_, 2) == 0;
    H5Tset_size(values.type, variable ? H5T_VARIABLE : changed.size() + 1);
    if (below(random_, 2) == 0) H5Tset_cset(values.type, H5T_CSET_UTF8);
    H5Tset_strpad(values.type, any_of(random_, std::vector<H5T_str_t>{H5T_STR_NULLTERM, H5T_STR_NULLPAD,
                                                                      H5T_STR_SPACEPAD}));
    values.shape.clear();
    values.bytes.assign(changed.begin(), changed.end());
    values.bytes.push_back(0);
    return fmt::format("is a text of {} bytes", changed.size());
  }

  std::string double_or_link(const Place& place) const {
    const std::string to =
        any_of(random_, std::vector<std::string>{"bands/0", "bands/1", "held_out/0", "held_out/1",
                                                 "leaves/exponents", "diagonal/at", "camera_order"});
    H5Ldelete(file_, to.c_str(), H5P_DEFAULT);
    switch (below(random_, 3)) {
      case 0:
        H5Lcreate_external("/dev/zero", "/x", file_, to.c_str(), H5P_DEFAULT, H5P_DEFAULT);
        return fmt::format("{} is in another file", to);
      case 1:
        H5Lcreate_soft(fmt::format("/{}", to).c_str(), file_, to.c_str(), H5P_DEFAULT, H5P_DEFAULT);
        return fmt::format("{} is a link to itself", to);
      default:
        H5Ocopy(file_, place.object.c_str(), file_, to.c_str(), H5P_DEFAULT, H5P_DEFAULT);
        return fmt::format("{} is a copy of {}", to, place.object);
    }
  }

  hid_t file_;
  Random& random_;
};

}  // namespace

std::string mutate_scene(const std::filesystem::path& file, Random& random) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  const hid_t open = H5Fopen(file.c_str(), H5F_ACC_RDWR, access);
  std::string did;
  for (std::uint64_t k = 1 + (below(random, 4) == 0 ? below(random, 3) : 0); k > 0; --k)
    did += fmt::format("{}; ", Mutator(open, random).one());
  H5Fclose(open);
  H5Pclose(access);
  return did;
}

}  // namespace symrig::structured
