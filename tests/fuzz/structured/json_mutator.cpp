// SPDX-License-Identifier: Apache-2.0
#include "mutators.hpp"

#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::structured {
namespace {

using Json = nlohmann::ordered_json;

void gather(Json& value, std::vector<Json*>& all) {
  all.push_back(&value);
  if (value.is_structured())
    for (Json& child : value) gather(child, all);
}

Json nested(Random& random) {
  Json value = 1;
  for (std::uint64_t k = below(random, 200); k > 0; --k) value = Json::array({std::move(value)});
  return value;
}

Json another_kind(Random& random) {
  static const std::vector<Json> kinds{
      nullptr, true, false, 0, -1, 1.5, 1e300, -1e300, 1e-300, "", "symrig", Json::array(), Json::object()};
  return below(random, 8) == 0 ? nested(random) : any_of(random, kinds);
}

void change_structure(Json& value, Random& random) {
  if (value.empty()) {
    value = another_kind(random);
  } else if (below(random, 2) == 0 || value.is_object()) {
    auto gone = value.begin();
    std::advance(gone, static_cast<std::ptrdiff_t>(below(random, value.size())));
    value.erase(gone);
  } else {
    value.push_back(Json(value[below(random, value.size())]));
  }
}

void change(Json& value, Random& random) {
  if (below(random, 8) == 0 || value.is_null()) {
    value = another_kind(random);
  } else if (value.is_number_unsigned() && below(random, 4) == 0) {
    value = random.bits() >> below(random, 64);
  } else if (value.is_number_integer()) {
    value = other_integer(random, value.get<std::int64_t>());
  } else if (value.is_number_float()) {
    const double other = other_real(random, value.get<double>());
    value = std::isfinite(other) ? other : 1e308;
  } else if (value.is_string()) {
    const auto text = value.get<std::string>();
    value = below(random, 2) == 0 ? text + text : text.substr(0, below(random, text.size() + 1));
  } else if (value.is_boolean()) {
    value = !value.get<bool>();
  } else if (value.is_structured()) {
    change_structure(value, random);
  }
}

}  // namespace

std::string mutate_json(const std::string& text, Random& random) {
  Json json = Json::parse(text);
  for (std::uint64_t k = 1 + (below(random, 4) == 0 ? below(random, 3) : 0); k > 0; --k) {
    std::vector<Json*> all;
    gather(json, all);
    change(*any_of(random, all), random);
  }
  return json.dump();
}

std::string mutate_text(const std::string& text, Random& random) {
  const std::string deep(below(random, 60'000), '[');
  switch (below(random, 8)) {
    case 0:
      return "";
    case 1:
      return text + text;
    case 2:
      return text.substr(0, below(random, text.size() + 1));
    case 3:
      return R"({"a":)" + deep;
    default:
      return Json::accept(text) ? mutate_json(text, random)
                                : text + static_cast<char>('!' + below(random, 90));
  }
}

}  // namespace symrig::structured
