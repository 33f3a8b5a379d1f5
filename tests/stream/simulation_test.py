"""A simulation whose script offers its VDIs. Arguments: vdi, the script, mpirun and what follows it on its command line."""
import os
import pathlib
import subprocess
import sys
import tempfile
import time

vdi, script, *launch = sys.argv[1:]
PATIENCE = 150

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    link = folder / "vdi-stream.link"
    # The simulation runs until this test ends it.
    simulation = subprocess.Popen([*launch, "--size", "24", "--blocks", "2", "--steps", "1000000", "--every", "5", "--script",
                                   script], env={**os.environ, "VDI_OUTPUT": name}, stdout=subprocess.DEVNULL)
    try:
        end = time.monotonic() + PATIENCE
        while not link.exists():
            if simulation.poll() is not None or time.monotonic() > end:
                sys.exit("FAILED  no link")
            time.sleep(0.1)
        done = subprocess.run([vdi, "receive", link.read_text().strip(), "-o", folder / "got", "--frames", "3"],
                              capture_output=True, text=True, timeout=PATIENCE)
        print(done.stdout, done.stderr)
        if done.returncode != 0:
            sys.exit("FAILED  vdi receive")
        steps = [int(line.split("step ")[1].split(",")[0]) for line in done.stdout.splitlines()]
        if len(steps) != 3 or steps != sorted(set(steps)) or any(step % 5 for step in steps):
            sys.exit("FAILED  the steps are %s" % steps)
        if len({path.read_bytes() for path in (folder / "got").glob("*.vdi")}) != 3:
            sys.exit("FAILED  the frames are the same")
    finally:
        simulation.terminate()
        simulation.wait(PATIENCE)
