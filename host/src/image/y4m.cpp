// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/y4m.hpp"

#include "symrig/base/files.hpp"
#include "symrig/image/internal/codec.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace symrig {
namespace {

constexpr std::string_view kMagic = "YUV4MPEG2 ";
/// Longer than any header or FRAME line that programs write; a file without a line end is refused after it.
constexpr std::size_t kLongestLine = 256;

/// The planes beside luma: how many, and how many luma samples one of theirs stands for.
struct Sampling {
  std::string_view name;
  int planes, across, down;
};
constexpr std::array<Sampling, 6> kSamplings{{{"444alpha", 3, 1, 1},
                                              {"444", 2, 1, 1},
                                              {"422", 2, 2, 1},
                                              {"411", 2, 4, 1},
                                              {"420", 2, 2, 2},
                                              {"mono", 0, 1, 1}}};

struct Colours {
  Sampling sampling = kSamplings[4];
  int bits = 8;
};

Error damaged_film(const std::string& name, const std::string& what) {
  return {ErrorCode::bad_format, name + ": " + what,
          "write it again, for example with ffmpeg -i film -pix_fmt gray film.y4m"};
}

std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

/// "30000:1001".
std::optional<FrameRate> rate_of(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return {};
  const auto frames = whole_number(text.substr(0, colon)), seconds = whole_number(text.substr(colon + 1));
  if (!frames || !seconds || *frames < 1 || *seconds < 1) return {};
  return FrameRate{*frames, *seconds};
}

/// "420jpeg", "422p10", "mono12": a sampling, then the bits unless they are 8. After 8 bits, other letters
/// say where chroma samples lie.
std::optional<Colours> colours_of(std::string_view text) {
  const auto* const sampling = std::find_if(kSamplings.begin(), kSamplings.end(), [&](const Sampling& one) {
    return text.substr(0, one.name.size()) == one.name;
  });
  if (sampling == kSamplings.end()) return {};
  std::string_view rest = text.substr(sampling->name.size());
  if (sampling->planes > 0 && rest.size() > 1 && rest[0] == 'p' && rest[1] >= '0' && rest[1] <= '9')
    rest.remove_prefix(1);
  if (rest.empty() || rest[0] < '0' || rest[0] > '9') return Colours{*sampling, 8};
  const auto bits = whole_number(rest);
  if (!bits || *bits < 8 || *bits > 16) return {};
  return Colours{*sampling, static_cast<int>(*bits)};
}

struct Y4mHeader {
  Grid grid;
  FrameRate rate;
  Colours colours;
  bool full_range = false;
};

Result<Y4mHeader> header_of(std::string_view line, const std::string& name) {
  Y4mHeader header;
  std::int64_t rows = 0, cols = 0;
  line.remove_prefix(kMagic.size());
  while (!line.empty()) {
    const std::string_view word = line.substr(0, line.find(' '));
    line.remove_prefix(std::min(word.size() + 1, line.size()));
    if (word.empty()) continue;
    const std::string_view value = word.substr(1);
    const auto bad = [&] { return damaged_film(name, fmt::format("its header says '{}'", word)); };
    if (word[0] == 'W' || word[0] == 'H') {
      const auto side = whole_number(value);
      if (!side) return bad();
      (word[0] == 'W' ? cols : rows) = *side;
    } else if (word[0] == 'F') {
      const auto rate = rate_of(value);
      if (!rate) return bad();
      header.rate = *rate;
    } else if (word[0] == 'C') {
      const auto colours = colours_of(value);
      if (!colours) return bad();
      header.colours = *colours;
    } else if (word[0] == 'I' && value != "p" && value != "?") {
      return Error{ErrorCode::bad_format, fmt::format("{}: its frames are interlaced ({})", name, word),
                   "deinterlace it: a light is a whole picture"};
    } else if (word == "XCOLORRANGE=FULL") {
      header.full_range = true;
    }
  }
  SYMRIG_TRY(header.grid, image::checked_grid(rows, cols, name));
  return header;
}

std::uint64_t frame_bytes(const Y4mHeader& header) {
  const auto up = [](int side, int by) { return static_cast<std::uint64_t>((side + by - 1) / by); };
  const Sampling& sampling = header.colours.sampling;
  const std::uint64_t chroma =
      up(header.grid.cols, sampling.across) * up(header.grid.rows, sampling.down) * sampling.planes;
  return (static_cast<std::uint64_t>(header.grid.size()) + chroma) * (header.colours.bits > 8 ? 2 : 1);
}

/// Reads up to bytes.size() bytes; fewer at the end of the file.  fails: io.
Result<std::size_t> read_at(int fd, std::span<char> bytes, std::uint64_t offset, const std::string& name) {
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t count =
        ::pread(fd, bytes.data() + got, bytes.size() - got, static_cast<off_t>(offset + got));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      return Error{ErrorCode::io,
                   fmt::format("{} cannot be read ({})", name, std::generic_category().message(errno)),
                   "check the disk"};
    if (count == 0) break;
    got += static_cast<std::size_t>(count);
  }
  return got;
}

