// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/file.hpp"

#include <ImfHeader.h>

namespace symrig::image {

/// The attributes of a header. They throw what OpenEXR throws.
void write_facts(const PictureFacts& facts, Imf::Header& header);
PictureFacts facts_of(const Imf::Header& header);

}  // namespace symrig::image
