"""`vdi serve --stdio` at the end of a command, and --from. `sh -c` takes the place of ssh. Argument: vdi."""
import json
import os
import pathlib
import shlex
import shutil
import signal
import socket
import subprocess
import time
import unittest

from tool import PATIENCE, VDI, ServedFolder, make, receive, run, until
from viewer import OneViewer


def vdi(*arguments):
    return " ".join(shlex.quote(str(part)) for part in (VDI, *arguments))


def serving_at_a_pipe(folder):
    """The processes that run vdi serve --stdio for that folder."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            command = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"--stdio" in command and os.fsencode(folder) in command:
            found.append(int(path.parent.name))
    return found


def listens(process):
    """Whether the process has a listening TCP socket."""
    inodes = set()
    for table in ("tcp", "tcp6"):
        for line in pathlib.Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A":
                inodes.add(f"socket:[{fields[9]}]")
    return any(os.readlink(entry) in inodes for entry in pathlib.Path(f"/proc/{process}/fd").iterdir() if entry.is_symlink())


class PipeTest(ServedFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for step in range(3):
            make(cls.made / f"small{step}.vdi", "24x24x24", "48x32", 6, step)
        make(cls.made / "large.vdi", "24x24x24", "320x240", 8, 9)

    def test_receive_takes_all_frames_of_a_series(self):
        names = ["small0", "large", "small2"]
        # Lines that a login shell may say first are skipped.
        command = "echo 'Welcome to the cluster'; echo; exec " + vdi(
            "serve", "--stdio", *(self.made / f"{name}.vdi" for name in names))
        done = receive("--from", command, "-o", self.folder / "got")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        for number, name in enumerate(names):
            self.assertEqual((self.folder / "got" / f"vdi_{number:06}.vdi").read_bytes(), self.bytes_of(name))

    def test_it_ends_with_its_pipe_and_listens_nowhere(self):
        self.appear("small0", "a.vdi")
        with subprocess.Popen([VDI, "serve", "--stdio", self.live], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            self.addCleanup(process.kill)
            first = process.stdout.readline().decode().split()
            self.assertEqual(first[0], "pv-vdi.1")
            self.assertEqual(len(first[1]), 64)
            self.assertFalse(listens(process.pid))
            process.stdin.close()
            self.assertEqual(process.wait(PATIENCE), 0)
            self.assertEqual(process.stdout.read(), b"")

    def test_the_page_shows_what_the_command_offers(self):
        self.appear("small0", "a.vdi")
        server = self.serve("--from", vdi("serve", "--stdio", self.live))
        self.assertIn(b"<title>", server.get("/")[1])
        viewer = self.greeted(server)
        levels = viewer.levels()
        announced, data = next(levels)
        self.assertEqual((announced["frame"], announced["step"], data), (0, 0, self.bytes_of("small0")))
        self.appear("large", "b.vdi")
        received = [next(levels) for _ in range(2)]
        self.assertEqual([(a["frame"], a["level"], a["levels"], a["step"]) for a, _ in received], [(1, 0, 2, 9), (1, 1, 2, 9)])
        self.assertEqual(received[1][1], self.bytes_of("large"))
        # A viewer that comes later has the series, and goes back in it.
        other = self.greeted(server)
        welcome = other.text_message("welcome")
        self.assertEqual(welcome["series"], {"times": [0, 4.5], "steps": [0, 9]})
        other.send(type="show", index=0)
        for announced, data in other.levels():
            if announced["frame"] == 0:
                break
        self.assertEqual(data, self.bytes_of("small0"))
        # The first viewer goes on.
        self.appear("small2", "c.vdi")
        announced, data = next(levels)
        self.assertEqual((announced["frame"], data), (2, self.bytes_of("small2")))
        # The relay fetches frames again that it no longer keeps, and gives a cause for one that is
        # gone.
        for name in "defg":
            self.appear("small1", name + ".vdi")
            next(levels)
        os.remove(self.live / "b.vdi")
        other.send(type="show", index=1)
        while True:
            message = other.message()
            if isinstance(message, dict) and message["type"] == "missing":
                break
        self.assertEqual(message["frame"], 1)
        other.send(type="show", index=2)
        for announced, data in other.levels():
            if announced["frame"] == 2:
                break
        self.assertEqual(data, self.bytes_of("small2"))
        command = serving_at_a_pipe(self.live)
        self.assertEqual(len(command), 1)
        self.assertEqual(server.end(), 0)
        until(lambda: not pathlib.Path(f"/proc/{command[0]}").exists(), "the command's end")

    def test_many_viewers_look_at_many_frames(self):
        count = 12
        for number in range(count):
            shutil.copy(self.made / f"small{number % 3}.vdi", self.live / f"{number:03}.vdi")
        server = self.serve("--from", vdi("serve", "--stdio", "--finished", self.live))
        until(lambda: json.loads(server.get("/status", Authorization="Bearer " + server.token)[1])["frames"] > 0, "a frame")
        viewers = [self.greeted(server) for _ in range(count)]
        for _ in range(2):
            for index, viewer in enumerate(viewers):
                viewer.send(type="show", index=index)
            for index, viewer in enumerate(viewers):
                if index == count - 1:
                    continue  # it may have the newest one already
                for announced, data in viewer.levels():
                    if announced["frame"] == index:
                        break
                self.assertEqual(data, self.bytes_of(f"small{index % 3}"))
            viewers = viewers[1:] + viewers[:1]
        self.assertEqual(server.end(), 0)

    def test_a_command_that_is_killed_is_run_again(self):
        self.appear("small0", "a.vdi")
        server = self.serve("--from", vdi("serve", "--stdio", self.live))
        viewer = self.greeted(server)
        session = viewer.text_message("welcome")["session"]
        self.assertEqual(next(viewer.levels())[1], self.bytes_of("small0"))
        killed = serving_at_a_pipe(self.live)
        os.kill(killed[0], signal.SIGKILL)
        self.assertEqual(viewer.end(), 1001)
        again = None
        end = time.monotonic() + PATIENCE
        while again is None and time.monotonic() < end:
            try:
                again = self.greeted(server)
            except OSError:
                time.sleep(0.1)
        self.assertNotEqual(again.text_message("welcome")["session"], session)
        self.assertEqual(next(again.levels())[1], self.bytes_of("small0"))
        self.assertIn("connection is lost", server.said())
        self.assertEqual(server.end(), 0)

    def test_a_server_of_a_server(self):
        first = self.serve("--token-file", self.token(), self.live)
        second = self.serve("--from", first.address, "--from-token-file", self.token())
        third = self.serve("--from", second.link)
        viewer = self.greeted(third)
        self.appear("large", "a.vdi")
        levels = [data for _, data in (next(viewer.levels()) for _ in range(2))]
        self.assertEqual(levels[1], self.bytes_of("large"))
        self.assertEqual(third.end(), 0)

    def test_viewers_hear_that_the_source_is_gone(self):
        self.appear("small0", "a.vdi")
        first = self.serve("--token-file", self.token(), self.live)
        relay = self.serve("--from", first.address, "--from-token-file", self.token())
        viewer = self.greeted(relay)
        self.assertEqual(next(viewer.levels())[1], self.bytes_of("small0"))
        first.kill()
        while "cause" not in (state := viewer.text_message("state")):
            pass
        self.assertEqual((state["state"], state["cause"]), ("waiting", "the source doesn't answer"))
        self.assertEqual(relay.end(), 0)

    def test_a_relay_answers_for_a_run_that_has_ended(self):
        self.appear("small0", "a.vdi")
        first = self.serve("--token-file", self.token(), self.live)
        relay = self.serve("--from", first.address, "--from-token-file", self.token())
        viewer = self.greeted(relay)
        levels = viewer.levels()
        self.assertEqual(next(levels)[1], self.bytes_of("small0"))
        for index in range(1, 6):
            self.appear(f"small{index % 3}", f"{index}.vdi")
            self.assertEqual(next(levels)[0]["frame"], index)
        self.assertEqual(first.end(), 0)
        while viewer.text_message("state")["state"] != "ended":
            pass
        # A viewer that comes now gets the frames that the relay has kept, and hears that others are gone.
        done = receive(relay.link, "-o", self.folder / "got")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([line for line in done.stderr.splitlines() if "is gone" in line],
                         [f"vdi: frame {index}: the run has ended, and its server is gone" for index in (0, 1)])
        for number in range(4):
            self.assertEqual((self.folder / "got" / f"vdi_{number:06}.vdi").read_bytes(),
                             self.bytes_of(f"small{(number + 2) % 3}"))
        self.assertEqual(relay.end(), 0)

    def test_a_relay_answers_for_frames_that_it_asked_for_before_the_run_ended(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            relay = self.serve("--from", f"http://127.0.0.1:{listener.getsockname()[1]}/#token=" + "t" * 32)
            source = OneViewer(listener, PATIENCE)
            source.welcome("first", [0, 1])
            source.send(type="state", state="live", viewers=1)
            viewer = self.greeted(relay)
            known = 0
            while known < 2:
                message = viewer.message()
                known += len((message.get("series") or message).get("times", []))
            viewer.send(type="show", index=1)
            self.assertEqual(source.text_message("show")["index"], 1)
            source.send(type="state", state="ended", viewers=1)
            source.close()
            missing = viewer.text_message("missing")
            self.assertEqual((missing["frame"], missing["cause"]), (1, "the run has ended, and its server is gone"))
            self.assertEqual(relay.end(), 0)

    def test_receive_gives_up_a_series_whose_source_does_not_answer(self):
        first = self.serve("--token-file", self.token(), *(self.made / f"small{index}.vdi" for index in range(3)))
        relay = self.serve("--from", first.address, "--from-token-file", self.token())
        viewer = self.greeted(relay)
        next(viewer.levels())
        first.kill()
        while "cause" not in viewer.text_message("state"):
            pass
        done = receive(relay.link, "--patience", "1")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no frame for 1 s after 0 frames: the source doesn't answer", done.stderr)
        self.assertEqual(relay.end(), 0)

    def token(self):
        path = self.folder / "token"
        path.write_text("t" * 32)
        return path

    def test_commands_that_offer_nothing(self):
        for command, what in (("exec /nowhere/vdi", "status 127"), ("exec yes", "doesn't start as vdi serve"),
                              ("exec " + vdi("serve", "--stdio", self.folder / "nothing"), "status 1")):
            done = receive("--from", command, "--patience", "1")
            self.assertEqual(done.returncode, 1, command)
            self.assertIn(what, done.stderr)
        done = run("serve", "--from", "exec /nowhere/vdi")
        self.assertEqual(done.returncode, 1)
        self.assertIn("status 127", done.stderr)
        for wrong in ([], ["--from", "true", self.live], ["--stdio"], ["--stdio", "--from", "true"],
                      ["--stdio", "--port", "8080", self.live], ["--from-token-file", "file", self.live]):
            done = run("serve", *wrong)
            self.assertEqual(done.returncode, 2, wrong)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(receive().returncode, 2)


if __name__ == "__main__":
    unittest.main(verbosity=2)
