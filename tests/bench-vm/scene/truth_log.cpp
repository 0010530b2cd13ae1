// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/truth_log.hpp"

#include "bench-vm/scene/truth_file.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

namespace symrig::bench_vm {

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