/// The line at an offset, without its end.  Empty if no line ends within kLongestLine bytes.
Result<std::string> line_at(int fd, std::uint64_t offset, const std::string& name) {
  std::array<char, kLongestLine> buffer{};
  SYMRIG_TRY(const std::size_t got, read_at(fd, buffer, offset, name));
  const std::string_view text(buffer.data(), got);
  const std::size_t end = text.find('\n');
  return end == std::string_view::npos ? std::string() : std::string(text.substr(0, end));
}

bool begins_a_frame(std::string_view line) {
  constexpr std::string_view kFrame = "FRAME";
  return line.substr(0, kFrame.size()) == kFrame &&
         (line.size() == kFrame.size() || line[kFrame.size()] == ' ');
}

}  // namespace

bool is_film(const std::filesystem::path& path) {
  return image::lower_suffix(path) == ".y4m";
}

Result<Y4mReader> Y4mReader::open(const std::filesystem::path& path) {
  Y4mReader film;
  film.name_ = path.string();
  SYMRIG_CHECK(check_readable(path));
  film.file_ = Fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat facts {};
  if (!film.file_ || ::fstat(film.file_.get(), &facts) != 0)
    return Error{ErrorCode::io,
                 fmt::format("{} cannot be read ({})", film.name_, std::generic_category().message(errno)),
                 "check its permissions"};
  const int fd = film.file_.get();
  SYMRIG_TRY(const std::string first, line_at(fd, 0, film.name_));
  if (first.compare(0, kMagic.size(), kMagic) != 0)
    return damaged_film(film.name_, "is not a YUV4MPEG2 film");
  if (first.ends_with('\r'))
    return damaged_film(film.name_, "its first line ends in CR LF; a copy as text changes line ends");
  SYMRIG_TRY(const Y4mHeader header, header_of(first, film.name_));
  film.grid_ = header.grid;
  film.rate_ = header.rate;
  film.bits_ = header.colours.bits;
  film.full_range_ = header.full_range;

  // A FRAME line may have parameters, so each one is read.
  const auto size = static_cast<std::uint64_t>(facts.st_size);
  const std::uint64_t bytes = frame_bytes(header);
  std::uint64_t at = first.size() + 1;
  while (at < size) {
    SYMRIG_TRY(const std::string line, line_at(fd, at, film.name_));
    const std::size_t frame = film.offsets_.size() + 1;
    if (!begins_a_frame(line))
      return damaged_film(film.name_,
                          fmt::format("frame {} does not begin where frame {} ends", frame, frame - 1));
    at += line.size() + 1;
    if (size - at < bytes) return damaged_film(film.name_, fmt::format("it ends within frame {}", frame));
    film.offsets_.push_back(at);
    at += bytes;
  }
  if (film.offsets_.empty()) return damaged_film(film.name_, "it has no frame");
  return film;
}

Result<Image<float>> Y4mReader::luma(std::size_t frame) const {
  if (frame >= offsets_.size())
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} has {} frames; there is no frame {}", name_, offsets_.size(), frame + 1),
                 ""};
  const std::size_t width = bits_ > 8 ? 2 : 1;
  std::vector<char> bytes(static_cast<std::size_t>(grid_.size()) * width);
  SYMRIG_TRY(const std::size_t got, read_at(file_.get(), bytes, offsets_[frame], name_));
  if (got < bytes.size()) return damaged_film(name_, fmt::format("it ends within frame {}", frame + 1));
  // ITU-R BT.709 and BT.601: black is 16 and white 235 of 8 bits, and as many times more of more bits.
  const auto scale = static_cast<float>(1 << (bits_ - 8));
  const float black = full_range_ ? 0.F : 16.F * scale;
  const float white = full_range_ ? static_cast<float>((1 << bits_) - 1) : 235.F * scale;
  Image<float> luma(grid_);
  const std::span<float> values = luma.values();
  for (std::size_t i = 0; i < values.size(); ++i) {
    unsigned code = static_cast<unsigned char>(bytes[i * width]);
    if (width == 2) code |= static_cast<unsigned>(static_cast<unsigned char>(bytes[2 * i + 1])) << 8U;
    values[i] = std::clamp((static_cast<float>(code) - black) / (white - black), 0.F, 1.F);
  }
  return luma;
}

