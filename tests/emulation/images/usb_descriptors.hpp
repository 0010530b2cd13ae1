// SPDX-License-Identifier: Apache-2.0
// Descriptors of the test device (USB 2.0, 9.6; CDC 1.2; Microsoft OS 2.0).
#pragma once

#include "rp2040.hpp"

namespace descriptors {

using rp::u8;

constexpr u8 kDevice[] = {18, 1, 0x10, 0x02, 0xef, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 3, 1};

constexpr u8 kConfiguration[] = {
    9,  2,    105,  0,    3,    1, 0,    0x80, 50, 9,    4, 0,    0, 3,  0xff, 0,    0,    0,  // vendor
    7,  5,    0x01, 2,    64,   0, 0,    7,    5,  0x81, 2, 64,   0, 0,  7,    5,    0x04, 2,
    64, 0,    0,    8,    11,   1, 2,    2,    2,  0,    0,  // interfaces 1 and 2 belong together
    9,  4,    1,    0,    1,    2, 2,    0,    0,            // CDC control
    5,  0x24, 0,    0x20, 0x01, 5, 0x24, 1,    0,  2,    4, 0x24, 2, 2,  5,    0x24, 6,    1,
    2,  7,    5,    0x82, 3,    8, 0,    16,   9,  4,    2, 0,    2, 10, 0,    0,    0,  // CDC data
    7,  5,    0x03, 2,    64,   0, 0,    7,    5,  0x83, 2, 64,   0, 0,
};
static_assert(sizeof kConfiguration == 105);

constexpr u8 kMsOs20[] = {
    10, 0, 0, 0, 0,   0,   3,   6,   30,  0,                                  // set header, Windows 8.1
    20, 0, 3, 0, 'W', 'I', 'N', 'U', 'S', 'B', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  // compatible id
};
static_assert(sizeof kMsOs20 == 30);

constexpr u8 kObjectStore[] = {
    5,    15,   33,   0,    1,    28,   16,   5,    0, 0xdf, 0x60, 0xdd, 0xd8, 0x89, 0x45, 0xc7, 0x4c,
    0x9c, 0xd2, 0x65, 0x9d, 0x9e, 0x64, 0x8a, 0x9f, 0, 0,    3,    6,    30,   0,    1,    0,
};
static_assert(sizeof kObjectStore == 33);

constexpr u8 kLanguage[] = {4, 3, 9, 4};
constexpr u8 kMaker[] = {14, 3, 's', 0, 'y', 0, 'm', 0, 'r', 0, 'i', 0, 'g', 0};
constexpr u8 kName[] = {20, 3, 't', 0, 'e', 0, 's', 0, 't', 0, ' ', 0, 'u', 0, 'n', 0, 'i', 0, 't', 0};
constexpr u8 kSerial[] = {10, 3, '0', 0, '0', 0, '4', 0, '2', 0};
constexpr const u8* kStrings[] = {kLanguage, kMaker, kName, kSerial};
constexpr u8 kStringCount = 4;

}  // namespace descriptors
