"""Checks that each link between the documents below a folder leads to a file, and to a heading where it names one.

Argument: the folder, which is the source folder or that of installed documents.
"""

import os
import re
import sys

FOLDER = os.path.realpath(sys.argv[1])
CODE = re.compile(r"^ *```.*?^ *```$|(?<!`)`[^`]+`(?!`)", re.M | re.S)
LINK = re.compile(r"\]\(([^)\s]+)\)")
SKIPPED = ("build", "demo-output", "shared")


def documents():
    for folder, folders, names in os.walk(FOLDER):
        folders[:] = [name for name in folders if not name.startswith(".") and name not in SKIPPED]
        yield from (os.path.join(folder, name) for name in names if name.endswith(".md"))


def anchors(path):
    """The anchors of a document: those of its headings, as GitHub makes them, and those that it names."""
    with open(path) as file:
        text = re.sub(r"^ *```.*?^ *```$", "", file.read(), flags=re.M | re.S)
    made = set(re.findall(r'<a id="([^"]+)">', text))
    for heading in re.findall(r"^#+ (.*)$", text, re.M):
        heading = re.sub(r"\]\([^)]*\)", "", heading)  # of a link, the text counts
        made.add(re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-"))
    return made


def fault(document, link):
    """Why the link is broken, or None."""
    name, _, anchor = link.partition("#")
    target = os.path.realpath(os.path.join(os.path.dirname(document), name)) if name else document
    if not os.path.exists(target) or os.path.relpath(target, FOLDER).startswith(".."):
        return "there is no such file"
    if anchor and target.endswith(".md") and anchor not in anchors(target):
        return "there is no such heading"
    return None


def main():
    checked, failures = 0, 0
    for document in sorted(documents()):
        with open(document) as file:
            text = CODE.sub("", file.read())
        for link in LINK.findall(text):
            if re.match(r"[a-z]+:", link):
                continue
            checked += 1
            why = fault(document, link)
            if why:
                failures += 1
                print("FAILED  %s: %s: %s" % (os.path.relpath(document, FOLDER), link, why))
    print("%d links checked" % checked)
    sys.exit(failures > 0 or checked < 100)


main()
