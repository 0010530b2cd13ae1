// SPDX-License-Identifier: Apache-2.0
#include "gige/gige_camera.hpp"

namespace symrig::gige {

Bytes packed(std::span<const std::uint16_t> codes, std::uint32_t format) {
  Bytes bytes;
  bytes.reserve(2 * codes.size());
  const auto low_first = [&bytes](unsigned value) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  };
  for (std::size_t k = 0; k < codes.size(); ++k) {
    const unsigned code = codes[k];
    if (format == 0x01080001) bytes.push_back(static_cast<std::uint8_t>(code >> 8U));
    if (format == 0x01100003) low_first(code >> 6U);
    if (format == 0x01100005 || format == 0x01100011) low_first(code >> 4U);
    if (format == 0x01100007) low_first(code);
    if ((format == 0x010C0047 || format == 0x010C0006) && k % 2 == 1) {
      const unsigned a = codes[k - 1] >> 4U, b = code >> 4U;
      const bool plain = format == 0x010C0047;
      bytes.push_back(static_cast<std::uint8_t>(plain ? a : a >> 4U));
      bytes.push_back(static_cast<std::uint8_t>(plain ? a >> 8U | b << 4U : (a & 15U) | b << 4U));
      bytes.push_back(static_cast<std::uint8_t>(b >> 4U));
    }
  }
  return bytes;
}

}  // namespace symrig::gige
