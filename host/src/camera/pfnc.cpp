// SPDX-License-Identifier: Apache-2.0
#include "camera/pfnc.hpp"

#include <algorithm>
#include <array>

namespace symrig::camera {
namespace {

using enum Mosaic;
using enum Packing;

constexpr auto kPfnc = std::to_array<PixelFormat>({
    {0x01100007, "Mono16", 16, words, none},
    {0x0110002F, "BayerRG16", 16, words, rggb},
    {0x0110002E, "BayerGR16", 16, words, grbg},
    {0x01100030, "BayerGB16", 16, words, gbrg},
    {0x01100031, "BayerBG16", 16, words, bggr},
    {0x01100025, "Mono14", 14, words, none},
    {0x01100005, "Mono12", 12, words, none},
    {0x010C0047, "Mono12p", 12, lowest12, none},
    {0x010C0006, "Mono12Packed", 12, gev12, none},
    {0x01100011, "BayerRG12", 12, words, rggb},
    {0x01100010, "BayerGR12", 12, words, grbg},
    {0x01100012, "BayerGB12", 12, words, gbrg},
    {0x01100013, "BayerBG12", 12, words, bggr},
    {0x010C0059, "BayerRG12p", 12, lowest12, rggb},
    {0x010C0057, "BayerGR12p", 12, lowest12, grbg},
    {0x010C0055, "BayerGB12p", 12, lowest12, gbrg},
    {0x010C0053, "BayerBG12p", 12, lowest12, bggr},
    {0x010C002B, "BayerRG12Packed", 12, gev12, rggb},
    {0x010C002A, "BayerGR12Packed", 12, gev12, grbg},
    {0x010C002C, "BayerGB12Packed", 12, gev12, gbrg},
    {0x010C002D, "BayerBG12Packed", 12, gev12, bggr},
    {0x01100003, "Mono10", 10, words, none},
    {0x010A0046, "Mono10p", 10, lowest10, none},
    {0x010C0004, "Mono10Packed", 10, gev10, none},
    {0x0110000D, "BayerRG10", 10, words, rggb},
    {0x0110000C, "BayerGR10", 10, words, grbg},
    {0x0110000E, "BayerGB10", 10, words, gbrg},
    {0x0110000F, "BayerBG10", 10, words, bggr},
    {0x010A0058, "BayerRG10p", 10, lowest10, rggb},
    {0x010A0056, "BayerGR10p", 10, lowest10, grbg},
    {0x010A0054, "BayerGB10p", 10, lowest10, gbrg},
    {0x010A0052, "BayerBG10p", 10, lowest10, bggr},
    {0x010C0027, "BayerRG10Packed", 10, gev10, rggb},
    {0x010C0026, "BayerGR10Packed", 10, gev10, grbg},
    {0x010C0028, "BayerGB10Packed", 10, gev10, gbrg},
    {0x010C0029, "BayerBG10Packed", 10, gev10, bggr},
    {0x01080001, "Mono8", 8, bytes, none},
    {0x01080009, "BayerRG8", 8, bytes, rggb},
    {0x01080008, "BayerGR8", 8, bytes, grbg},
    {0x0108000A, "BayerGB8", 8, bytes, gbrg},
    {0x0108000B, "BayerBG8", 8, bytes, bggr},
});

}  // namespace

std::span<const PixelFormat> genicam_formats() {
  return kPfnc;
}

const PixelFormat* find_genicam_format(std::string_view name) {
  const auto* const found = std::ranges::find(kPfnc, name, &PixelFormat::name);
  return found == kPfnc.end() ? nullptr : found;
}

}  // namespace symrig::camera
