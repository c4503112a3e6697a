// Readers that name what is wrong: a line, a column, a field.
#include "pipeline/model/files/motion_file.h"

#include <algorithm>
#include <sstream>

#include "core/errors.h"
#include "core/text/csv_reader.h"
#include "core/text/extension.h"
#include "core/text/json_object.h"
#include "core/text/parse_number.h"
#include "pipeline/model/files/json_field.h"
#include "pipeline/model/files/pose_file.h"
#include "pipeline/model/files/text_file.h"

namespace kvx {
namespace {

constexpr size_t kMostChannels = 10000;
constexpr double kSlowestRecording = 5;  // rows a second

double Number(std::string_view text, const std::string& where) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\r')) text.remove_suffix(1);
  if (const auto value = ParseFinite(text)) return *value;
  throw InputError(where + " is not a number");
}

// Where each of our motions finds its value.
struct Wiring {
  struct Wire {
    std::string dof;
    size_t column = 0;
    ChannelSource source;
  };
  std::vector<Wire> wires;

  Wiring(const ChannelMap& map, const std::vector<std::string>& columns) {
    for (const auto& [dof, source] : map) {
      const auto found = std::find(columns.begin(), columns.end(), source.column);
      if (found == columns.end())
        throw InputError("the motion has no column '" + source.column + "' for " + dof);
      wires.push_back({dof, size_t(found - columns.begin()), source});
    }
  }
  AnglePose Pose(const std::vector<double>& values) const {
    AnglePose pose;
    for (const Wire& wire : wires)
      pose.angles_rad[wire.dof] =
          RadFromDeg(wire.source.scale * values[wire.column] + wire.source.offset_deg);
    return pose;
  }
};

// Spreadsheets leave empty columns at the end.
std::vector<std::string> TitlesOf(const CsvRecord& header) {
  std::vector<std::string> titles;
  for (const std::string_view field : header) titles.emplace_back(CsvText(field));
  while (!titles.empty() && titles.back().empty()) titles.pop_back();
  return titles;
}

ChannelMap OwnNames(const std::vector<std::string>& columns, size_t time) {
  ChannelMap map;
  for (size_t c = 0; c < columns.size(); ++c) {
    if (c == time) continue;
    if (columns[c].find('.') == std::string::npos)
      throw InputError("column '" + columns[c] + "' is not named BONE.MOTION; give a map of columns");
    map[columns[c]] = {columns[c]};
  }
  return map;
}

// A recording has its own rate; rows farther apart are key frames.
double FpsOf(const KeyFrames& motion) {
  const double intervals = double(motion.frames.size()) - 1, duration_s = motion.Duration();
  const bool recorded = duration_s > 0 && intervals >= kSlowestRecording * duration_s;
  return recorded ? intervals / duration_s : KeyFrames().fps;
}

// BVH is words between white space; the hierarchy only matters for the order of channels.
class BvhReader {
 public:
  explicit BvhReader(std::string_view text) : in_(std::string(text)) {}

  KeyFrames Read(const ChannelMap& map) {
    Hierarchy();
    const Wiring wiring(map, channels_);
    const double frames = Value("Frames:", "the number of frames");
    Expect("Frame");
    const double step_s = Value("Time:", "the frame time");
    if (!(frames >= 1 && frames <= 1e6) || !(step_s > 0))
      throw InputError("the BVH file's number of frames or frame time makes no sense");
    KeyFrames motion;
    motion.fps = 1 / step_s;
    std::vector<double> values(channels_.size());
    for (int frame = 0; frame < int(frames); ++frame) {
      for (double& value : values)
        value = Number(Word(), "frame " + std::to_string(frame + 1) + " of the BVH file");
      motion.frames.push_back({frame * step_s, wiring.Pose(values)});
    }
    return motion;
  }

 private:
  std::string Word() {
    std::string word;
    if (!(in_ >> word)) throw InputError("the BVH file ends too early");
    return word;
  }
  void Expect(const std::string& wanted) {
    if (Word() != wanted) throw InputError("the BVH file has no '" + wanted + "' where one belongs");
  }
  double Value(const std::string& title, const std::string& what) {
    Expect(title);
    return Number(Word(), what + " of the BVH file");
  }
  void Channels(const std::string& joint) {
    const double count = Number(Word(), "the number of channels of a BVH joint");
    if (!(count >= 0 && count <= 6)) throw InputError("a BVH joint has 0 to 6 channels");
    for (int c = 0; c < int(count); ++c) channels_.push_back(joint + "." + Word());
    if (channels_.size() > kMostChannels) throw InputError("the BVH file has too many channels");
  }
  void Hierarchy() {
    Expect("HIERARCHY");
    std::vector<std::string> open;
    std::string joint;
    while (true) {
      const std::string word = Word();
      if (word == "MOTION" && open.empty()) return;
      if (word == "ROOT" || word == "JOINT" || word == "End")
        joint = Word();
      else if (word == "{")
        open.push_back(joint);
      else if (word == "}" && !open.empty())
        open.pop_back();
      else if (word == "OFFSET" && !open.empty())
        Word(), Word(), Word();
      else if (word == "CHANNELS" && !open.empty())
        Channels(open.back());
      else
        throw InputError("the BVH file's hierarchy has '" + word.substr(0, 32) + "' where a joint belongs");
    }
  }

