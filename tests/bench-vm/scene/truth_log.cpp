// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/truth_log.hpp"

#include "sim/light/random.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::bench_vm {

namespace {

using nlohmann::json;

constexpr double kLeastShare = 0.9;
constexpr double kRoundings = 1e-9;  // of some shares

TrueExposure exposure_of(const json& line) {
  TrueExposure exposure;
  exposure.frame = line.at("exposed").get<std::uint64_t>();
  exposure.open = Nanoseconds{line.at("end").get<std::int64_t>() - line.at("begin").get<std::int64_t>()};
  std::map<std::uint64_t, double> bright;  // shares of the pictures that were not dark
  double dark = 0;
  std::uint64_t dark_key = 0;
  for (const json& part : line.at("lit")) {
    const std::uint64_t key = std::stoull(part.at("key").get<std::string>(), nullptr, 16);
    const auto share = part.at("share").get<double>();
    if (!part.value("dark", false)) {
      bright[key] += share;
    } else {
      dark += share;
      dark_key = key;
    }
  }
  // A screen that is dark for a while in an exposure is one with bit planes, between two refreshes.
  if (bright.empty()) bright[dark_key] = std::exchange(dark, 0);
  const auto& [picture, share] = *bright.begin();
  exposure.pure = bright.size() == 1 && share >= kLeastShare && share + dark > 1 - kRoundings;
  if (exposure.pure) exposure.picture = picture;
  if (exposure.pure && dark > 0) exposure.share = share;
  return exposure;
}

}  // namespace

Nanoseconds TrueExposure::lit() const {
  return Nanoseconds{std::llround(static_cast<double>(open.count()) * share)};
}

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

namespace {

std::string_view name(CameraPort::Taken taken) {
  constexpr std::array<std::string_view, 3> kNames{"yes", "not streaming", "unplugged"};
  return kNames[static_cast<std::size_t>(taken)];
}

bool is_dark(const Image<float>& picture) {
  return std::ranges::all_of(picture.values(), [](float value) { return value == 0; });
}

}  // namespace

Result<TruthLog> TruthLog::open(const std::string& path) {
  TruthLog log;
  if (path.empty()) return log;
  log.file_.open(path);
  if (!log.file_) return system_error(fmt::format("cannot write {}", path), "");
  return log;
}

void TruthLog::line(const std::string& text) {
  if (file_.is_open()) file_ << text << '\n' << std::flush;  // jobs wait for lines
}

void TruthLog::exposed(const Exposure& exposure, std::span<const ScreenTimeline::Lit> lit) {
  if (!file_.is_open()) return;
  std::string pictures;
  for (const ScreenTimeline::Lit& part : lit)
    pictures += fmt::format(R"({}{{"picture":{},"key":"{:016x}","share":{}{}}})", pictures.empty() ? "" : ",",
                            part.number, picture_key(*part.pattern), part.share,
                            is_dark(*part.pattern) ? R"(,"dark":true)" : "");
  line(fmt::format(R"({{"exposed":{},"begin":{},"end":{},"doubt":{},"lit":[{}]}})", exposure.frame,
                   exposure.begin.time.count(), exposure.end.time.count(),
                   (exposure.begin.doubt + exposure.end.doubt).count(), pictures));
}

void TruthLog::delivered(const DeliveredFrame& frame, CameraPort::Taken taken) {
  line(fmt::format(R"({{"delivered":{},"fault":"{}","stamp":{},"skip":{},"damaged":{},"taken":"{}"}})",
                   frame.frame, bench_vm::name(frame.fault), frame.stamp.count(), frame.skip, frame.damaged,
                   name(taken)));
}

Result<void> TruthLog::close(const std::string& totals) {
  line(totals);
  if (!file_.is_open()) return {};
  file_.close();
  if (!file_) return Error{ErrorCode::io, "the log is incomplete", "check for a full disk"};
  return {};
}

}  // namespace symrig::bench_vm
