// SPDX-License-Identifier: Apache-2.0
#include "gige/gige_camera.hpp"

#include <fmt/format.h>

namespace symrig::gige {
namespace {

struct Entry {
  const char* name;
  unsigned value;
};

/// Writes nodes whose registers have the byte order of the camera's protocol.
class NodeWriter {
 public:
  explicit NodeWriter(const char* order) : order_(order) {}

  std::string reg(const std::string& name, unsigned at, const char* access, unsigned length = 4) const {
    return fmt::format(
        "<IntReg Name=\"{}\"><Address>{:#x}</Address><Length>{}</Length><AccessMode>{}</AccessMode>"
        "<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>{}</Endianess></IntReg>\n",
        name, at, length, access, order_);
  }

  std::string integer(const std::string& name, unsigned at, int least, int most,
                      const char* access = "RW") const {
    return fmt::format(
               "<Integer Name=\"{0}\"><pValue>{0}Reg</pValue><Min>{1}</Min><Max>{2}</Max></Integer>\n", name,
               least, most) +
           reg(name + "Reg", at, access);
  }

  /// An integer whose greatest value is a register of its own.
  std::string side(const std::string& name, unsigned at, unsigned most_at) const {
    return fmt::format(
               "<Integer Name=\"{0}\"><pValue>{0}Reg</pValue><Min>8</Min><pMax>{0}Max</pMax></Integer>\n"
               "<Integer Name=\"{0}Max\"><pValue>{0}MaxReg</pValue></Integer>\n",
               name) +
           reg(name + "Reg", at, "RW") + reg(name + "MaxReg", most_at, "RO");
  }

  std::string enumeration(const std::string& name, unsigned at, std::initializer_list<Entry> entries) const {
    std::string text = fmt::format("<Enumeration Name=\"{}\">", name);
    for (const auto& [entry, value] : entries)
      text += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry, value);
    return text + fmt::format("<pValue>{0}Reg</pValue></Enumeration>\n", name) + reg(name + "Reg", at, "RW");
  }

  std::string command(const std::string& name, unsigned at, unsigned value) const {
    return fmt::format(
               "<Command Name=\"{0}\"><pValue>{0}Reg</pValue><CommandValue>{1}</CommandValue></Command>\n",
               name, value) +
           reg(name + "Reg", at, "WO");
  }

  /// A number in microseconds, kept in nanoseconds.
  std::string microseconds(const std::string& name, unsigned at, double least, double most,
                           const char* access) const {
    return fmt::format(
               "<Float "
               "Name=\"{0}\"><pValue>{0}Swiss</pValue><Min>{1}</Min><Max>{2}</Max><Unit>us</Unit></Float>\n"
               "<Converter Name=\"{0}Swiss\"><FormulaTo>FROM * 1000</FormulaTo><FormulaFrom>TO / 1000.0"
               "</FormulaFrom><pValue>{0}Reg</pValue></Converter>\n",
               name, least, most) +
           reg(name + "Reg", at, access);
  }

  static std::string word(const std::string& name, unsigned at, unsigned length) {
    return fmt::format(
        "<StringReg Name=\"{}\"><Address>{:#x}</Address><Length>{}</Length><AccessMode>RO</AccessMode>"
        "<pPort>Device</pPort></StringReg>\n",
        name, at, length);
  }

  std::string chunk(const std::string& name, unsigned id, unsigned length) const {
    return fmt::format(
        "<Port Name=\"{0}Port\"><ChunkID>{1:x}</ChunkID></Port>\n"
        "<IntReg Name=\"{0}Reg\"><Address>0</Address><Length>{2}</Length><AccessMode>RO</AccessMode>"
        "<pPort>{0}Port</pPort><Sign>Unsigned</Sign><Endianess>{3}</Endianess></IntReg>\n",
        name, id, length, order_);
  }

