#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/JsonFile.h"
#include "bench/Compare.h"
#include "vdi/core/Error.h"

namespace vdi::bench {

namespace {

using nlohmann::json;

json readBench(const std::filesystem::path& path) {
  json document = apps::readJson(path);
  const auto isObject = [](const json& row) { return row.is_object(); };
  const bool sound = document.is_object() && document.contains("rows") && document["rows"].is_array() &&
                     std::all_of(document["rows"].begin(), document["rows"].end(), isObject) &&
                     document.contains("device") && document["device"].is_string();
  if (!sound) throw Error(ErrorCode::Format, "not a result of vdi bench", path.string());
  return document;
}

std::string keyOf(const json& row) {
  std::string key;
  for (const char* field : {"dataset", "algorithm", "supersegments", "width", "height", "view_deg",
                            "angle_deg", "scaling", "layout", "size", "zoom", "views"}) {
    if (row.contains(field)) key.append(key.empty() ? 0 : 1, ' ').append(row[field].dump());
  }
  if (row.contains("margin") && row["margin"] != 0.0) key += " margin " + row["margin"].dump();
  // One suite has rows of several rank counts. Files of the other suites may differ in rank count.
  if (row.contains("scaling") && row.contains("ranks")) key += " on " + row["ranks"].dump();
  return key;
}

/// A figure of the row; -1 if it is null or missing, so that nothing is compared.
double figure(const json& row, const char* field) {
  return row.contains(field) && row[field].is_number() ? row[field].get<double>() : -1.0;
}

}  // namespace

int compareBenches(const std::filesystem::path& before, const std::filesystem::path& after, std::FILE* out) {
  const json a = readBench(before);
  const json b = readBench(after);
  const bool sameDevice = a.value("device", "") == b.value("device", "");
  std::map<std::string, json> old;
  for (const json& row : a["rows"]) old[keyOf(row)] = row;
  int worse = 0;
  std::size_t compared = 0;
  const auto tell = [&](const std::string& key, const char* what, double was, double is) {
    fmt::print(out, "{}: {} was {:.4g}, is {:.4g}\n", key, what, was, is);
    ++worse;
  };
  for (const json& row : b["rows"]) {
    const std::string key = keyOf(row);
    const auto found = old.find(key);
    if (found == old.end()) continue;
    ++compared;
    for (const char* name : {"dvr", "generate", "render", "frame"}) {
      const std::string field = std::string(name) + "_ms";
      double was = figure(found->second, field.c_str());
      double is = figure(row, field.c_str());
      double noise = std::max(figure(found->second, (std::string(name) + "_spread_ms").c_str()),
                              figure(row, (std::string(name) + "_spread_ms").c_str()));
      if (was < 0.0 || is < 0.0) continue;
      if (!sameDevice) {
        if (figure(found->second, "dvr_ms") < 0.0 || figure(row, "dvr_ms") < 0.0) continue;
        was /= std::max(figure(found->second, "dvr_ms"), 1e-9);
        is /= std::max(figure(row, "dvr_ms"), 1e-9);
        noise = 0.0;
      }
      if (is > 1.1 * was && is - was > noise) tell(key, field.c_str(), was, is);
    }
    const double wasBytes = figure(found->second, "stored_bytes");
    const double isBytes = figure(row, "stored_bytes");
    if (wasBytes >= 0.0 && isBytes > 1.05 * wasBytes) tell(key, "stored_bytes", wasBytes, isBytes);
    const double wasSsim = figure(found->second, "ssim");
    const double isSsim = figure(row, "ssim");
    // SSIM with different reference pictures isn't comparable.
    if (figure(found->second, "truth_rate") != figure(row, "truth_rate")) continue;
    if (wasSsim >= 0.0 && isSsim >= 0.0 && isSsim < wasSsim - 0.002) tell(key, "ssim", wasSsim, isSsim);
  }
  fmt::print(out, "{} rows compared, {} figures became worse{}\n", compared, worse,
             sameDevice ? "" : "; the devices differ, so times are compared as multiples of DVR");
  if (compared == 0)
    throw Error(ErrorCode::InvalidArgument, "the files have no rows in common", after.string());
  return worse;
}

}  // namespace vdi::bench
