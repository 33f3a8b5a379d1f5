"""Runs or compiles the snippets of README.md and the guides; recipes.py those of docs/recipes.md.

The tests add the surroundings that a document's text describes, such as the simulation's variables. They
change the snippets only in one port, which another program may hold, in one number of steps, and in the
number of pixels. Snippets share runs where they can, because ParaView takes seconds to start and to draw.

The environment has MPICC, MPICXX, MPIFORT, LIBRARY (libpv-vdi), PVBATCH, PV_PLUGIN_CONFIG_FILE and PYTHONPATH.
"""

import atexit
import functools
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

from documents import SOURCE, TOOL, main, made, run, snippets, tests, write

ADAPTOR = os.path.join(SOURCE, "catalyst_adaptor")
RUNS = tempfile.mkdtemp()
atexit.register(shutil.rmtree, RUNS)


def shared(function):
    """Decorates a function so that it runs at most once, in a folder that stays, and returns the folder's path."""
    @functools.cache
    def run_once():
        before, folder = os.getcwd(), os.path.join(RUNS, function.__name__)
        os.mkdir(folder)
        os.chdir(folder)
        try:
            function()
        finally:
            os.chdir(before)
        return folder
    return run_once


def vdi(*options):
    run(TOOL, "generate", *options, "--resolution", "48x32", "--supersegments", "8",
        "-o", "made.vdi")


def compile_c(declarations, text):
    write("snippet.c", """#include <mpi.h>
#include <stddef.h>
#include <stdint.h>
#include "vdi_catalyst.h"
void snippet(%s) {
%s}
""" % (declarations, text))
    run(os.environ["MPICC"], "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only",
        "-I", ADAPTOR, "snippet.c")


@tests("core", "README.md", "vdi_catalyst* catalyst;")
def c_in_short(text):
    compile_c("MPI_Comm comm, size_t block_count, const vdi_catalyst_block* blocks,"
              " const void* const* values, int64_t step, double time", text)


@tests("core", "docs/catalyst-guide.md", "const char* scripts[]")
def c_with_script(text):
    compile_c("MPI_Comm comm, vdi_catalyst* catalyst", text)


@tests("core", "docs/catalyst-guide.md", "vdi_catalyst* vdi;")
def c_with_json(text):
    compile_c("MPI_Comm comm, vdi_catalyst_block block, const void* pointer, int64_t step,"
              " double time", text)


@tests("core", "docs/catalyst-guide.md", "feed = ")
def c_parameter(text):
    compile_c("vdi_catalyst* catalyst", "double feed;\n" + text + "(void)feed;\n")


@tests("core", "docs/catalyst-guide.md", "vdi_catalyst_particles stars")
def c_particles(text):
    compile_c("vdi_catalyst* catalyst, int64_t count, const double* positions, const double* masses", text)


@tests("core", "docs/catalyst-guide.md", "type(c_ptr) :: vdi")
def fortran(text):
    declaration, statements = text.split("\n", 1)
    write("snippet.f90", """subroutine snippet(comm, blocks, name, values, step, time)
  use, intrinsic :: iso_c_binding
  use vdi_catalyst
  implicit none
  integer :: comm, code
  type(vdi_catalyst_block) :: blocks(1)
  character(kind=c_char, len=*) :: name
  real(c_double), target :: values(:, :, :)
  integer(c_int64_t) :: step
  real(c_double) :: time
%s
%send subroutine
""" % (declaration, statements))
    module = os.path.join(ADAPTOR, "vdi_catalyst.f90")
    run(os.environ["MPIFORT"], "-fsyntax-only", module, "snippet.f90")


def compile_cpp(text, *options):
    write("snippet.cpp", text)
    run(os.environ["MPICXX"], "-std=c++20", "-Wall", "-Wextra", "-Werror", "-DOMPI_SKIP_MPICXX",
        "-I", SOURCE, "snippet.cpp", *options)


@tests("core", "docs/cpp.md", "#include <vdi/io/VdiFile.h>")
def cpp_program(text):
    library = os.environ["LIBRARY"]
    compile_cpp(text, library, "-Wl,-rpath," + os.path.dirname(library), "-o", "snippet")
    run("./snippet")
    assert made("*.vdi") == ["ramp.vdi"], made("*.vdi")


@tests("core", "docs/cpp.md", "auto ranks = ")
def cpp_with_mpi(text):
    compile_cpp("""#include <mpi.h>
#include <utility>
#include "vdi/pipeline/VdiGenerator.h"
void snippet(const std::vector<vdi::Block>& blocks, const vdi::Camera& camera,
             const vdi::TransferFunction& function, const vdi::GenerateSettings& settings) {
%s}
""" % text, "-fsyntax-only")


