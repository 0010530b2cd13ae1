// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/object_header.hpp"

#include <string>
#include <vector>

namespace symrig::tensor::h5 {

struct Link {
  enum class Kind : std::uint8_t { hard, soft, other };  ///< other: to another file

  std::string name;
  Kind kind = Kind::other;
  Address object = kUndefined;  ///< hard links
  std::string path = {};        ///< soft links
};

/// The links of a group, in no order. An object that is no group has none.  fails: bad_format.
Result<std::vector<Link>> links_in(const FileBytes& file, const Header& header);

}  // namespace symrig::tensor::h5
