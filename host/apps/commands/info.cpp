// SPDX-License-Identifier: Apache-2.0

#include "command.hpp"
#include "device_text.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/board/board_info.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {

namespace {

/// A number of board ticks as a duration with four significant figures: "8 ns", "34.36 s".
std::string tick_duration_text(TickRate rate, Ticks ticks) {
  struct Unit {
    double seconds;
    const char* name;
  };
  constexpr std::array<Unit, 4> kUnits{{{1, "s"}, {1e-3, "ms"}, {1e-6, "us"}, {1e-9, "ns"}}};
  const double seconds = static_cast<double>(ticks.count) / static_cast<double>(rate.hz);
  const auto* unit =
      std::find_if(kUnits.begin(), kUnits.end(), [=](const Unit& one) { return seconds >= one.seconds; });
  if (unit == kUnits.end()) unit = &kUnits.back();
  return fmt::format("{:.4g} {}", seconds / unit->seconds, unit->name);
}

using Json = nlohmann::ordered_json;

struct InfoArguments {
  std::string device, camera, projector, json;
};

std::string waits_text(const LineInfo& line) {
  std::string text;
  constexpr std::array<const char*, 3> kEdges{"rising", "falling", "both"};
  for (std::size_t k = 0; k < kEdges.size(); ++k)
    if ((line.waits >> k & 1U) != 0) text += (text.empty() ? "" : " ") + std::string(kEdges[k]);
  return text.empty() ? "-" : text;
}

std::string line_table(const BoardInfo& info, const BoardStatus& status) {
  std::size_t widest = 4;
  for (const LineInfo& line : info.lines) widest = std::max(widest, line.name.size());
  std::string text = fmt::format("  {:>2} {:<{}}  {:<7} {:<12} {:<5} {:<9} {}\n", "no", "line", widest, "pin",
                                 "kind", "level", "stamps", "waits");
  for (std::size_t k = 0; k < info.lines.size(); ++k) {
    const LineInfo& line = info.lines[k];
    const std::string stamps =
        line.stamp_ticks == 0 ? "-" : tick_duration_text(info.rate, {line.stamp_ticks});
    const char* kind = line.output ? "output" : line.trips ? "input, trips" : "input";
    text += fmt::format("  {:>2} {:<{}}  {:<7} {:<12} {:<5} {:<9} {}\n", k, line.name, widest,
                        line.pin.empty() ? "-" : line.pin, kind, status.levels >> k & 1U, stamps,
                        waits_text(line));
  }
  return text;
}

std::string fault_text(const BoardInfo& info, const char* when, const std::optional<FaultInfo>& fault) {
  if (!fault) return fmt::format("  {:<14} none\n", when);
  return fmt::format("  {:<14} {} at tick {} (argument {}): {}\n", when, fault->name, fault->tick.count,
                     fault->arg, fault->hint.empty() ? info.board : fault->hint);
}

std::string hash_or_none(std::uint32_t hash) {
  return hash == 0 ? "none" : fmt::format("{:08x}", hash);
}

std::string identity_text(const BoardInfo& info) {
  return fmt::format(
      "{} {}{}\n"
      "  firmware       {}, sources {:016x}\n"
      "  protocol       {}.{}, schema {:08x}, features {:#x}, required {:#x}\n",
      info.board, info.unique_id, info.label.empty() ? "" : fmt::format(" \"{}\"", info.label),
      info.firmware_version, info.firmware_hash, info.protocol_major, info.protocol_minor, info.schema_hash,
      info.features, info.required);
}

std::string state_text(const BoardInfo& info, const BoardStatus& status) {
  return fmt::format(
             "  state          {}, clock at {} ticks ({})\n"
             "  holds          configuration {}, program {}, stored configuration {}\n"
             "  last start     by {}; {} damaged frames since then\n",
             name(status.state), status.now.count, tick_duration_text(info.rate, status.now),
             hash_or_none(status.config_hash), hash_or_none(status.program_hash),
             hash_or_none(status.stored_config), name(status.reset_cause), status.bad_frames) +
         fault_text(info, "fault", status.fault) + fault_text(info, "fault before", status.reset_fault);
}

std::string crash_text(const BoardCrash& crash) {
  return fmt::format(
      "exception {} at {:#010x}, lr {:#010x}, psr {:#010x}, sp {:#010x}, r0-r3 {:#x}, r12 {:#x}",
      crash.exception, crash.pc, crash.lr, crash.psr, crash.sp,
      fmt::join(crash.r.begin(), crash.r.begin() + 4, " "), crash.r[4]);
}

std::string diagnostics_text(const BoardInfo& info, const std::optional<BoardDiagnostics>& found) {
  if (!found) return "";
  std::string text = fmt::format(
      "  measured       longest round {} of {} ticks, refill {} of {}; {} flash reads, {} lost words, {} DMA "
      "errors\n"
      "  chip           revision {}; {} bytes of stack never used\n"
      "  crash          {}\n",
      found->longest_round, info.poll_ticks, found->worst_refill, info.refill_ticks, found->flash_reads,
      found->queue_overflows, found->dma_errors, found->chip_revision, found->stack_free,
      found->crash ? crash_text(*found->crash) : "none before the last start");
  for (const std::string& objection : found->objections(info))
    text += fmt::format("  warning        {}\n", objection);
  return text;
}

std::string class_text(const BoardInfo& info) {
  if (!info.best_effort()) return "exact: hardware times the edges";
  return fmt::format("best-effort: software times the edges, up to {} late (measured on this machine)",
                     tick_duration_text(info.rate, info.lateness));
}

std::string ability_text(const BoardInfo& info) {
  return fmt::format(
      "  class          {}\n"
      "  tick           {} ns ({} a second)\n"
      "  one word       {} to {}; next word {} after an awaited edge\n"
      "  programs       {} records, loops {} deep; {} queued words, {} to refill one\n"
      "  link           frames of {} bytes, {} in flight\n",
      class_text(info), 1e9 / static_cast<double>(info.rate.hz), info.rate.hz,
      tick_duration_text(info.rate, info.min_dwell), tick_duration_text(info.rate, info.max_dwell),
      tick_duration_text(info.rate, info.wait_latency), info.program_bytes / 8, info.loop_depth,
      info.queue_segments, tick_duration_text(info.rate, {info.refill_ticks}), info.mtu, info.window);
}

Json fault_json(const std::optional<FaultInfo>& fault) {
  if (!fault) return nullptr;
  return {{"code", fault->code},
          {"name", fault->name},
          {"tick", fault->tick.count},
          {"arg", fault->arg},
          {"hint", fault->hint}};
}

Json line_json(const LineInfo& line, bool level) {
  return {{"name", line.name},
          {"pin", line.pin},
          {"output", line.output},
          {"level", level},
          {"stamp_ticks", line.stamp_ticks},
          {"waits",
           {{"rising", (line.waits & 1U) != 0},
            {"falling", (line.waits & 2U) != 0},
            {"both", (line.waits & 4U) != 0}}},
          {"trips", line.trips}};
}

Json crash_json(const std::optional<BoardCrash>& crash) {
  if (!crash) return nullptr;
  return {{"exception", crash->exception},
          {"pc", crash->pc},
          {"lr", crash->lr},
          {"psr", crash->psr},
          {"sp", crash->sp},
          {"r", crash->r}};
}

Json diagnostics_json(const BoardInfo& info, const std::optional<BoardDiagnostics>& found) {
  if (!found) return nullptr;
  return {{"longest_round", found->longest_round},     {"worst_refill", found->worst_refill},
          {"flash_reads", found->flash_reads},         {"flash_hits", found->flash_hits},
          {"queue_overflows", found->queue_overflows}, {"dma_errors", found->dma_errors},
          {"stack_free", found->stack_free},           {"chip_revision", found->chip_revision},
          {"crash", crash_json(found->crash)},         {"warnings", found->objections(info)}};
}

Json to_json(const BoardInfo& info, const BoardStatus& status,
             const std::optional<BoardDiagnostics>& diagnostics) {
  Json json{{"command", "info"},
            {"board", info.board},
            {"serial", info.unique_id},
            {"label", info.label},
            {"firmware", info.firmware_version},
            {"firmware_hash", fmt::format("{:016x}", info.firmware_hash)},
            {"protocol", {info.protocol_major, info.protocol_minor}},
            {"schema_hash", fmt::format("{:08x}", info.schema_hash)},
            {"features", info.features},
            {"required", info.required},
            {"tick_hz", info.rate.hz},
            {"min_dwell", info.min_dwell.count},
            {"max_dwell", info.max_dwell.count},
            {"wait_latency", info.wait_latency.count},
            {"program_records", info.program_bytes / 8},
            {"loop_depth", info.loop_depth},
            {"queue_segments", info.queue_segments},
            {"refill_ticks", info.refill_ticks},
            {"poll_ticks", info.poll_ticks},
            {"class", info.best_effort() ? "best-effort" : "exact"},
            {"lateness", info.lateness.count},
            {"mtu", info.mtu},
            {"window", info.window},
            {"state", name(status.state)},
            {"tick", status.now.count},
            {"config_hash", fmt::format("{:08x}", status.config_hash)},
            {"program_hash", fmt::format("{:08x}", status.program_hash)},
            {"stored_config", fmt::format("{:08x}", status.stored_config)},
            {"reset_cause", name(status.reset_cause)},
            {"bad_frames", status.bad_frames},
            {"fault", fault_json(status.fault)},
            {"reset_fault", fault_json(status.reset_fault)},
            {"diagnostics", diagnostics_json(info, diagnostics)},
            {"lines", Json::array()}};
  for (std::size_t k = 0; k < info.lines.size(); ++k)
    json["lines"].push_back(line_json(info.lines[k], (status.levels >> k & 1U) != 0));
  return json;
}

Result<void> run_camera(const InfoArguments& arguments) {
  SYMRIG_TRY(const CameraInfo camera, look_at_camera(arguments.camera));
  Json json{{"command", "info"}};
  json.update(camera_json(camera));
  SYMRIG_CHECK(write_text(arguments.json, json_text(json, 2)));
  return is_standard_output(arguments.json) ? Result<void>() : print(camera_text(camera));
}

Result<void> run_projector(const InfoArguments& arguments) {
  SYMRIG_TRY(const DlpController controller, look_at_dlp_controller(arguments.projector));
  Json json{{"command", "info"}};
  json.update(controller_json(controller));
  SYMRIG_CHECK(write_text(arguments.json, json_text(json, 2)));
  return is_standard_output(arguments.json) ? Result<void>() : print(controller_text(controller));
}

Result<void> run(const InfoArguments& arguments) {
  SYMRIG_CHECK(JobFiles().writes("--json", arguments.json, FileFormat::json).check());
  if (!arguments.camera.empty()) return run_camera(arguments);
  if (!arguments.projector.empty()) return run_projector(arguments);
  SYMRIG_TRY(auto board, open_board(arguments.device));
  SYMRIG_TRY(const BoardStatus status, board.status());
  SYMRIG_TRY(const auto diagnostics, board.diagnostics());
  const BoardInfo& info = board.info();
  SYMRIG_CHECK(write_text(arguments.json, json_text(to_json(info, status, diagnostics), 2)));
  if (is_standard_output(arguments.json)) return {};
  return print(identity_text(info) + state_text(info, status) + ability_text(info) +
               diagnostics_text(info, diagnostics) + line_table(info, status));
}

}  // namespace

Job add_info(CLI::App& command) {
  const auto arguments = std::make_shared<InfoArguments>();
  add_device(command, arguments->device);
  command
      .add_option(
          "--camera", arguments->camera,
          "Show a camera instead: " + camera_path_forms() + ", or a V4L2 camera's serial number, bus or name")
      ->type_name("CAMERA")
      ->excludes("--device");
  command
      .add_option("--projector", arguments->projector,
                  "Show a DLP controller instead: its path, as symrig list shows it")
      ->type_name("CONTROLLER")
      ->excludes("--device")
      ->excludes("--camera");
  add_json(command, arguments->json);
  command.footer(std::string("Example:\n"
                             "  symrig info --device sim:\n"
                             "  symrig info --camera /dev/video0\n"
                             "  symrig info --projector /dev/hidraw0\n"
                             "\n") +
                 kDeviceHelp + "This command changes nothing on the board.\n\n" + kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
