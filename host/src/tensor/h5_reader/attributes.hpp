// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/datatype.hpp"
#include "tensor/h5_reader/object_header.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::tensor::h5 {

struct Attribute {
  Datatype type;
  Space space;
  std::vector<std::uint8_t> data;  ///< all values of its space, as stored
};

/// Nothing: the object has none of this name.  fails: bad_format.
Result<std::optional<Attribute>> find_attribute(const FileBytes& file, const Header& header,
                                                std::string_view name);

}  // namespace symrig::tensor::h5
