"""`vdi serve` and `vdi receive` as users run them. Argument: vdi."""
import os
import pathlib
import resource
import shutil
import signal
import socket
import subprocess
import threading
import time
import unittest

from proxy import BARE, NGINX, Nginx, example
from tool import PATIENCE, VDI, ServedFolder, make, receive, run, until
from viewer import Closed, OneViewer, Refused


class ServeTest(ServedFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, size, step in (("small0", "24x24x24", 3), ("small1", "24x24x24", 4)):
            make(cls.made / f"{name}.vdi", size, "48x32", 6, step)
        # Beyond a MiB in memory: two levels.
        make(cls.made / "large.vdi", "24x24x24", "320x240", 8)

    def test_files_arrive_as_they_are(self):
        server = self.serve(self.made / "small0.vdi", self.made / "large.vdi", self.made / "small1.vdi")
        done = receive(server.link, "-o", self.folder / "got", "--render", self.folder / "picture.png")
        self.assertEqual(done.returncode, 0, done.stderr)
        for index, made in enumerate(("small0", "large", "small1")):
            self.assertEqual((self.folder / "got" / f"vdi_{index:06}.vdi").read_bytes(), self.bytes_of(made))
        self.assertTrue((self.folder / "picture.png").read_bytes().startswith(b"\x89PNG"))
        self.assertEqual(server.end(), 0)
        self.assertEqual(server.said(), "")

    def test_a_folder_is_followed(self):
        server = self.serve(self.live)
        viewer = self.greeted(server)
        self.assertEqual(viewer.text_message("state")["state"], "waiting")
        levels = viewer.levels()
        (self.live / "a.vdi").write_bytes(self.bytes_of("small0")[:5000])
        (self.live / "notes.txt").write_text("no VDI")
        until(lambda: "a.vdi" in server.said(), "a line on the half file")
        self.appear("small1", "b.vdi")
        announced, data = next(levels)
        self.assertEqual((announced["step"], announced["time"], announced["frame"]), (4, 2.0, 0))
        self.assertEqual(data, self.bytes_of("small1"))
        (self.live / "a.vdi").write_bytes(self.bytes_of("small0"))
        self.assertEqual(next(levels)[1], self.bytes_of("small0"))
        self.assertEqual(server.said().count("\n"), 1, server.said())
        # The folder disappears, which is reported once, and comes back.
        shutil.rmtree(self.live)
        until(lambda: server.said().count("\n") == 2, "a line on the folder")
        self.live.mkdir()
        self.appear("large", "c.vdi")
        announced, data = next(levels)
        self.assertEqual((announced["level"], announced["levels"]), (0, 2))
        self.assertEqual((announced["width"], announced["height"]), (107, 80))
        self.assertEqual(next(levels)[1], self.bytes_of("large"))

    def test_a_series_grows_and_is_shown(self):
        self.appear("small0", "step2.vdi")
        self.appear("small1", "step10.vdi")
        server = self.serve(self.live)
        until(lambda: server.get("/status", Authorization="Bearer " + server.token)[1].find(b'"live"') > 0, "a frame")
        viewer = self.greeted(server)
        welcome = viewer.text_message("welcome")
        self.assertEqual(welcome["series"], {"times": [1.5, 2.0], "steps": [3, 4]})
        levels = viewer.levels()
        self.assertEqual(next(levels)[0]["frame"], 1)
        viewer.send(type="show", index=0)
        announced, data = next(levels)
        self.assertEqual((announced["frame"], data), (0, self.bytes_of("small0")))
        os.remove(self.live / "step10.vdi")
        viewer.send(type="show", index=1)
        self.assertEqual(viewer.text_message("missing")["frame"], 1)
        self.appear("small1", "step11.vdi")
        part = viewer.text_message("series")
        self.assertEqual((part["from"], part["steps"]), (2, [4]))
        viewer.send(type="resume")
        frames = [next(levels)[0]["frame"]]
        if frames == [1]:  # the series lists a frame a moment before it is the newest
            frames.append(next(levels)[0]["frame"])
        self.assertEqual(frames[-1], 2)
        viewer.send(type="show", index=9)
        self.assertEqual(viewer.end(), 4400)

    def test_a_large_folder_costs_little(self):
        for number in range(6000):
            os.link(self.made / "small0.vdi", self.live / f"{number:06}.vdi")
        server = self.serve(self.live)
        viewer = self.greeted(server)
        levels = viewer.levels()
        self.assertEqual(next(levels)[0]["frame"], 5999)
        idle = 4
        before = server.ticks()
        time.sleep(idle)
        spent = (server.ticks() - before) / os.sysconf("SC_CLK_TCK")
        self.assertLess(spent, 0.04 * idle)
        # The folder is still watched.
        for number in range(3):
            self.appear(f"small{(number + 1) % 2}", "z.vdi")
            self.assertEqual(next(levels)[0]["frame"], 6000 + number)
        self.assertEqual(server.end(), 0)
        self.assertEqual(server.said(), "")

    def test_links_to_files_of_the_folder_are_no_frames(self):
        server = self.serve(self.live)
        viewer = self.greeted(server)
        levels = viewer.levels()
        (self.folder / "way").symlink_to(self.live)
        self.appear("small0", "a.vdi")
        for name, target in (("absolute", self.live / "a.vdi"), ("here", "./a.vdi"), ("bare", "a.vdi"),
                             ("around", self.folder / "way" / "a.vdi"), ("link", self.live / "bare.vdi")):
            (self.live / f"{name}.vdi").symlink_to(target)
        shutil.copy(self.made / "large.vdi", self.folder / "elsewhere.vdi")
        (self.live / "z.vdi").symlink_to(self.folder / "elsewhere.vdi")
        while next(levels)[1] != self.bytes_of("large"):
            pass
        other = self.greeted(server)
        self.assertEqual(other.text_message("welcome")["series"]["steps"], [3, 0])
        self.assertEqual(server.end(), 0)

    def test_replaced_files_are_new_frames(self):
        self.appear("small0", "a.vdi")
        server = self.serve(self.live)
        viewer = self.greeted(server)
        levels = viewer.levels()
        self.assertEqual(next(levels)[1], self.bytes_of("small0"))
        # Another viewer has the server keep the frame.
        other = self.greeted(server)
        other.send(type="show", index=0)
        self.assertEqual(next(other.levels())[1], self.bytes_of("small0"))
        # A file that was only touched, or written again as it was, is no new frame.
        os.utime(self.live / "a.vdi")
        self.appear("small0", "a.vdi")
        self.appear("small1", "a.vdi")
        announced, data = next(levels)
        self.assertEqual((announced["frame"], announced["step"], data), (1, 4, self.bytes_of("small1")))
        for asking in (viewer, other):
            asking.send(type="show", index=0)
            missing = asking.text_message("missing")
            self.assertEqual((missing["frame"], missing["cause"]), (0, "the file was replaced"))
        os.utime(self.live / "a.vdi")
        other.send(type="show", index=1)
        self.assertEqual(next(other.levels())[1], self.bytes_of("small1"))
        # Nor is a file that was away for a while.
        os.remove(self.live / "a.vdi")
        time.sleep(1)
        self.appear("small1", "a.vdi")
        self.appear("small0", "b.vdi")
        until(lambda: server.frames() == 3, "the frame of b.vdi")
        viewer.send(type="resume")
        announced, data = next(levels)
        self.assertEqual((announced["frame"], data), (2, self.bytes_of("small0")))
        self.assertEqual(server.end(), 0)

    def test_tokens(self):
        server = self.serve(self.made / "small0.vdi")
        self.assertEqual(len(server.token), 64)
        done = receive(server.address + "#token=" + "0" * 64, "--frames", 1)
        self.assertEqual(done.returncode, 2)
        self.assertIn("token is wrong", done.stderr)
        self.assertEqual(receive(server.address, "--frames", 1).returncode, 2)
        self.assertEqual(server.get("/status")[0].status, 401)
        self.assertEqual(server.get("/status", Authorization="Bearer " + "0" * 64)[0].status, 401)
        self.assertEqual(server.get("/status", Authorization="Bearer " + server.token)[0].status, 200)
        # The server never prints a token that the user has given.
        secret = "a.secret-of-the_user~0"
        file = self.folder / "token"
        file.write_text(secret + "\n")
        for arguments, environment in ((["--token-file", file], None), ([], {"VDI_TOKEN": secret})):
            given = self.serve(self.made / "small0.vdi", *arguments, environment=environment)
            self.assertNotIn("token", given.link)
            done = receive(given.link, "--frames", 1, *arguments, environment=environment)
            self.assertEqual(done.returncode, 0, done.stderr)
            given.end()
            self.assertNotIn(secret, given.said())
        # Only a file that others can read gets a line.
        for mode, lines in ((0o600, 0), (0o640, 1), (0o604, 1)):
            file.chmod(mode)
            given = self.serve(self.made / "small0.vdi", "--token-file", file)
            given.end()
            self.assertEqual(given.said().count("\n"), lines, given.said())
            self.assertEqual(given.said().count(f"vdi: warning: other users can read the token in {file}"), lines)
        file.write_text("short\n")
        done = run("serve", self.live, "--token-file", file)
        self.assertEqual(done.returncode, 2)
        self.assertNotIn("short\n", done.stderr)

    def test_no_token_stays_on_a_command_line(self):
        server = self.serve(self.live)
        relay = self.serve("--from", server.link)
        receiver, _ = self.record(relay.link)
        for process in (relay.process, receiver):
            shown = pathlib.Path(f"/proc/{process.pid}/cmdline")
            until(lambda shown=shown: b"#token=xxxx" in shown.read_bytes(), "a command line without a token")
            for token in (server.token, relay.token):
                self.assertNotIn(token.encode(), shown.read_bytes())
        until(lambda: relay.viewers() == 1, "a viewer, whose link still works")
        receiver.kill()
        receiver.wait(PATIENCE)

    def test_http(self):
        server = self.serve(self.made / "small0.vdi")
        reply, body = server.get("/")
        self.assertEqual(reply.status, 200)
        self.assertIn(b"<canvas", body)
        self.assertNotIn(server.token.encode(), body)
        policy = reply.getheader("Content-Security-Policy")
        self.assertIn("default-src 'none'", policy)
        self.assertNotIn("unsafe-inline' 'sha256", policy)
        self.assertEqual(reply.getheader("Referrer-Policy"), "no-referrer")
        self.assertEqual(reply.getheader("X-Content-Type-Options"), "nosniff")
        for path in ("/small0.vdi", "//etc/passwd", "/../small0.vdi", "/%2e%2e/", "/index.html", "/stream/"):
            self.assertEqual(server.get(path)[0].status, 404, path)
        for path in ("/?", "/?a=b/c", "/?token=x&y"):
            self.assertEqual(server.get(path)[1], body, path)
        self.assertEqual(server.get("/status?x", Authorization="Bearer " + server.token)[0].status, 200)
        # What a page asks when its WebSocket didn't open.
        own = f"http://127.0.0.1:{server.port}"
        for target, status in (("/stream", 426), (f"/stream?origin={own}", 426),
                               ("/stream?origin=https%3A%2F%2Fa.example", 403)):
            self.assertEqual(server.get(target)[0].status, status, target)
        self.assertIn("frame-ancestors 'none'", policy)
        desk = self.serve(self.live, "--embed-in", "https://desk.example", "--embed-in", "http://b.example:81")
        policy = desk.get("/")[0].getheader("Content-Security-Policy")
        self.assertTrue(policy.endswith("frame-ancestors https://desk.example http://b.example:81"), policy)

    def test_http_codes(self):
        """Status codes for requests that aren't understood, and for other methods."""
        server = self.serve(self.made / "small0.vdi")
        host = b" HTTP/1.1\r\nHost: a\r\n"
        cases = {b"hello\r\n\r\n": 400, b"GET / HTTP/1.1\r\nno field\r\n\r\n": 400, b"GET / HTTP/1.1\r\n\r\n": 400,
                 b"GET /" + host + b"X: " + b"a" * 9000: 431, b"POST /" + host + b"\r\n": 405,
                 b"POST /status" + host + b"Content-Length: 5\r\n\r\nhello": 405, b"DELETE /?a" + host + b"\r\n": 405,
                 b"POST /x" + host + b"\r\n": 404, b"HEAD /" + host + b"\r\n": 200}
        for request, status in cases.items():
            with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE) as peer:
                peer.sendall(request)
                reply = peer.makefile("rb").read().decode()
            self.assertTrue(reply.startswith(f"HTTP/1.1 {status} "), f"{request[:40]}: {reply[:80]}")
            self.assertEqual("Allow: GET, HEAD" in reply, status == 405, reply)
        for scheme in ("bearer", "BEARER", "Bearer  "):
            self.assertEqual(server.get("/status", Authorization=f"{scheme} {server.token}")[0].status, 200, scheme)
        self.assertEqual(server.get("/status", Authorization=f"Basic {server.token}")[0].status, 401)

    def test_a_head_without_an_end(self):
        server = self.serve(self.made / "small0.vdi")
        for line in (b"GET /", b"GET / HTTP/1.1\r\nX: "):
            endless = socket.create_connection(("127.0.0.1", server.port), PATIENCE)
            self.addCleanup(endless.close)
            endless.sendall(line)
            sent = 0
            with self.assertRaises(ConnectionError):
                while True:
                    sent += endless.send(b"x" * 1000)
                    self.assertLess(sent, 1 << 26)
        self.assertEqual(server.get("/")[0].status, 200)
        self.assertEqual(server.end(), 0)

    def test_a_full_disk(self):
        server = self.serve(self.made / "large.vdi")
        done = receive(server.link, "-o", self.folder / "got", restore_signals=False,  # SIGXFSZ stays ignored
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)))
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(list((self.folder / "got").iterdir()), [])
        self.assertEqual(server.end(), 0)

    def test_origins(self):
        server = self.serve(self.made / "small0.vdi", "--origin", "https://desk.example")
        for origin in ("https://desk.example", f"http://127.0.0.1:{server.port}"):
            viewer = self.view(server, origin=origin)
            viewer.hello(server.token)
            self.assertEqual(viewer.message()["type"], "welcome")
        for origin in ("https://other.example", "null", "http://127.0.0.1", f"http://127.0.0.1:{server.port}.example"):
            with self.assertRaises(Refused, msg=origin):
                self.view(server, origin=origin)
        # Each refused origin got one line, which names the option that allows it.
        for origin in ("https://other.example", "null", "https://" + "x" * 400):
            with self.assertRaises(Refused):
                self.view(server, origin=origin)
        lines = server.said().splitlines()
        self.assertEqual(len(lines), 3, lines)  # one for all whose names are no origins
        self.assertEqual(lines[0], "vdi: pages of https://other.example may not connect; to allow it, use "
                                   "--origin https://other.example")
        with self.assertRaises(Refused):
            self.view(server, protocol="pv-vdi.2")
        with self.assertRaises(Refused):
            self.view(server, target="/")

    @unittest.skipUnless(NGINX, "nginx is missing")
    def test_behind_a_proxy(self):
        server = self.serve(self.made / "small0.vdi", "--finished")
        with Nginx(server.port, example()) as proxy:
            link = proxy.address + "#token=" + server.token
            relay = self.serve("--from", link)
            for address in (link, link.replace("/#", "#"), relay.link):
                done = receive(address, "-o", self.folder / "got")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual((self.folder / "got" / "vdi_000000.vdi").read_bytes(), self.bytes_of("small0"))
                shutil.rmtree(self.folder / "got")
            done = receive(link.replace("/vdi/", "/other/"), "--frames", 1)
            self.assertEqual((done.returncode, done.stderr.count("HTTP status 404")), (1, 1), done.stderr)
        self.assertEqual(server.said(), "")
        with Nginx(server.port, BARE) as proxy:
            self.assertEqual(receive(proxy.address + "#token=" + server.token, "--frames", 1).returncode, 1)
        self.assertEqual(server.said().count("\n"), 1, server.said())
        self.assertIn("passes no WebSockets on", server.said())

    def test_options_that_could_not_work(self):
        texts = ("foo", "null", "https://a.example/", "https://a.example/path", "a.example", "HTTPS://a.example",
                 "https://A.example", "https://a.example:443", "http://a.example:80", "http://a.example:", "http://:8080",
                 "*", "", "http://a.example:08", "https://u@a.example", "http://[::1")
        wrong = [["--origin", text] for text in texts] + [["--embed-in", "*"]]
        for arguments in [*wrong, ["--viewers", "0"]]:
            done = run("serve", self.live, *arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            if arguments in wrong:
                self.assertIn("https://example.org", done.stderr)
        for origin in ("http://a.example:8080", "https://a-b.example", "http://127.0.0.1:8000", "http://[::1]:8080"):
            self.assertEqual(self.serve(self.live, "--origin", origin).end(), 0)

    def test_bad_messages(self):
        server = self.serve(self.made / "small0.vdi")
        good = {"type": "hello", "version": 1, "token": server.token}
        cases = [
            (4409, lambda v: v.hello(server.token, version=2)),
            (4401, lambda v: v.hello(server.token[:-1])),
            (4401, lambda v: v.hello("")),
            (4400, lambda v: v.send(type="pause")),
            (4400, lambda v: v.send(type="hello", version=1)),
            (4400, lambda v: v.send_text("[" * 3000)),
            (4400, lambda v: v.send_text("{")),
            (4400, lambda v: v.send_text('{"type": 1}')),
            (4400, lambda v: v.send(**{**good, "version": -1})),
            (4400, lambda v: v.send_frame(2, b"bytes")),
            (1009, lambda v: v.send_text(" " * 5000)),
            (4400, lambda v: (v.hello(server.token), v.hello(server.token))),
            (4400, lambda v: (v.hello(server.token), v.send(type="dance"))),
            (4400, lambda v: (v.hello(server.token), v.send(type="ack", frame=0, level=0))),
        ]
        for code, talk in cases:
            viewer = self.view(server)
            talk(viewer)
            self.assertEqual(viewer.end(), code)
        late = self.view(server)  # says nothing
        self.assertEqual(late.end(), 4408)
        # Acknowledgements of what wasn't sent, and the same one again, do no harm.
        viewer = self.greeted(server)
        for _ in range(100):
            viewer.send(type="ack", frame=77, level=3, bytes=1 << 40)
        self.assertEqual(next(viewer.levels())[1], self.bytes_of("small0"))
        self.assertEqual(server.end(), 0)

    def test_a_stalled_viewer_holds_up_nobody(self):
        server = self.serve(self.live)
        stalled = self.greeted(server)
        gone = self.greeted(server)
        last, seen = {}, {}

        def look(number):
            viewer = self.greeted(server)
            for announced, data in viewer.levels():
                last[number] = (announced["step"], data)
                seen[number] = announced["frame"]
                if announced["step"] == 4:
                    break

        threads = [threading.Thread(target=look, args=(number,)) for number in range(6)]
        for thread in threads:
            thread.start()
        until(lambda: server.get("/status", Authorization="Bearer " + server.token)[1].find(b'"viewers":8') > 0, "8 viewers")
        for number in range(10):
            self.appear("large", f"a{number}.vdi")
            until(lambda number=number: seen.get(0, -1) >= number, f"frame {number}")
            if number == 3:
                gone.close()
        self.appear("small1", "z.vdi")
        for thread in threads:
            thread.join(PATIENCE)
            self.assertFalse(thread.is_alive())
        self.assertEqual(set(last), set(range(6)))
        for step, data in last.values():
            self.assertEqual((step, data), (4, self.bytes_of("small1")))
        # The stalled viewer has missed frames; it now gets the newest.
        for announced, data in stalled.levels():
            if announced["step"] == 4:
                break
        self.assertEqual(data, self.bytes_of("small1"))
        self.assertGreater(announced["dropped"], 0)
        self.assertEqual(server.end(), 0)

    def test_a_server_killed_in_mid_frame_is_found_again(self):
        self.appear("small0", "a.vdi")
        token = self.folder / "token"
        token.touch(0o600)
        token.write_text("t" * 32)
        server = self.serve(self.live, "--token-file", token, "--rate", "400kbit")  # too little for a large one
        got = self.folder / "got"
        recorder = subprocess.Popen([VDI, "receive", server.address, "--token-file", token, "-o", got, "--frames", "2",
                                     "--patience", str(PATIENCE)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                    text=True)
        self.addCleanup(recorder.kill)
        until((got / "vdi_000000.vdi").exists, "the first frame")
        self.appear("large", "b.vdi")
        witness = self.view(server)
        witness.hello(token.read_text())
        while not isinstance(part := witness.message(), tuple) or part[0] != 1:
            pass
        server.kill()
        until(lambda: "" != recorder.stderr.readline(), "a line on the lost connection")
        os.remove(self.live / "a.vdi")
        again = self.serve(self.live, "--token-file", token, "--port", server.port)
        self.assertEqual(recorder.wait(PATIENCE), 0)
        recorder.stderr.close()
        self.assertEqual((got / "vdi_000001.vdi").read_bytes(), self.bytes_of("large"))
        again.end()
        done = receive(again.address, "--token-file", token, "--patience", "0.5")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no connection", done.stderr)

    def record(self, link):
        """A vdi receive that stores in `got`, and that folder."""
        got = self.folder / "got"
        recorder = subprocess.Popen([VDI, "receive", link, "-o", got], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(recorder.kill)
        return recorder, got

    def test_a_followed_folder_ends_with_its_server(self):
        self.appear("small0", "a.vdi")
        server = self.serve(self.live)
        recorder, got = self.record(server.link)
        until((got / "vdi_000000.vdi").exists, "the first frame")
        self.appear("small1", "b.vdi")
        until((got / "vdi_000001.vdi").exists, "the second frame")
        self.assertEqual(server.end(signal.SIGINT), 0)
        self.assertEqual(recorder.wait(PATIENCE), 0)
        self.assertEqual(len(list(got.iterdir())), 2)

    def test_a_finished_series_goes_on_when_its_server_comes_back(self):
        names = ["small0", "small1", "large"]
        with socket.create_server(("127.0.0.1", 0)) as listener:
            recorder, got = self.record(f"http://127.0.0.1:{listener.getsockname()[1]}/#token=" + "t" * 32)
            first = OneViewer(listener, PATIENCE)
            first.welcome("first", [0, 1, 2])
            first.send(type="state", state="ended", viewers=1)
            self.assertEqual(first.text_message("show")["index"], 0)
            first.send_level(0, self.bytes_of(names[0]))
            self.assertEqual(first.text_message("show")["index"], 1)
            first.close()
            # The new server answers before it has listed its files, and then lists one after the other.
            again = OneViewer(listener, PATIENCE)
            self.addCleanup(again.close)
            again.text_message("hello")
            again.welcome("again", None)
            again.send(type="state", state="waiting", viewers=1)
            again.send(type="series", times=[0], steps=[0], **{"from": 0})
            again.socket.settimeout(0.5)
            with self.assertRaises(socket.timeout):  # no client requests an unlisted frame
                self.assertIsNone(again.message())
            again.socket.settimeout(PATIENCE)
            again.send(type="series", times=[1, 2], steps=[1, 2], **{"from": 1})
            again.send(type="state", state="ended", viewers=1)
            for index in (1, 2):
                self.assertEqual(again.text_message("show")["index"], index)
                again.send_level(index, self.bytes_of(names[index]))
            self.assertEqual(recorder.wait(PATIENCE), 0)
        for index, name in enumerate(names):
            self.assertEqual((got / f"vdi_{index:06}.vdi").read_bytes(), self.bytes_of(name))

    def test_a_viewer_that_comes_back_gets_what_it_lacks(self):
        server = self.serve(self.made / "large.vdi")
        viewer = self.greeted(server)
        session = viewer.text_message("welcome")["session"]
        levels = viewer.levels()
        self.assertEqual([next(levels)[0]["level"] for _ in range(2)], [0, 1])
        viewer.close()
        back = self.greeted(server, have=0, session=session)
        back.text_message("state")
        back.send(type="show", index=5)
        with self.assertRaises(Closed):  # nothing came before the end
            while True:
                message = back.message()
                self.assertNotEqual(message["type"], "level")
        other = self.greeted(server, have=0, session="another server's")
        self.assertEqual(other.text_message("level")["frame"], 0)

    def test_connections_are_bounded(self):
        server = self.serve(self.made / "small0.vdi", "--viewers", 2)
        viewers = [self.view(server) for _ in range(3)]
        for viewer in viewers[:2]:
            viewer.hello(server.token)
            self.assertEqual(viewer.message()["type"], "welcome")
        viewers[2].hello(server.token)
        self.assertEqual(viewers[2].end(), 4503)
        # Many connections that send nothing, or one byte at a time: beyond the limit they are
        # closed at once.
        quiet = []
        for _ in range(300):
            connection = socket.create_connection(("127.0.0.1", server.port), PATIENCE)
            connection.sendall(b"GET / HTTP/1.1\r\nX: ")
            quiet.append(connection)
        for connection in quiet:
            try:
                while connection.recv(1 << 12):
                    pass
            except ConnectionError:
                pass
            connection.close()
        self.assertEqual(server.get("/")[0].status, 200)
        viewers[0].send(type="pause")
        viewers[0].send(type="show", index=0)
        self.assertEqual(server.end(), 0)

    def test_the_port_is_taken(self):
        server = self.serve(self.made / "small0.vdi")
        done = run("serve", self.live, "--port", server.port)
        self.assertEqual(done.returncode, 1)
        self.assertIn("can't listen", done.stderr)
        for wrong in ([self.folder / "nothing"], [self.live, "--certificate", "nothing.pem"],
                      [self.made / "small0.vdi", self.folder / "nothing.vdi"], [self.live, "--rate", "fast"]):
            done = run("serve", *wrong)
            self.assertIn(done.returncode, (1, 2), wrong)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
