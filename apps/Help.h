// The format of --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vdi::apps {

/// CLI11's format with wrapped lines, without the lists of options that exclude each other. An
/// error reports such a combination.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

/// A check for options: "must be > 0".
std::string requirePositive(const std::string& text);
/// A check for options: "must name a file", because an empty name would count as no name.
std::string requireFileName(const std::string& text);
/// A check for options: "must be a whole number from 0 to 2^64 - 1". CLI11 lets other numbers wrap
/// around.
std::string requireWholeNumber(const std::string& text);

}  // namespace vdi::apps
