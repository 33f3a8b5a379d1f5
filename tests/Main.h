// The body that the main functions of all Catch2 programs share.
#pragma once

namespace vdi::test {

/// Runs the test cases that the command line names, and closes the devices that they have opened. Returns the
/// exit status.
int runCases(int argc, char** argv);

}  // namespace vdi::test
