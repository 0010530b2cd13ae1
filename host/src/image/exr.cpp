// SPDX-License-Identifier: Apache-2.0
#include "image/exr_facts.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/internal/codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <optional>
#include <utility>

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>
#include <ImfXdr.h>

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

// OpenEXR throws exceptions. Each call stands inside a try block here, so none leaves this file.

namespace {

class MemoryInput : public Imf::IStream {
 public:
  MemoryInput(Bytes bytes, const std::string& name) : IStream(name.c_str()), bytes_(bytes) {}

  bool read(char c[], int n) override {
    if (n < 0 || static_cast<std::size_t>(n) > bytes_.size() - at_)
      throw std::runtime_error("it ends too early");
    std::memcpy(c, bytes_.data() + at_, static_cast<std::size_t>(n));
    at_ += static_cast<std::size_t>(n);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("an offset points beyond its end");
    at_ = position;
  }
  void clear() override {}

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
};

class MemoryOutput : public Imf::OStream {
 public:
  explicit MemoryOutput(const std::string& name) : OStream(name.c_str()) {}

  void write(const char c[], int n) override {
    const std::size_t count = n;
    if (at_ + count > bytes.size()) bytes.resize(at_ + count);
    std::memcpy(bytes.data() + at_, c, count);
    at_ += count;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = position; }

  Buffer bytes;

 private:
  std::size_t at_ = 0;
};

/// The header alone, of a flat picture.
Result<Imf::Header> peek_header(Bytes bytes, const std::string& name) {
  MemoryInput input(bytes, name);
  int magic = 0;
  int version = 0;
  Imf::Xdr::read<Imf::StreamIO>(input, magic);
  Imf::Xdr::read<Imf::StreamIO>(input, version);
  if (Imf::isMultiPart(version) || Imf::isNonImage(version))
    return damaged(name, "is a multi-part or deep OpenEXR file; only flat pictures are read");
  Imf::Header header;
  header.readFrom(input, version);
  return header;
}

Result<Grid> grid_of(const Imath::Box2i& window, Bytes bytes, const std::string& name) {
  SYMRIG_TRY(const Grid grid, checked_grid(std::int64_t{window.max.y} - window.min.y + 1,
                                           std::int64_t{window.max.x} - window.min.x + 1, name));
  // The strongest compression (DWAB) stores about 30,000 pixels of one value in a byte.
  constexpr std::size_t kPixelsInByte = std::size_t{1} << 17, kSlack = std::size_t{1} << 20;
  if (static_cast<std::size_t>(grid.size()) > kPixelsInByte * bytes.size() + kSlack)
    return damaged(name, "claims more pixels than its bytes can hold");
  return grid;
}

/// The pixels that the file holds, and the whole picture.
struct Windows {
  Imath::Box2i data, display;
};

/// Read from the header alone: Imf::InputFile allocates tables of the data window's size at once.
Result<Windows> peek_windows(Bytes bytes, const std::string& name) {
  SYMRIG_TRY(const Imf::Header header, peek_header(bytes, name));
  const Windows windows{header.dataWindow(), header.displayWindow()};
  SYMRIG_CHECK(grid_of(windows.data, bytes, name));
  SYMRIG_CHECK(grid_of(windows.display, bytes, name));
  if (windows.data.intersects(windows.display)) return windows;
  return damaged(name, "has all its pixels outside of its display window");
}

/// The picture that the display window shows. It is black where the file holds no pixels, as in a crop.
Image<float> displayed(const Image<float>& data, const Windows& windows) {
  const Imath::Box2i &from = windows.data, &shown = windows.display;
  const Grid grid{shown.max.y - shown.min.y + 1, shown.max.x - shown.min.x + 1};
  Image<float> picture(grid, data.channels());
  const int top = std::max(from.min.y, shown.min.y), bottom = std::min(from.max.y, shown.max.y);
  const int left = std::max(from.min.x, shown.min.x), right = std::min(from.max.x, shown.max.x);
  for (int c = 0; c < data.channels(); ++c)
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x)
        picture.at(y - shown.min.y, x - shown.min.x, c) = data.at(y - from.min.y, x - from.min.x, c);
  return picture;
}

