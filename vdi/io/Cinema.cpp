#include "vdi/io/Cinema.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"

namespace vdi::io {

namespace {

std::string_view columnsOf(bool hasFields) {
  return hasFields ? "time,phi,theta,field,FILE" : "time,phi,theta,FILE";
}

}  // namespace

CinemaIndex::CinemaIndex(std::filesystem::path folder, bool keep, bool hasFields)
    : folder_(std::move(folder)), hasFields_(hasFields) {
  std::error_code error;
  if (keep && std::filesystem::is_regular_file(path(), error)) read();
}

void CinemaIndex::read() {
  const std::vector<std::byte> bytes = InputFile(path()).readAll();
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string_view columns = columnsOf(hasFields_);
  bool isFirst = true;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) continue;
    const bool isSound =
        isFirst ? line == columns : std::ranges::count(line, ',') == std::ranges::count(columns, ',');
    if (!isSound) {
      throw Error(ErrorCode::Format, fmt::format("isn't an index with the columns {}", columns),
                  path().string());
    }
    if (!isFirst) put(std::string(line.substr(line.rfind(',') + 1)), std::string(line));
    isFirst = false;
  }
}

void CinemaIndex::add(const CinemaPicture& picture) {
  const std::string field = hasFields_ ? picture.field + "," : "";
  put(picture.file,
      fmt::format("{},{},{},{}{}", picture.time, picture.phi, picture.theta, field, picture.file));
}

void CinemaIndex::put(const std::string& file, std::string line) {
  const auto [place, isNew] = lineOf_.try_emplace(file, lines_.size());
  if (isNew) {
    lines_.push_back(std::move(line));
  } else {
    lines_[place->second] = std::move(line);
  }
}

void CinemaIndex::write() const {
  std::string text(columnsOf(hasFields_));
  text += '\n';
  for (const std::string& line : lines_) text += line + '\n';
  writeAtomically(path(), std::as_bytes(std::span(text)));
}

}  // namespace vdi::io
