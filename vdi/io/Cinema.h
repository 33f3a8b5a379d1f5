// The index of a Cinema database (specification D), which Cinema viewers read.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vdi::io {

/// A picture, its viewpoint and its field.
struct CinemaPicture {
  double time = 0.0;       // of the simulation
  double phi = 0.0;        // degrees: azimuth
  double theta = 0.0;      // degrees: elevation
  std::string file;        // relative to the database's folder
  std::string field = {};  // without commas and line ends; used if the index has fields
};

/// data.csv in the database's folder: a line for each picture, with the columns time, phi, theta and FILE,
/// and before the last one field, if the index has several.
class CinemaIndex {
 public:
  /// With `keep`, begins with the pictures of an existing index. Throws Error: Io as InputFile, Format for an
  /// index that has other columns.
  CinemaIndex(std::filesystem::path folder, bool keep, bool hasFields = false);

  /// Adds the picture, or replaces the one with the same file. `write` stores the change.
  void add(const CinemaPicture& picture);
  /// Writes the index; readers see the old one or the new one. Throws Error{Io} as writeAtomically.
  void write() const;
  std::filesystem::path path() const { return folder_ / "data.csv"; }

 private:
  void put(const std::string& file, std::string line);
  void read();

  std::filesystem::path folder_;
  bool hasFields_;
  std::vector<std::string> lines_;             // of pictures
  std::map<std::string, std::size_t> lineOf_;  // by file
};

}  // namespace vdi::io
