// SPDX-License-Identifier: Apache-2.0

#include "camera/genicam/stream.hpp"

#include "symrig/camera/internal/network.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace symrig::camera {
namespace {

// Half of it is the error of the offset: well below the ledger's tolerance for stamps.
constexpr Nanoseconds kLongestLatch = std::chrono::microseconds(200);

}  // namespace

Nanoseconds monotonic_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

bool ClockMap::latch(Features& features) {
  const std::string command = features.first_of({"TimestampLatch", "GevTimestampControlLatch"});
  const std::string value = features.first_of({"TimestampLatchValue", "GevTimestampValue"});
  if (command.empty() || value.empty()) return false;
  for (int k = 0; k < 4; ++k) {
    const Nanoseconds before = monotonic_now();
    if (!features.execute(command)) return false;
    const Nanoseconds took = monotonic_now() - before;
    if (took > kLongestLatch) continue;
    const auto ticks = features.integer(value);
    if (!ticks) return false;
    double tick = 1;  // newer cameras count nanoseconds
    if (value == "GevTimestampValue") {
      const auto rate = features.integer("GevTimestampTickFrequency");
      if (!rate || *rate <= 0) return false;
      tick = 1e9 / static_cast<double>(*rate);
    }
    offset_ = before + took / 2 - Nanoseconds(std::llround(static_cast<double>(*ticks) * tick));
    return true;
  }
  return false;
}

std::optional<SteadyTime> ClockMap::host(std::uint64_t at) const {
  if (!offset_ || at == 0) return {};
  return SteadyTime{Nanoseconds(static_cast<std::int64_t>(at)) + *offset_};
}

namespace {

using namespace std::chrono_literals;

constexpr auto kLook = 50ms;                // how often the thread looks whether it should end
constexpr Nanoseconds kClockInterval = 1s;  // clocks of quartz drift by 50 µs in this time
constexpr std::int64_t kBufferMemory = 256 << 20, kFewestBuffers = 4;
constexpr Nanoseconds kLongestArrival = 1s;  // Aravis gives up on a frame earlier
constexpr auto kArrivalLook = 2ms;
constexpr std::size_t kWantedSocket = 32U << 20U;

std::size_t allowed_socket() {
  std::ifstream file("/proc/sys/net/core/rmem_max");
  std::size_t bytes = 0;
  return file >> bytes ? bytes : std::numeric_limits<std::size_t>::max();
}

/// The address at which this computer meets the camera. None: unknown.
std::optional<sockaddr_in> own_address(ArvDevice* device) {
  sockaddr_in at{};
  GSocketAddress* const here = arv_gv_device_get_interface_address(ARV_GV_DEVICE(device));
  if (here == nullptr || g_socket_address_to_native(here, &at, sizeof at, nullptr) == 0) return {};
  return at;
}

/// Where the stream's packets arrive.
std::unique_ptr<StreamSocket> socket_of(ArvDevice* device, ArvStream* stream) {
  auto at = own_address(device);
  if (!at) return {};
  at->sin_port = htons(arv_gv_stream_get_port(ARV_GV_STREAM(stream)));
  return StreamSocket::bound_to(*at);
}

/// A camera without the feature uses its own size, which nobody can check.
Result<void> check_packets(ArvDevice* device, const Features& features, const std::string& camera) {
  if (ARV_IS_GV_DEVICE(device) == 0 || !features.has("GevSCPSPacketSize")) return {};
  const auto at = own_address(device);
  const auto network = at ? interface_at(at->sin_addr) : std::optional<NetworkInterface>();
  if (!network) return {};
  SYMRIG_TRY(const std::int64_t bytes, features.integer("GevSCPSPacketSize"));
  return check_packet_size(camera, static_cast<int>(bytes), *network);
}

/// Packets of a GigE frame: its data, a leader and a trailer. Aravis counts each one that it has no buffer
/// for.
std::uint64_t packets_of(ArvDevice* device, std::int64_t payload) {
  constexpr std::int64_t kHeaders = 20 + 8 + 8;  // IP, UDP and GVSP
  if (ARV_IS_GV_DEVICE(device) == 0) return 1;
  const std::int64_t data = arv_gv_device_get_packet_size(ARV_GV_DEVICE(device), nullptr) - kHeaders;
  return data > 0 ? static_cast<std::uint64_t>((payload + data - 1) / data + 2) : 1;
}

std::string_view cause(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets of a frame were lost";
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "a frame did not end in time";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "a frame is larger than the camera said";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "a frame has packets with wrong numbers";
    default:
      return "a frame is incomplete";
  }
}

}  // namespace

