"""Shared by tests with a pvserver. Loads no plugin."""

import os
import socket
import subprocess


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


def clean_environment(**more):
    """The environment without the variables of this process's MPI, which a new mpirun would take for its own."""
    ours = ("OMPI_ALLOW", "OMPI_MCA_rmaps_base", "OMPI_MCA_mpi_yield", "OMPI_MCA_btl_vader")
    kept = {name: value for name, value in os.environ.items()
            if not name.startswith(("OMPI_", "PMIX_", "ORTE_")) or name.startswith(ours)}
    return dict(kept, **more)


def start(*arguments, ranks=1, **options):
    """A pvserver, with `options` of subprocess.Popen."""
    mpiexec, pvserver = os.environ.get("MPIEXEC", "mpirun"), os.environ.get("PVSERVER", "pvserver")
    launcher = [mpiexec, "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
    options.setdefault("env", clean_environment())
    return subprocess.Popen(launcher + [pvserver, *arguments], stdin=subprocess.DEVNULL, **options)


def start_reverse(port, **options):
    """Starts a pvserver that connects to a listening client."""
    return start("--reverse-connection", "--client-host=127.0.0.1", "--server-port=" + port, **options)


def end(process, patience=20):
    """Ends one of ParaView's processes. When ParaView gets SIGTERM, it prints its stack, and locks
    up if it was just allocating memory, as it does when a client has left it. After `patience`
    seconds, it is killed."""
    process.terminate()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
