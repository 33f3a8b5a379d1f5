// How --help looks.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vdi::apps {

/// CLI11's, with wrapped lines, and without the lists of options that exclude each other: whoever mixes them
/// is told.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

/// A check for options: "must be > 0".
std::string requirePositive(const std::string& text);
/// A check for options: "must name a file", for an empty name would count as none given.
std::string requireFileName(const std::string& text);
/// A check for options: "must be a whole number from 0 to 2^64 - 1". CLI11 lets others wrap around.
std::string requireWholeNumber(const std::string& text);

}  // namespace vdi::apps