GenicamStream::GenicamStream(ArvDevice* device, const GenicamPlan& plan, StreamReport report)
    : device_(device),
      plan_(plan),
      features_(device, plan.camera),
      reader_(plan.layout, {0, 0, {}, plan.binning}, plan.saturation),
      queue_(plan.waiting, std::move(report)) {}

Result<std::unique_ptr<GenicamStream>> GenicamStream::start(ArvDevice* device, const GenicamPlan& plan,
                                                            StreamReport report) {
  std::unique_ptr<GenicamStream> stream(new GenicamStream(device, plan, std::move(report)));
  SYMRIG_CHECK(stream->begin());
  return stream;
}

/// A frame arrives faster than any thread is sure to wake up, so the socket must hold several.
void GenicamStream::enlarge_socket(std::size_t payload) {
  if (ARV_IS_GV_STREAM(stream_.get()) == 0) return;
  const std::size_t wanted = std::max(kWantedSocket, 4 * payload);
  const std::size_t allowed = plan_.socket_limit.value_or(allowed_socket());
  const auto size = static_cast<gint>(std::min({wanted, allowed, std::size_t{1} << 30U}));
  g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", size,
               nullptr);
  socket_ = socket_of(device_, stream_.get());
  if (socket_) socket_->hold(size);
  socket_cure_ = allowed < wanted
                     ? fmt::format(
                           "it holds {} bytes, as net.core.rmem_max allows: sudo sysctl -w "
                           "net.core.rmem_max={}",
                           allowed, wanted)
                     : "other programs keep the computer busy: end them, or take fewer frames a second";
}

Result<void> GenicamStream::begin() {
  SYMRIG_CHECK(check_packets(device_, features_, plan_.camera));
  SYMRIG_TRY(const std::int64_t payload, features_.integer("PayloadSize"));
  each_unbuffered_ = packets_of(device_, payload);
  // As root, Aravis would read packets beside the kernel's network: nothing arrives from the loopback device,
  // no firewall applies, and nobody counts the packets that found no room.
  if (ARV_IS_GV_DEVICE(device_) != 0)
    arv_gv_device_set_stream_options(ARV_GV_DEVICE(device_), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  GLibError error;
  stream_.reset(arv_device_create_stream(device_, nullptr, nullptr, error.out()));
  if (!stream_)
    return Error{ErrorCode::device_refused,
                 fmt::format("camera {}: its stream cannot be opened: {}", plan_.camera, error.text()),
                 "end other programs that use the camera"};
  enlarge_socket(static_cast<std::size_t>(payload));
  const auto room =
      std::max<std::int64_t>(kFewestBuffers, kBufferMemory / std::max<std::int64_t>(1, payload));
  buffers_ = static_cast<int>(std::min<std::int64_t>(plan_.buffers, room));
  for (int k = 0; k < buffers_; ++k)
    arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(static_cast<size_t>(payload)));
  if (!plan_.chunks.counter.empty() || !plan_.chunks.exposure.empty())
    parser_.reset(arv_device_create_chunk_parser(device_));
  if (plan_.stamp != StampOf::nothing && !clock_.latch(features_))
    queue_.note("the camera's clock cannot be latched: stamps are not used");
  lost_signal_ = g_signal_connect(device_, "control-lost", G_CALLBACK(control_lost), this);
  if (features_.has("TLParamsLocked")) SYMRIG_CHECK(features_.set("TLParamsLocked", "1"));
  SYMRIG_CHECK(features_.execute("AcquisitionStart"));
  acquiring_ = true;
  thread_ = std::thread([this] { run(); });
  return {};
}

