// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/truth_file.hpp"

#include "sim/hash.hpp"

#include <bit>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::bench_vm {

namespace {

using nlohmann::json;

TrueExposure exposure_of(const json& line) {
  TrueExposure exposure;
  exposure.frame = line.at("exposed").get<std::uint64_t>();
  exposure.open = Nanoseconds{line.at("end").get<std::int64_t>() - line.at("begin").get<std::int64_t>()};
  const json& lit = line.at("lit");
  exposure.pure = lit.size() == 1 && lit[0].at("share").get<double>() == 1;
  if (exposure.pure) exposure.picture = std::stoull(lit[0].at("key").get<std::string>(), nullptr, 16);
  return exposure;
}

}  // namespace

std::uint64_t picture_key(const Image<float>& picture) {
  std::uint64_t key = 0;
  for (const float value : picture.values()) key = sim::combine(key, std::bit_cast<std::uint32_t>(value));
  return key;
}

Result<std::vector<TrueExposure>> read_true_exposures(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::not_found, path + " does not exist", "bench_scene --log writes it"};
  std::vector<TrueExposure> exposures;
  std::string text;
  for (int number = 1; std::getline(file, text); ++number) {
    try {  // the JSON library throws
      const json line = json::parse(text);
      if (line.contains("exposed")) exposures.push_back(exposure_of(line));
    } catch (const std::exception& error) {
      return Error{ErrorCode::bad_format, fmt::format("{}:{}: {}", path, number, error.what()), ""};
    }
  }
  return exposures;
}

}  // namespace symrig::bench_vm
