"""ParaView's window with the plugin, connected to a server without it: Output Messages shows one line with the remedy."""

import os
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import server  # noqa: E402

OUTPUT = os.path.join(os.environ["VDI_TEST_OUTPUT"], "client_only")
LOG = os.path.join(OUTPUT, "client.log")
os.makedirs(os.path.join(OUTPUT, "home"), exist_ok=True)


def lines():
    """The lines of the window's output that are about the server."""
    with open(LOG) as log:
        return [line for line in log if "Remote Plugins" in line]


def wait_for(what, holds):
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end, "there is no " + what
        time.sleep(0.1)


port = server.free_port()
with open(LOG, "w") as log, open(os.path.join(OUTPUT, "server.log"), "w+") as server_log:
    pvserver = server.start("--server-port=" + port, stdout=server_log, stderr=server_log)
    client = None
    try:
        wait_for("server", lambda: "Accepting" in open(server_log.name).read() or pvserver.poll() is not None)
        client = subprocess.Popen(
            ["paraview", "--disable-registry", "--server-url=cs://127.0.0.1:" + port], stdout=log, stderr=log,
            env=server.clean_environment(PV_PLUGIN_CONFIG_FILE=os.environ["VDI_PLUGIN_LIST"],
                                         HOME=os.path.join(OUTPUT, "home")))
        wait_for("line about the server", lambda: lines() or client.poll() is not None)
        time.sleep(3)  # ParaView shows its plugin manager, and lists the loaded plugins again
    finally:
        for process in (client, pvserver):
            if process is not None:
                server.end(process)
said = lines()
print("".join(said))
assert len(said) == 1 and "VolumetricDepthImages" in said[0], "the window says it %d times" % len(said)