namespace {

/// One plane of Y, Cb, Cr from codes of R, G, B (ITU-T T.871, JFIF, section 7), in whole numbers, so that
/// several pixels are made at once.
struct JfifPlane {
  std::int32_t red, green, blue;  ///< weights in 65536ths
  std::int32_t zero;              ///< code of a plane that is 0

  char of(std::uint8_t r, std::uint8_t g, std::uint8_t b) const {
    const std::int32_t sum = red * r + green * g + blue * b + (zero << 16) + (1 << 15);
    return static_cast<char>(static_cast<std::uint8_t>(std::min(sum >> 16, 255)));
  }
};

// 0.299, 0.587, 0.114; the same over -1.772, and 0.5 for blue; over -1.402, and 0.5 for red. Rounded, they
// add up to 1, 0 and 0 as before, so grey stays grey.
constexpr JfifPlane kLuma{19595, 38470, 7471, 0};
constexpr JfifPlane kBlueness{-11058, -21710, 32768, 128};
constexpr JfifPlane kRedness{32768, -27439, -5329, 128};
static_assert(kLuma.red + kLuma.green + kLuma.blue == 1 << 16);
static_assert(kBlueness.red + kBlueness.green + kBlueness.blue == 0);
static_assert(kRedness.red + kRedness.green + kRedness.blue == 0);

}  // namespace

Error Y4mWriter::cannot_be_written() const {
  return {ErrorCode::io, path_.string() + " cannot be written",
          "check the folder, its permissions and the free space"};
}

Result<Y4mWriter> Y4mWriter::begin(const std::filesystem::path& path, Grid grid, int channels,
                                   FrameRate rate) {
  if (!grid.valid() || (channels != 1 && channels != 3))
    return Error{ErrorCode::bad_argument, fmt::format("{}: cannot write a film of {} pixels and {} channels",
                                                      path.string(), to_string(grid), channels)};
  Y4mWriter film;
  film.path_ = path;
  SYMRIG_TRY(film.target_, replaceable_file(path));
  film.temporary_ = temporary_name(film.target_);
  film.grid_ = grid;
  film.channels_ = channels;
  film.out_.open(film.temporary_, std::ios::binary);
  film.out_ << fmt::format("YUV4MPEG2 W{} H{} F{}:{} Ip A1:1 C{} XCOLORRANGE=FULL\n", grid.cols, grid.rows,
                           rate.frames, rate.seconds, channels == 1 ? "mono" : "444");
  if (!film.out_) return film.cannot_be_written();
  return film;
}

Y4mWriter::Y4mWriter(Y4mWriter&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      grid_(other.grid_),
      channels_(other.channels_),
      out_(std::move(other.out_)) {}

Y4mWriter::~Y4mWriter() {
  if (temporary_.empty()) return;
  out_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

Result<void> Y4mWriter::add(const Image<std::uint8_t>& codes) {
  if (codes.grid() != grid_ || codes.channels() != channels_)
    return Error{ErrorCode::size_mismatch, fmt::format("{}: a frame of another size", path_.string())};
  return add_planes(planes_of(codes));
}

std::vector<char> Y4mWriter::planes_of(const Image<std::uint8_t>& codes) {
  std::vector<char> planes(codes.values().size());
  if (codes.channels() == 1) {
    std::transform(codes.values().begin(), codes.values().end(), planes.begin(),
                   [](std::uint8_t code) { return static_cast<char>(code); });
    return planes;
  }
  const auto red = codes.plane(0), green = codes.plane(1), blue = codes.plane(2);
  const std::size_t pixels = red.size();
  char* to = planes.data();
  for (const JfifPlane& plane : {kLuma, kBlueness, kRedness}) {
    for (std::size_t i = 0; i < pixels; ++i) to[i] = plane.of(red[i], green[i], blue[i]);
    to += pixels;
  }
  return planes;
}

Result<void> Y4mWriter::add_planes(std::span<const char> planes) {
  if (planes.size() != static_cast<std::size_t>(grid_.size()) * static_cast<std::size_t>(channels_))
    return Error{ErrorCode::size_mismatch, fmt::format("{}: a frame of another size", path_.string())};
  out_ << "FRAME\n";
  out_.write(planes.data(), static_cast<std::streamsize>(planes.size()));
  return out_ ? Result<void>() : cannot_be_written();
}

Result<void> Y4mWriter::finish() {
  out_.close();
  if (!out_) return cannot_be_written();
  SYMRIG_CHECK(replace_file(temporary_, target_));
  temporary_.clear();
  return {};
}

}  // namespace symrig