/// Which channels hold the picture: R G B, or the only one that is not A.
Result<std::vector<std::string>> picture_channels(const Imf::ChannelList& list, const std::string& name) {
  if (list.findChannel("R") && list.findChannel("G") && list.findChannel("B"))
    return std::vector<std::string>{"R", "G", "B"};
  std::vector<std::string> names;
  for (auto it = list.begin(); it != list.end(); ++it) {
    if (std::strcmp(it.name(), "A") != 0) names.emplace_back(it.name());
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1)
      return damaged(name, "has subsampled channels");
  }
  if (names.size() == 1) return names;
  return damaged(name, "has neither R, G, B nor one single channel");
}

Result<Image<float>> decode(Bytes bytes, const std::string& name) {
  SYMRIG_TRY(const Windows windows, peek_windows(bytes, name));
  SYMRIG_TRY(const Grid grid, grid_of(windows.data, bytes, name));
  MemoryInput input(bytes, name);
  Imf::InputFile file(input, 0);
  SYMRIG_TRY(const auto names, picture_channels(file.header().channels(), name));
  if (!file.isComplete()) return damaged(name, "OpenEXR file is not complete");
  Image<float> image(grid, static_cast<int>(names.size()));
  const Imath::Box2i& window = windows.data;
  Imf::FrameBuffer frame;
  for (std::size_t c = 0; c < names.size(); ++c) {
    auto* plane = reinterpret_cast<char*>(image.plane(static_cast<int>(c)).data());
    frame.insert(names[c], Imf::Slice::Make(Imf::FLOAT, plane, window));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return windows.data == windows.display ? std::move(image) : displayed(image, windows);
}

Buffer encode(const Image<float>& image, const std::string& name, const PictureFacts& facts) {
  static constexpr std::array<const char*, 3> kColour{"R", "G", "B"};
  const Grid grid = image.grid();
  Imf::Header header(grid.cols, grid.rows);
  header.compression() = Imf::ZIP_COMPRESSION;
  write_facts(facts, header);
  Imf::FrameBuffer frame;
  for (int c = 0; c < image.channels(); ++c) {
    const char* channel = image.channels() == 1 ? "Y" : kColour[c];
    header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    const auto* plane = reinterpret_cast<const char*>(image.plane(c).data());
    frame.insert(channel, Imf::Slice::Make(Imf::FLOAT, plane, header.dataWindow()));
  }
  MemoryOutput output(name);
  {
    Imf::OutputFile file(output, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(grid.rows);
  }  // the destructor writes the line offsets
  return std::move(output.bytes);
}

}  // namespace

bool is_exr(Bytes bytes) {
  constexpr std::array kMagic{std::byte{0x76}, std::byte{0x2F}, std::byte{0x31}, std::byte{0x01}};
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

Result<Image<float>> decode_exr(Bytes bytes, const std::string& name) {
  try {
    return decode(bytes, name);
  } catch (const std::exception& exception) {
    return damaged(name, std::string("OpenEXR file cannot be read: ") + exception.what());
  }
}

Result<PictureFacts> decode_exr_facts(Bytes bytes, const std::string& name) {
  try {
    SYMRIG_TRY(const Imf::Header header, peek_header(bytes, name));
    return facts_of(header);
  } catch (const std::exception& exception) {
    return damaged(name, std::string("OpenEXR header cannot be read: ") + exception.what());
  }
}

Result<Buffer> encode_exr(const Image<float>& image, const std::string& name, const PictureFacts& facts) {
  try {
    return encode(image, name, facts);
  } catch (const std::exception& exception) {
    return Error{ErrorCode::io, name + ": OpenEXR file cannot be made: " + exception.what()};
  }
}

}  // namespace symrig::image

namespace symrig {

Result<std::vector<std::byte>> encode_exr(const Image<float>& image) {
  if (image.empty() || (image.channels() != 1 && image.channels() != 3))
    return Error{ErrorCode::bad_argument, "OpenEXR needs a picture of 1 or 3 channels",
                 "encode the channels one by one"};
  return image::encode_exr(image, "picture");
}

}  // namespace symrig