  std::string chunk_features() const {
    return enumeration("ChunkSelector", 0x10044, {{"TriggerCounter", 0}, {"ExposureTime", 1}}) +
           "<Boolean Name=\"ChunkModeActive\"><pValue>ChunkModeActiveReg</pValue><OnValue>1</OnValue>"
           "<OffValue>0</OffValue></Boolean>\n" +
           reg("ChunkModeActiveReg", 0x10040, "RW") +
           "<Boolean Name=\"ChunkEnable\"><pValue>ChunkEnableReg</pValue><OnValue>1</OnValue>"
           "<OffValue>0</OffValue></Boolean>\n" +
           reg("ChunkEnableReg", 0x10048, "RW") + chunk("ChunkTriggerCounter", 0xC001, 4) +
           "<Integer Name=\"ChunkTriggerCounter\"><pValue>ChunkTriggerCounterReg</pValue></Integer>\n" +
           chunk("ChunkExposureTime", 0xC002, 8) +
           "<Float Name=\"ChunkExposureTime\"><pValue>ChunkExposureTimeSwiss</pValue></Float>\n"
           "<SwissKnife Name=\"ChunkExposureTimeSwiss\"><pVariable "
           "Name=\"NS\">ChunkExposureTimeReg</pVariable>"
           "<Formula>NS / 1000.0</Formula></SwissKnife>\n";
  }

 private:
  const char* order_;
};

constexpr const char* kHead =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<RegisterDescription ModelName=\"Loopback\" VendorName=\"Symrig\" StandardNameSpace=\"{}\" "
    "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" "
    "MinorVersion=\"0\" SubMinorVersion=\"0\" xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n";

constexpr const char* kPacketSize =
    "<Integer "
    "Name=\"GevSCPSPacketSize\"><pValue>GevSCPSPacketSizeReg</pValue><Min>576</Min><Max>16000</Max>"
    "</Integer>\n"
    "<MaskedIntReg Name=\"GevSCPSPacketSizeReg\"><Address>0xD04</Address><Length>4</Length>"
    "<AccessMode>RW</AccessMode><pPort>Device</pPort><LSB>31</LSB><MSB>16</MSB><Sign>Unsigned</Sign>"
    "<Endianess>BigEndian</Endianess></MaskedIntReg>\n";

/// The camera's names, in the registers where its protocol keeps them.
std::string identity(bool usb) {
  return NodeWriter::word("DeviceVendorName", usb ? 0x04 : 0x48, usb ? 64 : 32) +
         NodeWriter::word("DeviceModelName", usb ? 0x44 : 0x68, usb ? 64 : 32) +
         NodeWriter::word("DeviceSerialNumber", usb ? 0x144 : 0xD8, usb ? 64 : 16);
}

std::string clock(const NodeWriter& nodes, bool usb) {
  if (usb)
    return nodes.reg("TimestampLatchValue", 0x1F0, "RO", 8) + nodes.command("TimestampLatch", 0x1F8, 1);
  return nodes.reg("GevTimestampTickFrequency", 0x93C, "RO", 8) +
         nodes.reg("GevTimestampValue", 0x948, "RO", 8) + nodes.command("GevTimestampControlLatch", 0x944, 2);
}

}  // namespace

