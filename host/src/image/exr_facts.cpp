// SPDX-License-Identifier: Apache-2.0
#include "image/exr_facts.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <ImfFloatAttribute.h>
#include <ImfStringAttribute.h>

namespace symrig::image {
namespace {

constexpr std::array<std::pair<const char*, std::string PictureFacts::*>, 4> kTexts{{
    {"symrigUnits", &PictureFacts::units},
    {"symrigView", &PictureFacts::view},
    {"symrigLight", &PictureFacts::light},
    {"symrigScene", &PictureFacts::scene},
}};
constexpr const char* kExposure = "symrigExposure";

}  // namespace

void write_facts(const PictureFacts& facts, Imf::Header& header) {
  for (const auto& [name, text] : kTexts)
    if (!(facts.*text).empty()) header.insert(name, Imf::StringAttribute(facts.*text));
  if (facts.exposure) header.insert(kExposure, Imf::FloatAttribute(static_cast<float>(*facts.exposure)));
}

PictureFacts facts_of(const Imf::Header& header) {
  PictureFacts facts;
  for (const auto& [name, text] : kTexts)
    if (const auto* const found = header.findTypedAttribute<Imf::StringAttribute>(name))
      facts.*text = found->value();
  if (const auto* const found = header.findTypedAttribute<Imf::FloatAttribute>(kExposure);
      found != nullptr && std::isfinite(found->value()))
    facts.exposure = static_cast<double>(found->value());
  return facts;
}

}  // namespace symrig::image