  std::istringstream in_;
  std::vector<std::string> channels_;
};

}  // namespace

ChannelMap ParseChannelMap(std::string_view json) {
  const nlohmann::json document = ParseObject<nlohmann::json>(json, "the map of columns");
  ChannelMap map;
  for (const auto& [dof, field] : JsonField(document, "").Members()) {
    if (field.value().is_string()) {
      map[dof] = {field.Text()};
      continue;
    }
    field.RequireOnly({"column", "scale", "offset_deg"}, field.name());
    ChannelSource source{field.At("column").Text()};
    if (field.Has("scale")) source.scale = field.At("scale").Number();
    if (field.Has("offset_deg")) source.offset_deg = field.At("offset_deg").Number();
    map[dof] = source;
  }
  if (map.empty()) throw InputError("the map of columns is empty");
  return map;
}

KeyFrames ParseKeyFrames(std::string_view json, std::optional<double> fps) {
  const nlohmann::json document = ParseObject<nlohmann::json>(json, "the key frames");
  const JsonField root(document, "");
  root.RequireOnly({"fps", "interpolation", "frames"}, "the key frames");
  KeyFrames motion;
  if (root.Has("fps")) motion.fps = root.At("fps").Number();
  if (root.Has("interpolation"))
    motion.interpolation = InterpolationFromName(root.At("interpolation").Text());
  for (const JsonField& frame : root.At("frames").Items()) {
    frame.RequireOnly({"time", "joints", "scan_from_template", "scan"}, frame.name());
    motion.frames.push_back({frame.At("time").Number(), PoseOf(frame)});
  }
  if (fps) motion.fps = *fps;
  Validate(motion);
  return motion;
}

KeyFrames ParseMotionCsv(std::string_view text, const ChannelMap& map, std::optional<double> fps) {
  CsvReader reader(text, "motion");
  const std::vector<std::string> columns = TitlesOf(reader.Next());
  const size_t time = size_t(std::ranges::find(columns, "time", LowerCase) - columns.begin());
  if (time == columns.size()) throw InputError("the motion has no column 'time' (seconds)");
  const Wiring wiring(map.empty() ? OwnNames(columns, time) : map, columns);
  KeyFrames motion;
  while (!reader.AtEnd()) {
    const size_t line = reader.line();
    const CsvRecord cells = reader.Next();
    if (std::ranges::all_of(cells, [](std::string_view cell) { return CsvText(cell).empty(); })) continue;
    if (cells.size() < columns.size()) reader.ThrowAt(line, "there are fewer columns than in the header");
    reader.RequireNoMoreColumns(cells, columns.size(), line);
    const auto number = [&](size_t column) {
      const auto value = ParseFinite(reader.NumberText(cells[column], line));
      if (!value) reader.ThrowAt(line, "column '" + columns[column] + "' is not a number");
      return *value;
    };
    std::vector<double> values(columns.size(), 0.0);
    for (const Wiring::Wire& wire : wiring.wires) values[wire.column] = number(wire.column);
    motion.frames.push_back({number(time), wiring.Pose(values)});
  }
  motion.fps = fps ? *fps : FpsOf(motion);
  Validate(motion);
  return motion;
}

KeyFrames ParseMotion(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t\r\n");
  const bool json = first == text.npos || text[first] == '{' || text[first] == '[';
  return json ? ParseKeyFrames(text) : ParseMotionCsv(text, {});
}

KeyFrames ParseBvh(std::string_view text, const ChannelMap& map, std::optional<double> fps) {
  if (map.empty()) throw InputError("a BVH file needs a map from our motions to its channels");
  KeyFrames motion = BvhReader(text).Read(map);
  if (fps) motion.fps = *fps;
  Validate(motion);
  return motion;
}

KeyFrames ReadMotion(const std::filesystem::path& file, const ChannelMap& map, std::optional<double> fps) {
  if (HasExtension(file, ".json")) return ParseKeyFrames(FileText(file, "the motion file"), fps);
  if (HasExtension(file, ".csv")) return ParseMotionCsv(FileText(file, "the motion file"), map, fps);
  if (HasExtension(file, ".bvh")) return ParseBvh(FileText(file, "the motion file"), map, fps);
  throw InputError("a motion is a .json, .csv or .bvh file");
}

}  // namespace kvx
