"""Checks the shell commands of the documents, in blocks and in code within text, without running them.

Subcommands and options of vdi must be in its help, options of scripts in the script, and paths of the tree must
exist. A pattern of ctest -R must fit a test; where a test is left out because something isn't installed, its name
must be in some CMakeLists.txt. The changelog isn't checked: it tells of the past.

Arguments: the source folder, vdi, the build folder.
"""

import functools
import glob
import json
import os
import re
import shlex
import subprocess
import sys

SOURCE, TOOL, BUILD = sys.argv[1:4]
BLOCK = re.compile(r"^ *```(\w*)\n(.*?)^ *```$", re.M | re.S)
SPAN = re.compile(r"(?<!`)`([^`]+)`(?!`)")
COMMAND = re.compile(r"(?:vdi [a-z-]|scripts/[\w-]+(?: |$)|ctest |mpirun )")
SEPARATOR = re.compile(r"[;&|()<>]+")
PAST = {("docs/notes/margins-rather-than-sets.md", "--sets")}  # the note names the commit that has the option
FOLDERS = ("scripts/", "tests/", "python_pipelines/", "catalyst_adaptor/")


def documents():
    for folder, folders, names in os.walk(SOURCE):
        folders[:] = [name for name in folders if not name.startswith(".") and name not in ("build", "demo-output")]
        for name in names:
            if name.endswith(".md") and name != "CHANGELOG.md":
                yield os.path.join(folder, name)


def lines_of(text):
    """The shell lines of a document's blocks and code spans."""
    for language, block in BLOCK.findall(text):
        if language != "sh":
            continue
        document = None  # the end of a here-document
        for line in block.replace("\\\n", " ").splitlines():
            start = re.search(r"<<'?(\w+)'?", line)
            if document is None:
                yield line
                document = start and start[1]
            elif line == document:
                document = None
    for span in SPAN.findall(BLOCK.sub("", text)):
        line = re.sub(r"\s+", " ", span)
        if COMMAND.match(line):
            yield line


def commands_of(line):
    """The words of each simple command, also of a command within quotes."""
    lexer = shlex.shlex(line.replace("[", " ").replace("]", " "), posix=True, punctuation_chars=True)
    lexer.commenters = "#"
    command = []
    try:
        for word in lexer:
            if SEPARATOR.fullmatch(word):
                yield command
                command = []
                continue
            if " vdi " in word:
                yield from commands_of(word)
            command.append(word)
    except ValueError:  # an apostrophe, in text that isn't a command
        return
    yield command


@functools.lru_cache(None)
def help_of(*subcommand):
    return subprocess.run([TOOL, *subcommand, "--help"], stdout=subprocess.PIPE, text=True, check=True, timeout=60).stdout


def known_options(*subcommand):
    return re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", help_of(*subcommand))


@functools.lru_cache(None)
def test_names():
    done = subprocess.run(["ctest", "--show-only=json-v1"], cwd=BUILD, stdout=subprocess.PIPE, check=True, timeout=60)
    return [test["name"] for test in json.loads(done.stdout)["tests"]]


@functools.lru_cache(None)
def test_lists():
    paths = glob.glob(os.path.join(SOURCE, "tests", "**", "CMakeLists.txt"), recursive=True)
    return "".join(open(path).read() for path in paths)


def options_of(words):
    """The names of options, without values and numbers."""
    return [word.split("=")[0] for word in words if re.match(r"--?[a-zA-Z]", word)]


def faults_of_vdi(words):
    if not re.match("[a-z-]", words[0]):  # an argument of another program
        return
    subcommand = [] if words[0].startswith("-") else words[:1]
    if subcommand and subcommand[0] not in re.findall(r"^  ([a-z]+) ", help_of(), re.M):
        yield "vdi has no subcommand '%s'" % subcommand[0]
        return
    for option in options_of(words):
        if option not in known_options(*subcommand):
            yield "%s has no option %s" % (" ".join(["vdi", *subcommand]), option)


def faults_of_script(script, words):
    path = os.path.join(SOURCE, script)
    if not os.path.exists(path):
        yield "there is no " + script
    elif os.path.isfile(path):
        with open(path) as file:
            text = file.read()
        for option in options_of(words):
            if option not in text:
                yield "%s has no option %s" % (script, option)


def faults_of_ctest(words):
    for flag, pattern in zip(words, words[1:]):
        fits = re.compile(pattern).search if flag == "-R" else None
        name = re.sub(r"_np\d+$|_$", "", pattern)
        if fits and not any(map(fits, test_names())) and name not in test_lists():
            yield "no test fits ctest -R '%s'" % pattern


def faults_of(words):
    for i, word in enumerate(words):
        if word == "vdi" or word.endswith("/bin/vdi"):
            if i + 1 < len(words):
                yield from faults_of_vdi(words[i + 1:])
            return
        if word == "ctest":
            yield from faults_of_ctest(words[i + 1:])
            return
        if word.startswith("scripts/"):
            yield from faults_of_script(word, words[i + 1:])
            return
        if word.startswith(FOLDERS) and not glob.glob(os.path.join(SOURCE, word)):
            yield "there is no " + word


def main():
    checked, failures = 0, 0
    for path in sorted(documents()):
        with open(path) as file:
            text = file.read()
        document = os.path.relpath(path, SOURCE)
        for line in lines_of(text):
            for words in commands_of(line):
                checked += 1
                for fault in faults_of([word for word in words if (document, word) not in PAST]):
                    failures += 1
                    print("FAILED  %s: %s:\n  %s" % (document, fault, line))
    print("%d commands checked" % checked)
    sys.exit(failures > 0 or checked < 100)


main()
