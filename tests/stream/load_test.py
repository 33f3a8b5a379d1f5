"""Measures the cost to `vdi serve` of many clients, of slow ones, and of many frames. Arguments: vdi, how many connections one
after another (10000), how many frames (4000). It prints the server's memory, threads and open files before and after."""
import os
import pathlib
import selectors
import socket
import struct
import sys
import tempfile
import threading
import time

from tool import PATIENCE, Server, make, until
from viewer import Closed, Viewer

count = int(sys.argv[1]) if len(sys.argv) > 1 else 10000
frame_count = int(sys.argv[2]) if len(sys.argv) > 2 else 4000
failures = []


def check(condition, what):
    print("ok      " if condition else "FAILED  ", what, flush=True)
    if not condition:
        failures.append(what)


def standing(server):
    """Resident MiB, threads, open files."""
    lines = pathlib.Path(f"/proc/{server.process.pid}/status").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    files = len(list(pathlib.Path(f"/proc/{server.process.pid}/fd").iterdir()))
    return int(fields["VmRSS"].split()[0]) / 1024, int(fields["Threads"]), files


def connect(server):
    return socket.create_connection(("127.0.0.1", server.port), PATIENCE)


def page(server):
    assert server.get("/")[0].status == 200


def stranger(server):
    assert server.get("/status")[0].status == 401


def viewer_of(server):
    viewer = Viewer(server.port, PATIENCE)
    viewer.hello(server.token)
    return viewer


def visitor(server):
    viewer = viewer_of(server)
    next(viewer.levels())
    viewer.close()


def silent(server):
    connect(server).close()


def abrupt(server):
    """A client that resets its connection in the middle of its request."""
    connection = connect(server)
    connection.sendall(b"GET /stream HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgr")
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()


def vanishing(server):
    """A viewer that closes when a level has begun."""
    viewer = viewer_of(server)
    viewer.text_message("level")
    viewer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    viewer.close()


def one_after_another(server):
    kinds = [page, stranger, visitor, silent, abrupt, vanishing]
    for number in range(60):
        kinds[number % len(kinds)](server)
    until(lambda: server.viewers() == 0, "no viewers")
    before = standing(server)
    start = time.monotonic()
    for number in range(count):
        kinds[number % len(kinds)](server)
    seconds = time.monotonic() - start
    until(lambda: server.viewers() == 0 and standing(server)[2] <= before[2], "closed connections")
    after = standing(server)
    print("%d connections in %.1f s: %.1f MiB, %d threads, %d files before; %.1f, %d, %d after" %
          (count, seconds, *before, *after))
    check(after[0] - before[0] < 16, "connections leave no memory behind")
    check(after[1] == before[1] and after[2] <= before[2], "connections leave no threads and no files behind")


def at_once(server):
    codes, frames = [], []

    def look():
        viewer = viewer_of(server)
        try:
            frames.append(next(viewer.levels())[1])
            start.wait(PATIENCE)
        except Closed as closed:
            codes.append(closed.code)
            start.wait(PATIENCE)
        viewer.close()

    start = threading.Barrier(100)
    threads = [threading.Thread(target=look) for _ in range(100)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    print("100 at once: %d are shown a frame, %d are refused; %.1f MiB" % (len(frames), len(codes), standing(server)[0]))
    check(len(frames) == 64 and codes == [4503] * 36, "64 of 100 viewers are let in, the others are told why not")
    check(len(set(frames)) == 1, "all viewers that are let in see the same")


def slowly(server):
    """More connections than the server takes, each of which sends a byte now and then."""
    before = standing(server)
    seen = viewer_of(server)
    seen.text_message("level")
    slow = [connect(server) for _ in range(400)]
    selector = selectors.DefaultSelector()
    for connection in slow:
        connection.setblocking(False)
        selector.register(connection, selectors.EVENT_READ)
    request = b"GET /stream HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Header: " + b"x" * 100
    start = time.monotonic()
    longest, answered, lost = 0.0, 0, {}
    for step in range(len(request)):
        if len(lost) == len(slow) or time.monotonic() > start + 30:
            break
        for connection in slow:
            if connection in lost:
                continue
            try:
                connection.send(request[step:step + 1])
            except OSError:
                lost[connection] = time.monotonic() - start
        asked = time.monotonic()
        visitor(server)
        answered += 1
        longest = max(longest, time.monotonic() - asked)
        time.sleep(0.25)
        for key, _ in selector.select(0):
            try:
                key.fileobj.recv(100)
            except OSError:
                pass
            lost.setdefault(key.fileobj, time.monotonic() - start)
            selector.unregister(key.fileobj)
    print("400 slow ones: %d lost, the last after %.1f s; meanwhile %d viewers were shown a frame, within %.2f s; %.1f MiB" %
          (len(lost), max(lost.values(), default=0), answered, longest, standing(server)[0]))
    check(len(lost) == 400 and max(lost.values()) < 20, "slow connections are cut off")
    check(answered > 10 and longest < 5, "slow connections keep no viewer out")
    seen.send(type="pause")
    check(server.viewers() == 1, "the viewer who was there before stays")
    seen.close()
    for connection in slow:
        connection.close()
    until(lambda: standing(server)[2] <= before[2], "closed connections")
    check(standing(server)[0] - before[0] < 16, "slow connections leave no memory behind")


def frames(server, files, live, name, kept):
    """Copies of the files appear by turns, with names that `name` gives, and the last few stay. One viewer takes them,
    the other takes nothing."""
    levels = viewer_of(server).levels()
    stalled = viewer_of(server)
    before = None
    contents = [file.read_bytes() for file in files]
    for number in range(frame_count + 200):
        if number == 200:  # after buffers have grown
            before = standing(server)
        data = contents[number % len(contents)]
        (live / "part").write_bytes(data)
        os.rename(live / "part", live / name(number))
        if next(levels)[1] != data:
            check(False, f"frame {number}")
        if number >= kept:
            os.remove(live / name(number - kept))
    after = standing(server)
    print("%d frames: %.1f MiB, %d threads, %d files before; %.1f, %d, %d after" % (frame_count, *before, *after))
    # A series stores the time and the step of each frame, and takes twice that while it grows.
    check(after[0] - before[0] < 1 + 64 * frame_count / (1 << 20), "frames leave no memory behind but the series'")
    check(after[1:] == before[1:], "frames leave no threads and no files behind")
    for announced, got in stalled.levels():
        if announced["frame"] == frame_count + 199:
            break
    check(got == data, "a viewer that stalled has the newest frame in the end")


with tempfile.TemporaryDirectory() as folder:
    made = [pathlib.Path(folder) / f"small{step}.vdi" for step in range(2)]
    for step, path in enumerate(made):
        make(path, "24x24x24", "48x32", 6, step)
    running = Server(made[0])
    try:
        one_after_another(running)
        at_once(running)
        slowly(running)
        check(running.end() == 0, "the server ends in order")
        check(running.said() == "", "the server had nothing to complain about")
    finally:
        running.close()
    for way, kept, name in (("appearing", 4, "{:06}.vdi".format), ("overwritten", 1 << 30, lambda number: "latest.vdi")):
        changing = pathlib.Path(folder) / way
        changing.mkdir()
        running = Server(changing)
        try:
            frames(running, made, changing, name, kept)
            check(running.end() == 0, "the server ends in order")
            check(running.said() == "", "the server had nothing to complain about")
        finally:
            running.close()
sys.exit(1 if failures else 0)
