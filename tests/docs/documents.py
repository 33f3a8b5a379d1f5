"""Shared by the tests of the snippets of README.md and docs/*.md.

Each snippet in C, C++, Fortran, CMake, Python and JSON needs a test, and each test needs its snippet.
Arguments: a part (core, paraview or recipes), the source folder, vdi.
"""

import collections
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

PART, SOURCE, TOOL = sys.argv[1:4]
LANGUAGES = ("c", "cpp", "fortran", "cmake", "python", "json")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)
Test = collections.namedtuple("Test", "part document start function")
TESTS = []


def snippets():
    """(document, text) of each fenced block in one of the languages, in the documents of the part."""
    guides = sorted(glob.glob(os.path.join(SOURCE, "docs", "*.md")))
    for path in [os.path.join(SOURCE, "README.md"), *guides]:
        if (os.path.basename(path) == "recipes.md") != PART.startswith("recipes"):
            continue
        with open(path) as file:
            for language, text in BLOCK.findall(file.read()):
                if language in LANGUAGES:
                    yield os.path.relpath(path, SOURCE), text


def tests(part, document, start):
    """Registers a function as the test of the document's snippet that begins with `start`."""
    def register(function):
        TESTS.append(Test(part, document, start, function))
        return function
    return register


def run(*command, **options):
    """Runs a command in the present folder. Throws with its output if it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=200, **options)
    line = " ".join(command)
    assert done.returncode == 0, "%s: status %d\n%s" % (line, done.returncode, done.stdout)


def write(name, text):
    with open(name, "w") as file:
        file.write(text)


def made(pattern):
    """Sorted names of the files that a test has made, in any folder."""
    paths = glob.glob(os.path.join("**", pattern), recursive=True)
    return sorted(os.path.basename(path) for path in paths)


def fits(test, document, text):
    return test.document == document and text.startswith(test.start)


def passes(function, text):
    """Runs a test in a folder of its own, and prints the result and the seconds it took."""
    folder, begin = tempfile.mkdtemp(), time.monotonic()
    os.chdir(folder)
    try:
        function(text)
        print("passed  %s, %.1f s" % (function.__name__, time.monotonic() - begin), flush=True)
        return True
    except Exception as error:
        print("FAILED  %s: %s\n%s" % (function.__name__, error, text), flush=True)
        return False
    finally:
        os.chdir(SOURCE)
        shutil.rmtree(folder)


def main():
    failures = 0
    found = list(snippets())
    for document, text in found:
        fitting = [test for test in TESTS if fits(test, document, text)]
        if len(fitting) != 1:
            failures += 1
            print("FAILED  %s has a snippet with %d tests:\n%s" % (document, len(fitting), text))
        elif fitting[0].part == PART:
            failures += not passes(fitting[0].function, text)
    for test in TESTS:
        if not any(fits(test, document, text) for document, text in found):
            failures += 1
            print("FAILED  %s has no snippet for %s" % (test.document, test.function.__name__))
    sys.exit(failures > 0)