std::string camera_xml(const CameraTraits& traits, Protocol protocol) {
  const bool usb = protocol == Protocol::usb3_vision;
  const NodeWriter nodes(usb ? "LittleEndian" : "BigEndian");
  std::string text = fmt::format(kHead, usb ? "U3V" : "GEV");
  text += "<Category Name=\"Root\"><pFeature>Camera</pFeature></Category>\n<Category Name=\"Camera\">";
  for (const char* const name : {"DeviceVendorName",
                                 "DeviceModelName",
                                 "DeviceSerialNumber",
                                 "Width",
                                 "Height",
                                 "OffsetX",
                                 "OffsetY",
                                 "PixelFormat",
                                 "PayloadSize",
                                 "AcquisitionMode",
                                 "AcquisitionStart",
                                 "AcquisitionStop",
                                 "TriggerSelector",
                                 "TriggerMode",
                                 "TriggerSource",
                                 "TriggerActivation",
                                 "TriggerDelay",
                                 "TriggerOverlap",
                                 "ExposureMode",
                                 "ExposureTime",
                                 "Gain",
                                 "BlackLevel",
                                 "SensorReadoutTime",
                                 "LineInverter"})
    text += fmt::format("<pFeature>{}</pFeature>", name);
  if (traits.has_binning)
    text += "<pFeature>BinningHorizontal</pFeature><pFeature>BinningVertical</pFeature>";
  if (traits.longest_overlap) text += "<pFeature>ExposureOverlapTimeMax</pFeature>";
  text += "</Category>\n";
  text += identity(usb);
  text += nodes.side("Width", 0x10000, 0x10080) + nodes.side("Height", 0x10004, 0x10084) +
          nodes.integer("OffsetX", 0x10008, 0, traits.cols - 8) +
          nodes.integer("OffsetY", 0x1000C, 0, traits.rows - 8);
  if (traits.has_binning)
    text +=
        nodes.integer("BinningHorizontal", 0x10078, 1, 4) + nodes.integer("BinningVertical", 0x1007C, 1, 4);
  text += nodes.enumeration("PixelFormat", 0x10010,
                            {{"Mono8", 0x01080001},
                             {"Mono10", 0x01100003},
                             {"Mono12", 0x01100005},
                             {"Mono12p", 0x010C0047},
                             {"Mono12Packed", 0x010C0006},
                             {"Mono16", 0x01100007},
                             {"BayerRG12", 0x01100011},
                             {"RGB8", 0x02180014}});
  if (!usb) text += kPacketSize;
  text += nodes.integer("PayloadSize", 0x10050, 0, 1 << 30, "RO") +
          nodes.enumeration("AcquisitionMode", 0x10014, {{"Continuous", 0}});
  text += nodes.command("AcquisitionStart", 0x10018, 1) + nodes.command("AcquisitionStop", 0x10018, 0);
  text += nodes.integer("TLParamsLocked", 0x1001C, 0, 1);
  text += nodes.enumeration("TriggerSelector", 0x10060, {{"FrameStart", 0}}) +
          nodes.enumeration("TriggerMode", 0x10020, {{"Off", 0}, {"On", 1}}) +
          nodes.enumeration("TriggerSource", 0x10024, {{"Software", 0}, {"Line1", 1}, {"Line2", 2}}) +
          nodes.enumeration("TriggerActivation", 0x10028, {{"RisingEdge", 0}, {"LevelHigh", 1}}) +
          (traits.can_overlap ? nodes.enumeration("TriggerOverlap", 0x10088, {{"Off", 0}, {"ReadOut", 1}})
                              : nodes.enumeration("TriggerOverlap", 0x10088, {{"Off", 0}})) +
          nodes.enumeration("ExposureMode", 0x1002C, {{"Timed", 0}, {"TriggerWidth", 1}});
  text += nodes.microseconds("ExposureTime", 0x10030, 20,
                             static_cast<double>(traits.longest_exposure.count()), "RW") +
          nodes.microseconds("TriggerDelay", 0x10034, 0, 1e6, "RW") +
          nodes.microseconds("SensorReadoutTime", 0x10058, 0, 1e6, "RO");
  if (traits.longest_overlap) text += nodes.microseconds("ExposureOverlapTimeMax", 0x1008C, 0, 1e6, "RW");
  text += nodes.integer("Gain", 0x10038, 0, 24) + nodes.integer("BlackLevel", 0x1003C, 0, 255);
  text +=
      "<Boolean Name=\"LineInverter\"><pValue>LineInverterReg</pValue><OnValue>1</OnValue>"
      "<OffValue>0</OffValue></Boolean>\n" +
      nodes.reg("LineInverterReg", 0x10064, "RW");
  if (traits.has_chunks) text += nodes.chunk_features();
  if (traits.has_clock) text += clock(nodes, usb);
  return text + "<Port Name=\"Device\"></Port>\n</RegisterDescription>\n";
}

}  // namespace symrig::gige