def check_cmake(text):
    """The tests of the installation configure this project."""
    with open(os.path.join(SOURCE, "tests", "install", "project", "CMakeLists.txt")) as file:
        project = file.read()
    for line in text.splitlines():
        command = re.sub(r"\s*#.*", "", line).replace("(simulation ", "(from_c ")
        command = re.sub(r"COMPONENTS (catalyst|vdi)\)", "COMPONENTS catalyst vdi)", command)
        command = command.replace("(viewer PRIVATE pv-vdi::vdi)", "(from_cpp PRIVATE pv-vdi::vdi pv-vdi::catalyst)")
        assert command in project, "the tested project lacks: " + command


for document in ("docs/catalyst-guide.md", "docs/cpp.md"):
    tests("core", document, "find_package(pv-vdi")(check_cmake)


def check_run(text):
    write("viridis.json", '[{"Name": "viridis", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]}]')
    write("run.json", text)
    run(TOOL, "check", "run.json")


for document, start in (("README.md", '{"field": "V", "every": 10}'),
                        ("docs/catalyst-guide.md", '{"field": "V", "every": 10}'),
                        ("docs/catalyst-guide.md", '{\n  "field": "V",\n  "every": 10'),
                        ("docs/catalyst-guide.md", '{\n  "every": 10,\n  "colors": "haze"'),
                        ("docs/catalyst-guide.md", '{"field": "V", "every_time"'),
                        ("docs/catalyst-guide.md", '{"field": "V", "every": 10, "isolation"'),
                        ("docs/live.md", '{"field": "V", "stream"')):
    tests("core", document, start)(check_run)


@tests("core", "docs/live.md", '{"step":120,')
def steering_record(text):
    """tests/stream/steering_test.py checks the records that a run writes."""
    record = json.loads(text)
    assert list(record) == ["step", "time", "viewer", "steer"], record


def same_kind(a, b):
    """Whether two JSON values have the same names and types. Compares lists by first elements."""
    if isinstance(a, dict):
        same_names = isinstance(b, dict) and a.keys() == b.keys()
        return same_names and all(same_kind(a[name], b[name]) for name in a)
    if isinstance(a, list):
        return isinstance(b, list) and same_kind(a[0], b[0])
    return isinstance(b, (int, float)) if isinstance(a, (int, float)) else isinstance(b, type(a))


@tests("core", "docs/format.md", '{\n  "array"')
def metadata(text):
    vdi("--field", "sphere", "--size", "16x16x16")
    with open("made.vdi", "rb") as file:
        made = json.loads(re.search(rb"JSON.{12}(\{.*\})$", file.read(), re.S)[1])
    assert same_kind(json.loads(text), made), "a file has: %s" % made


@tests("core", "docs/raw-volumes.md", '{\n  "file": "volume.raw"')
def sidecar(text):
    write("volume.json", text)
    with open("volume.raw", "wb") as file:
        file.truncate(2 * 256 * 256 * 109)
    vdi("--raw", "volume.json")


@tests("core", "docs/raw-volumes.md", '{\n  "colors"')
def transfer_function(text):
    write("colors.json", text)
    vdi("--field", "sphere", "--size", "16x16x16", "--type", "u8",
        "--transfer-function", "colors.json")


@tests("core", "docs/raw-volumes.md", '{"position"')
def camera(text):
    write("camera.json", text)
    vdi("--field", "sphere", "--size", "16x16x16", "--camera", "camera.json")


@tests("core", "docs/python.md", "import pv_vdi")
def read_in_python(text):
    vdi("--field", "sphere", "--size", "16x16x16")
    os.rename("made.vdi", "vdi_000100.vdi")
    run(sys.executable, "-c", text + "assert turned.shape == (720, 1280, 4), turned.shape\n")


def snippet(start):
    """The snippet that begins so."""
    return next(text for _, text in snippets() if text.startswith(start))


def changed(text, old, new):
    """The text with `new` in the place of `old`, which it has once."""
    assert text.count(old) == 1, "%d times %r in:\n%s" % (text.count(old), old, text)
    return text.replace(old, new)


SMALL = "[160, 90]"
GUIDE = snippet("image.Resolution = ")
EXTRACTOR = snippet("stream = CreateExtractor")
STEERED = snippet("stream.Writer.Steer = 1")
with open(os.path.join(SOURCE, "python_pipelines", "minimal.py")) as file:
    MINIMAL = file.read()


def in_situ(script, steps=1):
    """Runs a script in a simulation of the cells of a cube."""
    write("script.py", script)
    write("simulation.py", """import numpy as np
from mpi4py import MPI
from pv_vdi.catalyst import Block, Catalyst

N = 16
with Catalyst(MPI.COMM_WORLD, ["script.py"]) as catalyst:
    catalyst.set_blocks([Block((N, N, N), (0, 0, 0), (1 / N,) * 3)])
    catalyst.set_array("V", [np.linspace(0, 0.45, N ** 3).reshape(N, N, N)])
    for step in range(%d):
        catalyst.execute(step, 0.1 * step)
""" % steps)
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    run(sys.executable, "simulation.py", env=environment)