GenicamStream::~GenicamStream() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  if (lost_signal_ != 0) g_signal_handler_disconnect(device_, lost_signal_);
  // A camera that is gone cannot be stopped.
  if (!acquiring_ || queue_.lost()) return;
  arv_device_execute_command(device_, "AcquisitionStop", nullptr);
  if (arv_device_get_feature(device_, "TLParamsLocked") != nullptr)
    arv_device_set_integer_feature_value(device_, "TLParamsLocked", 0, nullptr);
}

void GenicamStream::control_lost(ArvDevice* /*device*/, gpointer stream) {
  auto& self = *static_cast<GenicamStream*>(stream);
  self.queue_.lose({ErrorCode::device_lost,
                    fmt::format("camera {} does not answer any more", self.plan_.camera),
                    "check its cable and power"});
}

void GenicamStream::run() {
  Nanoseconds latched = monotonic_now();
  while (!stopping_) {
    if (queue_.lost() && ARV_IS_GV_STREAM(stream_.get()) == 0) return close();
    ArvBuffer* const buffer = arv_stream_timeout_pop_buffer(
        stream_.get(), static_cast<guint64>(std::chrono::microseconds(kLook).count()));
    if (buffer != nullptr) {
      ++in_hand_;
      accept(buffer);
      arv_stream_push_buffer(stream_.get(), buffer);
      --in_hand_;
    }
    if (plan_.stamp != StampOf::nothing && monotonic_now() - latched > kClockInterval && !queue_.lost()) {
      clock_.latch(features_);
      latched = monotonic_now();
    }
  }
}

/// Aravis asks a USB3 camera that is gone again and again, without a pause, until its stream is closed.
void GenicamStream::close() {
  const std::uint64_t count = unbuffered();
  const std::lock_guard lock(closing_);
  unbuffered_ = count;
  stream_.reset();
}

/// Packets wait in the socket, or Aravis waits for the rest of a frame.
bool GenicamStream::arriving() const {
  if (socket_ && socket_->holds_packets()) return true;
  const std::lock_guard lock(closing_);
  if (!stream_) return false;
  gint free = 0, complete = 0;
  arv_stream_get_n_buffers(stream_.get(), &free, &complete);
  // A queue on which a thread waits has a length of -1.
  return std::max(free, 0) < buffers_ || complete > 0 || in_hand_ > 0;
}

/// A packet that is sent again delays its frame by more than a rig waits for extra frames. Such a frame would
/// come with those of the next run. Without stamps, nothing would show that it is not one of them.
Result<std::vector<CameraFrame>> GenicamStream::take(std::size_t count, Nanoseconds patience) {
  SYMRIG_TRY(auto frames, queue_.take(count, patience));
  const Nanoseconds begun = monotonic_now();
  while (plan_.triggered && arriving() && monotonic_now() - begun < kLongestArrival) {
    auto more = queue_.take(1, kArrivalLook);
    if (!more) return frames;  // the next call tells that the camera is lost
    std::ranges::move(*more, std::back_inserter(frames));
  }
  if (auto last = queue_.take(0, Nanoseconds{0})) std::ranges::move(*last, std::back_inserter(frames));
  return frames;
}

FrameChunks GenicamStream::chunks_of(ArvBuffer* buffer) {
  FrameChunks chunks;
  if (!parser_ || arv_buffer_has_chunks(buffer) == 0) return chunks;
  GLibError error;
  if (!plan_.chunks.counter.empty()) {
    const gint64 value =
        arv_chunk_parser_get_integer_value(parser_.get(), buffer, plan_.chunks.counter.c_str(), error.out());
    if (!error) chunks.trigger_counter = static_cast<std::uint32_t>(value);
  }
  if (!plan_.chunks.exposure.empty()) {
    const double us =
        arv_chunk_parser_get_float_value(parser_.get(), buffer, plan_.chunks.exposure.c_str(), error.out());
    if (!error) chunks.exposure = Nanoseconds(std::llround(1e3 * us));
  }
  return chunks;
}

CameraFrame GenicamStream::develop(ArvBuffer* buffer, bool damaged) {
  CameraFrame frame;
  frame.damaged = damaged;
  frame.raw.resize(reader_.grid().size());
  std::size_t size = 0;
  const auto* const data = static_cast<const std::byte*>(arv_buffer_get_data(buffer, &size));
  const unsigned seen = reader_.read({data, size}, frame.raw);
  const auto& [bits, shift] = plan_.layout.depth;
  if (!damaged && seen >> (bits + shift) != 0)
    queue_.note(fmt::format("samples have bits above the stated {}; they count as saturated", bits));
  if (!damaged && (seen & ((1U << shift) - 1)) != 0)
    queue_.note(fmt::format("samples have bits below the upper {}: the stated depth is too small", bits));
  return frame;
}

