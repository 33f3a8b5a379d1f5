#pragma once
// Catch2, whose headers and some names differ between versions 2 and 3. CMakeLists.txt covers the differences
// on its command line.

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_approx.hpp>
#include <catch2/catch_session.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators_all.hpp>
#include <catch2/matchers/catch_matchers.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif

#include <string>

namespace vdi::test {

#if __has_include(<catch2/catch_all.hpp>)
using Catch::Matchers::ContainsSubstring;
#else
/// Matches texts that contain `part`, by the name that version 3 has.
inline auto ContainsSubstring(const std::string& part) {  // NOLINT(readability-identifier-naming)
  return Catch::Matchers::Contains(part);
}
#endif

}  // namespace vdi::test