@shared
def streamed():
    """The guide's changes of minimal.py, which streams its VDIs as well."""
    in_situ(MINIMAL + changed(GUIDE, "[1280, 720]", SMALL) + changed(EXTRACTOR, "8080", "0") + STEERED
            + "assert (stream.Writer.Port, stream.Writer.Steer) == (0, 1)\n", 11)


@tests("paraview", "docs/catalyst-guide.md", 'image = VolumetricDepthImage(Input=TrivialProducer')
def script_in_short(text):
    in_situ("from paraview.simple import *\n" + text + "image.Resolution = " + SMALL + "\n")
    assert made("*.vdi") == ["vdi_000000.vdi"], made("*.vdi")


@tests("paraview", "docs/catalyst-guide.md", "image.Resolution = ")
def script_in_full(_):
    os.chdir(streamed())
    assert made("*.vdi") == ["vdi_000000.vdi", "vdi_000010.vdi"], made("*.vdi")


@tests("paraview", "docs/live.md", "stream = CreateExtractor")
def extractor_of_stream(_):
    streamed()


@tests("paraview", "docs/live.md", "stream.Writer.Steer = 1")
def steered_stream(_):
    streamed()


@tests("paraview", "docs/python.md", "import numpy as np")
def simulation_in_python(text):
    write("snippet.py", "def advance(values):\n    values += 0.01\n\n\n"
          + text.replace("range(100)", "range(11)"))
    run(sys.executable, "snippet.py")
    assert len(made("*.vdi")) == 2, made("*.vdi")


@tests("paraview", "docs/python.md", "catalyst.set_particles")
def particles_in_python(text):
    write("snippet.py", """import numpy as np
from mpi4py import MPI
from pv_vdi.catalyst import Block, Catalyst

positions = np.random.default_rng(1).uniform(0, 1, (500, 3))
masses = np.ones(500)
with Catalyst(MPI.COMM_WORLD, json={"field": "density", "resolution": [48, 32]}) as catalyst:
    catalyst.set_blocks([Block((8, 8, 8), spacing=(1 / 8,) * 3)])
    %s
    catalyst.execute(0)
""" % text)
    run(sys.executable, "snippet.py")
    assert made("*.vdi") == ["vdi_000000.vdi"], made("*.vdi")


def pvbatch(script):
    write("script.py", script)
    run(os.environ["PVBATCH"], "script.py")


WRITING = snippet("from paraview.simple import *\nLoadDistributed")
LOADING = snippet("LoadDistributedPlugin(")
SHOWING = snippet("reader = OpenDataFile")
LOOKING = snippet("reader.SMProxy.UpdatePropertyInformation()")
STREAM = snippet("stream = VDIStream(URL=link)")


@shared
def written():
    pvbatch(changed(WRITING, "image.CameraPosition", "image.Resolution = " + SMALL + "\nimage.CameraPosition"))


@shared
def looked_at():
    """The file that README.md's script writes, and a server's VDI, shown by a script of a client."""
    shutil.copy(os.path.join(written(), "wavelet.vdi"), ".")
    vdi("--field", "sphere", "--size", "16x16x16")
    command = [TOOL, "serve", "--finished", "made.vdi"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            pvbatch("from paraview.simple import *\n" + LOADING + "VolumetricDepthImage(Input=Wavelet())\n"
                    + "CreateRenderView(ViewSize=" + SMALL + ")\n"
                    + SHOWING + LOOKING + "assert list(view.CameraPosition) == [60, 45, 75]\n"
                    + "link = %r\n" % server.stdout.readline().strip()
                    + STREAM + "assert stream.GetDataInformation().GetNumberOfPoints() > 0\n")
        finally:
            server.terminate()


@tests("paraview", "README.md", "from paraview.simple import *\nLoadDistributedPlugin")
def script_with_filter(_):
    os.chdir(written())
    assert made("wavelet*") == ["wavelet.vdi", "wavelet_20.png"], made("wavelet*")


@tests("paraview", "docs/user-guide.md", "LoadDistributedPlugin(")
def plugin_of_a_client(_):
    looked_at()


@tests("paraview", "docs/user-guide.md", "reader = OpenDataFile")
def shown_file(_):
    os.chdir(looked_at())
    assert made("wavelet.png"), made("*")


@tests("paraview", "docs/user-guide.md", "reader.SMProxy.UpdatePropertyInformation()")
def own_viewpoint(_):
    looked_at()


@tests("paraview", "docs/live.md", "stream = VDIStream(URL=link)")
def stream_source(_):
    looked_at()


main()