void GenicamStream::accept(ArvBuffer* buffer) {
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  if (status == ARV_BUFFER_STATUS_ABORTED || status == ARV_BUFFER_STATUS_CLEARED) return;
  bool damaged = status != ARV_BUFFER_STATUS_SUCCESS;
  if (damaged) queue_.note(std::string(cause(status)));
  // A frame of another size or format than was set up would be read as noise.
  if (!damaged &&
      (static_cast<std::uint32_t>(arv_buffer_get_image_pixel_format(buffer)) != plan_.layout.format->fourcc ||
       arv_buffer_get_image_width(buffer) != plan_.layout.size.cols ||
       arv_buffer_get_image_height(buffer) != plan_.layout.size.rows)) {
    damaged = true;
    queue_.note("a frame has another size or format than was set");
  }
  const FrameChunks chunks = damaged ? FrameChunks{} : chunks_of(buffer);
  const auto reading = numbers_.read(arv_buffer_get_frame_id(buffer), chunks.trigger_counter);
  const std::uint64_t without = without_buffer(reading.missing);
  queue_.count([&reading, without](StreamReport& report) {
    report.missing += reading.missing - without;
    report.overflowed += without;
    report.missing -= reading.found && report.missing > 0 ? 1 : 0;
    report.repeated += reading.step == CountStep::repeated ? 1 : 0;
    report.reordered += reading.step == CountStep::backwards ? 1 : 0;
  });
  CameraFrame frame = develop(buffer, damaged);
  frame.sequence = reading.number;
  if (plan_.stamp != StampOf::nothing && !damaged)
    if (const auto at = clock_.host(arv_buffer_get_timestamp(buffer))) {
      frame.stamp = *at;
      frame.stamp_of = plan_.stamp;
    }
  if (parser_) frame.attachment = chunks;
  queue_.keep(std::move(frame));
}

/// How often Aravis had no buffer, because our thread did not run in time: for each packet of a GigE frame,
/// and once for a USB3 frame.
std::uint64_t GenicamStream::unbuffered() const {
  const std::lock_guard lock(closing_);
  if (!stream_) return unbuffered_;
  guint64 completed = 0, failures = 0, underruns = 0;
  arv_stream_get_statistics(stream_.get(), &completed, &failures, &underruns);
  return underruns;
}

/// How many frames of a gap in the numbers had no buffer. The others are missing. The gap may be seen long
/// after its frames, so what it does not explain is kept for later ones.
std::uint64_t GenicamStream::without_buffer(std::uint64_t gap) {
  if (gap == 0) return 0;
  const std::uint64_t left = unbuffered() - explained_;
  const std::uint64_t frames = std::min(gap, (left + each_unbuffered_ - 1) / each_unbuffered_);
  explained_ += std::min(left, frames * each_unbuffered_);
  return frames;
}

/// What the kernel dropped, and the cure. Empty: nothing.
std::string GenicamStream::socket_words() const {
  const auto dropped = socket_ ? socket_->dropped() : std::optional<std::uint64_t>();
  if (!dropped || *dropped == 0) return {};
  return fmt::format("{} packets found this computer's socket full and were dropped; {}", *dropped,
                     socket_cure_);
}

StreamReport GenicamStream::report() const {
  StreamReport report = queue_.report();
  // Those after the last frame have left no gap yet.
  report.overflowed += (unbuffered() - explained_) / each_unbuffered_;
  const std::lock_guard lock(closing_);
  if (ARV_IS_GV_STREAM(stream_.get()) == 0) return report;
  guint64 resent = 0, missing = 0;
  arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &resent, &missing);
  if (resent + missing != 0)
    report.notes.push_back(fmt::format("packets: {} sent again, {} lost", resent, missing));
  if (auto words = socket_words(); !words.empty()) report.notes.push_back(std::move(words));
  return report;
}

}  // namespace symrig::camera
