// SPDX-License-Identifier: Apache-2.0
// Reports by hidapi with its hidraw back end: the kernel keeps its driver, and only a udev rule is needed.
#include "symrig/base/files.hpp"
#include "symrig/projector/internal/dlp_link.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <hidapi/hidapi.h>
#include <sys/file.h>
#include <unistd.h>

namespace symrig::projector::dlp {
namespace {

struct CloseHid {
  void operator()(hid_device* device) const { hid_close(device); }
};
using HidDevice = std::unique_ptr<hid_device, CloseHid>;

struct FreeList {
  void operator()(hid_device_info* list) const { hid_free_enumeration(list); }
};

/// Other characters than printable ASCII become '?': these texts come from the device.
std::string plain(const wchar_t* text) {
  std::string out;
  for (; text != nullptr && *text != L'\0'; ++text)
    out += *text >= L' ' && *text <= L'~' ? static_cast<char>(*text) : '?';
  return out;
}

class HidapiTransport final : public HidTransport {
 public:
  HidapiTransport(HidDevice device, Fd lock, std::string name)
      : device_(std::move(device)), lock_(std::move(lock)), name_(std::move(name)) {}

  Result<void> write(const Report& report) override {
    std::array<std::uint8_t, kReportBytes + 1> bytes{};  // byte 0: the report has no number
    std::ranges::copy(report, bytes.begin() + 1);
    if (hid_write(device_.get(), bytes.data(), bytes.size()) < 0) return gone();
    return {};
  }

  Result<Report> read(Nanoseconds patience) override {
    Report report{};
    const auto ms = static_cast<int>(patience.count() / 1'000'000);
    const int got = hid_read_timeout(device_.get(), report.data(), report.size(), ms);
    if (got < 0) return gone();
    if (got == 0) return Error{ErrorCode::timeout, name() + " sent no report", ""};
    return report;
  }

  std::string name() const override { return name_; }

 private:
  Error gone() const {
    return {ErrorCode::device_lost, name() + " is gone: " + plain(hid_error(device_.get())),
            "check its USB cable and its power"};
  }

  HidDevice device_;
  Fd lock_;
  std::string name_;
};

Error cannot_open(const std::string& path) {
  const bool forbidden = ::access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES;
  return {ErrorCode::device_lost,
          fmt::format("{} cannot be opened{}", path, forbidden ? ": you may not read and write it" : ""),
          "install the udev rule 60-symrig.rules, then connect the projector again"};
}

}  // namespace

/// A DLPC900 has two HID interfaces, and takes commands at the first one. Unnumbered interfaces are -1.
std::vector<FoundController> find_controllers() {
  std::vector<FoundController> found;
  if (hid_init() != 0) return found;
  for (const ControllerKind& kind : kControllerKinds) {
    const std::unique_ptr<hid_device_info, FreeList> list(hid_enumerate(kind.vendor, kind.product));
    for (const hid_device_info* at = list.get(); at != nullptr; at = at->next)
      if (at->interface_number <= 0)
        found.push_back({kind, at->path, plain(at->manufacturer_string), plain(at->product_string),
                         plain(at->serial_number)});
  }
  return found;
}

Error missing(std::string_view name, const std::string& path) {
  return {ErrorCode::device_lost,
          path.empty() ? fmt::format("no {} is connected", name)
                       : fmt::format("there is no {} at {}", name, path),
          "check its USB cable and its power; symrig list shows what is connected"};
}

Result<std::unique_ptr<HidTransport>> open_transport(const ControllerKind& kind, const std::string& path) {
  std::vector<FoundController> found = find_controllers();
  std::erase_if(found, [&](const FoundController& one) {
    return one.kind != kind || (!path.empty() && one.path != path);
  });
  if (found.empty()) return missing(kind.name, path);
  if (found.size() > 1)
    return Error{ErrorCode::bad_argument, fmt::format("{} {} are connected", found.size(), kind.name),
                 fmt::format("choose one: controller = \"{}\"", found.front().path)};
  const std::string& node = found.front().path;
  HidDevice device(hid_open_path(node.c_str()));
  if (!device) return cannot_open(node);
  // The kernel hands every reply to every reader, so two programs would take each other's.
  Fd lock(::open(node.c_str(), O_RDWR | O_CLOEXEC));
  if (!lock || ::flock(lock.get(), LOCK_EX | LOCK_NB) != 0)
    return Error{ErrorCode::device_lost, node + " is in use by another program",
                 "end the other symrig, then try again"};
  return std::unique_ptr<HidTransport>(std::make_unique<HidapiTransport>(
      std::move(device), std::move(lock), fmt::format("{} at {}", kind.name, node)));
}

}  // namespace symrig::projector::dlp
